//! The cells of a sheet as a text that keeps what they are: numbers, parts of a hundred, dates, times, formulas without results.

use std::collections::HashSet;
use std::io::Cursor;

use calamine::{Data, ExcelDateTime, Range, Reader, Sheets, StyleRange};
use measurement::import::is_unit;

use super::percent;

/// Spreadsheets count in days.
const SECONDS_OF_A_DAY: f64 = 86_400.0;
/// What is less is a time of day, in whose format no day is seen: dates begin in 1900, or 1904 (ECMA-376, part 1, 18.17.4.1).
const A_YEAR: f64 = 366.0;

/// A sheet, as it is stored.
pub(super) struct Sheet {
    cells: Range<Data>,
    formulas: Option<Range<String>>,
    /// Formats of cells, where the file's kind tells them.
    styles: Option<StyleRange>,
    /// Columns in percent, where no formats tell them.
    percent: HashSet<u32>,
}

impl Sheet {
    /// The sheet of this name, where it can be read.
    pub(super) fn read(file: &[u8], book: &mut Sheets<Cursor<&[u8]>>, name: &str) -> Option<Self> {
        let place = book.sheet_names().iter().position(|known| known == name)?;
        Some(Self {
            cells: book.worksheet_range(name).ok()?,
            formulas: book.worksheet_formula(name).ok(),
            styles: book.worksheet_style(name).ok(),
            percent: percent::columns(file, place),
        })
    }

    /// Lines of cells between tabs, each line with the number of its row.
    pub(super) fn text(&self) -> String {
        let Some((above, left)) = self.cells.start() else {
            return String::new();
        };
        let line = |(row, cells): (u32, &[Data])| {
            let cells = (left..).zip(cells);
            let cells: Vec<String> = cells
                .map(|(column, cell)| self.cell(cell, (row, column)))
                .collect();
            cells.join("\t") + "\n"
        };
        let lines = (above..).zip(self.cells.rows()).map(line);
        "\n".repeat(above as usize) + &lines.collect::<String>()
    }

    fn cell(&self, data: &Data, place: (u32, u32)) -> String {
        match data {
            Data::DateTime(instant) if instant.is_datetime() => time(instant),
            Data::DateTime(duration) => format!("PT{}S", duration.as_f64() * SECONDS_OF_A_DAY),
            Data::DateTimeIso(date) if !date.contains('T') => format!("{date}T00:00:00"),
            Data::Float(number) => self.number(*number, place),
            Data::Int(number) => self.number(*number as f64, place),
            Data::Error(_) => String::new(),
            Data::Empty => self.formula(place),
            other => other.to_string().replace(['\t', '\n', '\r'], " "),
        }
    }

    /// A number with what its cell's format writes behind it.
    fn number(&self, number: f64, place: (u32, u32)) -> String {
        if self.is_percent(place) {
            return format!("{}%", in_percent(number));
        }
        match self.unit(place) {
            Some(unit) => format!("{number} {unit}"),
            None => number.to_string(),
        }
    }

    /// The formula in an empty cell.
    fn formula(&self, place: (u32, u32)) -> String {
        let formulas = self.formulas.as_ref();
        match formulas.and_then(|formulas| formulas.get_value(place)) {
            Some(formula) if !formula.is_empty() => {
                format!("={}", formula.trim_start_matches('=')).replace(['\t', '\n', '\r'], " ")
            }
            _ => String::new(),
        }
    }

    /// Whether a cell is shown a hundred times as large, with `%`.
    fn is_percent(&self, place: (u32, u32)) -> bool {
        // What stands between quotation marks is text.
        let is_in_format = self.format(place).is_some_and(|format| {
            let mut outside = format.split('"').step_by(2);
            outside.any(|part| part.replace("\\%", "").contains('%'))
        });
        is_in_format || self.percent.contains(&place.1)
    }

    /// The unit that a cell's format writes behind its number, as `0.00" mm"` does.
    fn unit(&self, place: (u32, u32)) -> Option<&str> {
        let positive = self.format(place)?.split(';').next()?;
        let mut texts = positive.split('"').skip(1).step_by(2);
        texts.next().map(str::trim).filter(|text| is_unit(text))
    }

    /// How a cell's number is shown (ECMA-376, part 1, 18.8.31).
    fn format(&self, place: (u32, u32)) -> Option<&str> {
        let style = self.styles.as_ref()?.get(place)?;
        Some(&style.number_format.as_ref()?.format_code)
    }
}

/// Parts of a hundred, as a sheet shows them: with the fifteen digits that it has, and none more of 0.07 times 100.
fn in_percent(part: f64) -> f64 {
    format!("{:.14e}", 100.0 * part).parse().unwrap_or(f64::NAN)
}

/// A date and a time, or a time of day alone.
fn time(instant: &ExcelDateTime) -> String {
    let (year, month, day, hour, minute, second, milli) = instant.to_ymd_hms_milli();
    let clock = format!("{hour:02}:{minute:02}:{second:02}.{milli:03}");
    match instant.as_f64() < A_YEAR {
        true => clock,
        false => format!("{year:04}-{month:02}-{day:02}T{clock}"),
    }
}
