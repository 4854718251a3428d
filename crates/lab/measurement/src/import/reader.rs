//! A column's cells one after the other, and what is to be told of them.

use super::cell::{Cell, Numbers, is_in_doubt};
use super::clock::{Clock, TimeNumber};
use super::heading::Heading;
use super::kind::{Kind, KindOfCells};
use super::qualified::Qualified;
use super::unit::Unit;
use crate::column::Column;
use std::cmp::Ordering;

/// What people and programs write where they have no number.
const NOTHING: [&str; 6] = ["nan", "n/a", "na", "null", "none", "#n/a"];

/// What a cell without a number may be drawn through with.
const BLANK: [char; 7] = ['-', '\u{2013}', '\u{2014}', '.', '/', '_', ' '];

/// Reads a column, and counts what is to be told.
#[derive(Clone)]
pub(super) struct Reader {
    numbers: Numbers,
    /// What its heading says, else the first cell that says any.
    unit: Option<Unit>,
    clock: Clock,
    /// Cells that say how uncertain they are.
    uncertain: Tally,
    /// Cells in another unit than the column's.
    converted: Tally,
    /// Cells that hold something, and no number.
    unread: Tally,
    /// Cells of which only the file's other numbers tell that they have a separator of thousands.
    thousands: Tally,
    /// Cells whose decimal sign may be a separator of thousands.
    doubtful: Tally,
    /// Cells of other kinds than numbers.
    percent: Tally,
    clocks: Tally,
    durations: Tally,
    /// Dates with slashes, in which the day or the month may stand first.
    slashed: Tally,
    /// Whether the other one of them makes other times of the column.
    is_order_taken: bool,
    /// Times that go on from the one before by a clock of twelve hours.
    of_12_hours: Tally,
    /// Whether a cell has a decimal sign that is nothing else.
    is_certain: bool,
}

/// How far apart the least and the greatest are.
fn span(values: &[Option<f64>]) -> f64 {
    let known = || values.iter().flatten().copied();
    known().fold(f64::NEG_INFINITY, f64::max) - known().fold(f64::INFINITY, f64::min)
}

/// Cells of one kind: how many, and the first with its line.
#[derive(Clone, Default)]
struct Tally {
    cells: usize,
    first: Option<(String, usize)>,
}

impl Reader {
    pub(super) fn new(numbers: Numbers, name: &str) -> Self {
        Self {
            numbers,
            unit: Heading::read(name).known_unit(),
            clock: Clock::default(),
            uncertain: Tally::default(),
            converted: Tally::default(),
            unread: Tally::default(),
            thousands: Tally::default(),
            doubtful: Tally::default(),
            percent: Tally::default(),
            clocks: Tally::default(),
            durations: Tally::default(),
            slashed: Tally::default(),
            is_order_taken: false,
            of_12_hours: Tally::default(),
            is_certain: false,
        }
    }

    /// The next cell's number.
    pub(super) fn read(&mut self, text: &str, line: usize) -> Option<f64> {
        let Some(cell) = self.numbers.cell(text) else {
            return self.qualified(text, line);
        };
        match cell {
            Cell::Number(_) => self.count_sign(text, line),
            Cell::Percent(_) => self.percent.count(text, line),
            Cell::Duration(_) => self.durations.count(text, line),
            Cell::Instant(_) | Cell::Clock(_) => self.clocks.count(text, line),
        }
        if text.contains('/') {
            self.slashed.count(text, line);
        }
        let TimeNumber {
            number,
            is_of_12_hours,
        } = self.clock.number(cell);
        if is_of_12_hours {
            self.of_12_hours.count(text, line);
        }
        Some(match cell {
            Cell::Number(_) | Cell::Percent(_) => number,
            _ => number / self.seconds(),
        })
    }

    /// The unit of a column of times (s).
    fn seconds(&self) -> f64 {
        let unit = self.unit.filter(|unit| unit.is_of(Column::Time));
        unit.map_or(1.0, |unit| unit.factor)
    }

    fn count_sign(&mut self, text: &str, line: usize) {
        let has_sign = text.contains(self.numbers.sign());
        match is_in_doubt(text) {
            true if has_sign => self.doubtful.count(text, line),
            true => self.thousands.count(text, line),
            false => self.is_certain |= has_sign,
        }
    }

    /// A number with a unit or an uncertainty, in the column's unit; `None` where that is of something else.
    fn qualified(&mut self, text: &str, line: usize) -> Option<f64> {
        let Qualified {
            number,
            unit,
            is_uncertain,
        } = Qualified::read(text)?;
        let factor = match (unit, self.unit) {
            (Some(unit), Some(of_column)) => unit.per(of_column)?,
            _ => 1.0,
        };
        let Some(Cell::Number(number)) = self.numbers.cell(number) else {
            return None;
        };
        self.unit = self.unit.or(unit);
        if is_uncertain {
            self.uncertain.count(text, line);
        }
        if factor != 1.0 {
            self.converted.count(text, line);
        }
        Some(number * factor)
    }

    /// Its name, with the unit that only its cells say.
    pub(super) fn named(&self, name: &str) -> String {
        match self.unit {
            Some(unit) if Heading::read(name).unit.is_none() => format!("{name} ({})", unit.name),
            _ => name.to_owned(),
        }
    }

    /// Counts a cell that holds no number beside others that do.
    pub(super) fn miss(&mut self, text: &str, line: usize) {
        let is_said = text.contains(|c| !BLANK.contains(&c))
            && !NOTHING
                .iter()
                .any(|nothing| text.eq_ignore_ascii_case(nothing));
        if is_said {
            self.unread.count(text, line);
        }
    }

    /// A column of cells, each with its line, that was read as these values, read in another way where that is better: with the other
    /// decimal sign, where more of it is numbers then, or dates with slashes with the day first, where they are nearer to each other.
    pub(super) fn otherwise<'c>(
        &self,
        name: &str,
        values: Vec<Option<f64>>,
        cells: impl Iterator<Item = Option<(&'c str, usize)>>,
    ) -> Option<(Self, Vec<Option<f64>>)> {
        if self.slashed.cells == 0 {
            let other = Self::new(self.numbers.with_the_other_sign(), name);
            let (other, read) = other.column(cells);
            return (other.unread.cells < self.unread.cells).then_some((other, read));
        }
        let other = Self::new(self.numbers.with_the_day_first(), name);
        let (other, read) = other.column(cells);
        let (taken, values) = match span(&read).total_cmp(&span(&values)) {
            Ordering::Equal => return None,
            Ordering::Less => (other, read),
            Ordering::Greater => (self.clone(), values),
        };
        let taken = Self {
            is_order_taken: true,
            ..taken
        };
        Some((taken, values))
    }

    /// All of a column.
    fn column<'c>(
        mut self,
        cells: impl Iterator<Item = Option<(&'c str, usize)>>,
    ) -> (Self, Vec<Option<f64>>) {
        let read = |cell: Option<(&str, usize)>| {
            let (text, line) = cell?;
            let number = self.read(text, line);
            if number.is_none() {
                self.miss(text, line);
            }
            number
        };
        let values = cells.map(read).collect();
        (self, values)
    }

    /// Whether it may be read otherwise.
    pub(super) fn is_in_question(&self) -> bool {
        self.unread.cells > 0 || self.slashed.cells > 0
    }

    /// The first cell of each kind in this column of the table.
    pub(super) fn kinds(&self, column: usize) -> impl Iterator<Item = KindOfCells> {
        let durations = match self.clock.is_one {
            true => Kind::Clock,
            false => Kind::Duration,
        };
        let kinds = [
            (Kind::Percent, &self.percent),
            (Kind::Clock, &self.clocks),
            (durations, &self.durations),
        ];
        kinds.into_iter().filter_map(move |(kind, tally)| {
            let (cell, line) = tally.first.clone()?;
            Some(KindOfCells {
                column,
                kind,
                cell,
                line,
            })
        })
    }

    pub(super) fn is_certain(&self) -> bool {
        self.is_certain
    }

    /// What is to be told of a column of this name in a file that is written so, whose decimal sign is certain or not.
    pub(super) fn sentences(&self, name: &str, file: Numbers, is_certain: bool) -> Vec<String> {
        let mut told = Vec::new();
        let decimal = self.numbers.decimals();
        if self.numbers.sign() != file.sign() {
            told.push(format!(
                "'{name}' has decimal {decimal}, unlike the other columns"
            ));
        }
        if let Some((text, line)) = &self.thousands.first {
            let plain = text.replace([',', '.'], "");
            let (why, instead) = match is_certain {
                true => (
                    format!("the table has decimal {decimal}"),
                    "one decimal sign",
                ),
                false => ("nothing in it tells decimals".to_owned(), "decimal points"),
            };
            told.push(format!(
                "{} of '{name}' like {text} in line {line} {} read as thousands, {plain}, as {why}: where that is wrong, write all \
                 numbers with {instead}",
                self.thousands.words(),
                self.thousands.are(),
            ));
        }
        if let Some((text, line)) = self.doubtful.first.as_ref().filter(|_| !is_certain) {
            told.push(format!(
                "{text} of '{name}' in line {line} is read as {}, and may be {}, which no number of the table tells: where that is \
                 meant, take the separators of thousands out",
                text.replace(',', "."),
                text.replace([',', '.'], ""),
            ));
        }
        if let Some((text, line)) = &self.uncertain.first {
            told.push(format!(
                "{} of '{name}' like {text} in line {line} {} taken without what they are uncertain by: noise_z_nm, noise_I_uA \
                 and noise_V_mV in the file say that",
                self.uncertain.words(),
                self.uncertain.are(),
            ));
        }
        if let Some((text, line)) = &self.converted.first {
            told.push(format!(
                "{} of '{name}' {} in another unit than the column, and converted: '{text}' in line {line}",
                self.converted.words(),
                self.converted.are(),
            ));
        }
        if let Some((text, line)) = self.slashed.first.as_ref().filter(|_| self.is_order_taken) {
            let order = match self.numbers.day_first {
                true => "day/month/year",
                false => "month/day/year",
            };
            told.push(format!(
                "dates of '{name}' like {text} in line {line} are read as {order}, by which they are nearest to each other"
            ));
        }
        if let Some((text, line)) = &self.of_12_hours.first {
            told.push(format!(
                "'{name}' goes on to {text} in line {line} as a clock of twelve hours"
            ));
        }
        if let Some((text, line)) = &self.unread.first {
            told.push(format!(
                "{} of '{name}' {} no number that can be read, and {} as missing: '{text}' in line {line}{}{}",
                self.unread.words(),
                if self.unread.cells == 1 { "has" } else { "have" },
                if self.unread.cells == 1 { "counts" } else { "count" },
                if self.unread.cells == 1 { "" } else { " is the first" },
                match text.starts_with('=') {
                    true => "; a formula was saved without its result: open the sheet in its program, save it, and import it again",
                    false => "",
                },
            ));
        }
        told
    }
}

impl Tally {
    fn count(&mut self, text: &str, line: usize) {
        self.cells += 1;
        self.first.get_or_insert_with(|| (text.to_owned(), line));
    }

    fn words(&self) -> String {
        match self.cells {
            1 => "1 cell".to_owned(),
            cells => format!("{cells} cells"),
        }
    }

    fn are(&self) -> &'static str {
        if self.cells == 1 { "is" } else { "are" }
    }
}
