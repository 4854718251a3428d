//! A text as named columns of numbers.

use super::ImportError;

/// Delimiters in the order in which they are preferred where a line splits alike: a comma may be a decimal one.
const DELIMITERS: [char; 4] = ['\t', ';', ',', ' '];
/// Lines that tell how a table is written.
const TELLING: usize = 200;

/// Named columns of numbers, as a text has them.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The columns' names; their numbers where the text has no header.
    pub names: Vec<String>,
    /// The rows; `None` where a cell holds no number.
    pub rows: Vec<Vec<Option<f64>>>,
    /// How the text is written, in words.
    pub written: String,
}

/// How a text is written.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Style {
    delimiter: char,
    decimal_comma: bool,
}

impl Table {
    /// Reads a text of unknown style: UTF-8, UTF-16 with its mark, or Latin-1; tabs, semicolons, commas or blanks between cells;
    /// points or commas in numbers. Lines that begin with `#` or `%` are comments, and lines before the table are passed over.
    ///
    /// # Errors
    /// Where no two lines have as many cells, two or more, with numbers in them.
    pub fn read(bytes: &[u8]) -> Result<Self, ImportError> {
        let (text, encoding) = decoded(bytes);
        let is_told = |line: &&str| !line.trim().is_empty() && !line.starts_with(['#', '%']);
        let lines: Vec<&str> = text.lines().filter(is_told).collect();
        let style = Style::of(&lines).ok_or_else(|| {
            ImportError::new(
                "this is no table of numbers",
                "a table has a row a line, with commas, semicolons, tabs or blanks between its cells; of a spreadsheet, save the sheet as CSV",
            )
        })?;
        let width = style.width(&lines);
        let first = lines
            .iter()
            .position(|line| style.numbers(line) >= 2 && style.cells(line).len() == width)
            .unwrap_or(0);
        let header = first.checked_sub(1).map(|above| style.cells(lines[above]));
        let names = match header.filter(|cells| cells.len() == width) {
            Some(cells) => cells.into_iter().map(str::to_owned).collect(),
            None => (1..=width).map(|number| number.to_string()).collect(),
        };
        let rows = lines[first..].iter().map(|line| {
            let cells = style.cells(line);
            let cell = |index: usize| style.number(cells.get(index)?);
            (0..width).map(cell).collect()
        });
        Ok(Self {
            names,
            rows: rows.collect(),
            written: format!("{encoding}, {}", style.words()),
        })
    }
}

/// The text of these bytes, and what it is encoded in.
fn decoded(bytes: &[u8]) -> (String, &'static str) {
    let utf_16 = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes.chunks_exact(2).map(|b| unit([b[0], b[1]])).collect();
        (String::from_utf16_lossy(&units), "UTF-16")
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => utf_16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf_16(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => (String::from_utf8_lossy(rest).into_owned(), "UTF-8"),
        _ => match std::str::from_utf8(bytes) {
            Ok(text) => (text.to_owned(), "UTF-8"),
            // The first 256 characters of Unicode are those of Latin-1.
            Err(_) => (bytes.iter().map(|&b| char::from(b)).collect(), "Latin-1"),
        },
    }
}

impl Style {
    /// The style in which most cells of the first lines are numbers, in lines of equal width.
    fn of(lines: &[&str]) -> Option<Self> {
        let styles = DELIMITERS.iter().flat_map(|&delimiter| {
            [false, true].map(|decimal_comma| Self {
                delimiter,
                decimal_comma,
            })
        });
        let told = &lines[..lines.len().min(TELLING)];
        let numbers = |style: &Self| {
            let width = style.width(told);
            let whole = told.iter().filter(|line| style.cells(line).len() == width);
            whole.map(|line| style.numbers(line)).sum::<usize>()
        };
        let mut best: Option<(usize, Self)> = None;
        for style in styles.filter(|style| !(style.delimiter == ',' && style.decimal_comma)) {
            let found = numbers(&style);
            let is_table = style.width(told) >= 2 && found >= 4;
            if is_table && best.is_none_or(|(most, _)| found > most) {
                best = Some((found, style));
            }
        }
        best.map(|(_, style)| style)
    }

    /// How many cells most lines have.
    fn width(self, lines: &[&str]) -> usize {
        let told = &lines[..lines.len().min(TELLING)];
        let mut widths: Vec<usize> = told.iter().map(|line| self.cells(line).len()).collect();
        widths.sort_unstable();
        widths.get(widths.len() / 2).copied().unwrap_or(0)
    }

    fn cells(self, line: &str) -> Vec<&str> {
        let cells: Vec<&str> = if self.delimiter == ' ' {
            line.split_whitespace().collect()
        } else {
            line.split(self.delimiter).collect()
        };
        cells
            .into_iter()
            .map(|cell| cell.trim().trim_matches('"').trim())
            .collect()
    }

    fn number(self, cell: &str) -> Option<f64> {
        let number: f64 = if self.decimal_comma {
            cell.replace(',', ".").parse().ok()?
        } else {
            cell.parse().ok()?
        };
        number.is_finite().then_some(number)
    }

    fn numbers(self, line: &str) -> usize {
        let cells = self.cells(line);
        cells
            .iter()
            .filter(|cell| self.number(cell).is_some())
            .count()
    }

    fn words(self) -> String {
        let between = match self.delimiter {
            '\t' => "tabs",
            ';' => "semicolons",
            ',' => "commas",
            _ => "blanks",
        };
        let decimal = if self.decimal_comma {
            ", decimal commas"
        } else {
            ""
        };
        format!("{between} between cells{decimal}")
    }
}
