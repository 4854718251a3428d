//! A column's cells one after the other, and what is to be told of them.

use super::cell::{Cell, Numbers, is_in_doubt};
use super::heading::Heading;
use super::qualified::Qualified;
use super::unit::Unit;

/// Times of a day go on from the day before where they fall by more than this (s).
const HALF_A_DAY_S: f64 = 43_200.0;

/// What people and programs write where they have no number.
const NOTHING: [&str; 6] = ["nan", "n/a", "na", "null", "none", "#n/a"];

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
    /// Whether a cell has a decimal sign that is nothing else.
    is_certain: bool,
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
            unit: Heading::read(name).unit.and_then(Unit::read),
            clock: Clock::default(),
            uncertain: Tally::default(),
            converted: Tally::default(),
            unread: Tally::default(),
            thousands: Tally::default(),
            doubtful: Tally::default(),
            is_certain: false,
        }
    }

    /// The next cell's number.
    pub(super) fn read(&mut self, text: &str, line: usize) -> Option<f64> {
        let Some(cell) = self.numbers.cell(text) else {
            return self.qualified(text, line);
        };
        if let Cell::Number(_) = cell {
            let is_doubtful = is_in_doubt(text);
            let has_sign = text.contains(self.numbers.sign());
            match is_doubtful {
                true if has_sign => self.doubtful.count(text, line),
                true => self.thousands.count(text, line),
                false => self.is_certain |= has_sign,
            }
        }
        Some(self.clock.number(cell))
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
        let is_said = text.contains(char::is_alphanumeric)
            && !NOTHING
                .iter()
                .any(|nothing| text.eq_ignore_ascii_case(nothing));
        if is_said {
            self.unread.count(text, line);
        }
    }

    /// A column of cells, each with its line, read with the decimal sign that the file has, or with the other one where more of it
    /// is numbers then.
    pub(super) fn with_the_other_sign<'c>(
        &self,
        name: &str,
        cells: impl Iterator<Item = Option<(&'c str, usize)>>,
    ) -> Option<(Self, Vec<Option<f64>>)> {
        let mut other = Self::new(self.numbers.with_the_other_sign(), name);
        let read = |cell: Option<(&str, usize)>| {
            let (text, line) = cell?;
            let number = other.read(text, line);
            if number.is_none() {
                other.miss(text, line);
            }
            number
        };
        let values = cells.map(read).collect();
        (other.unread.cells < self.unread.cells).then_some((other, values))
    }

    pub(super) fn has_unread(&self) -> bool {
        self.unread.cells > 0
    }

    pub(super) fn is_certain(&self) -> bool {
        self.is_certain
    }

    pub(super) fn is_of_a_clock(&self) -> bool {
        self.clock.is_one
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
            told.push(format!(
                "{} of '{name}' like {text} in line {line} {} read as thousands, {plain}, as the table has decimal {decimal}: where \
                 that is wrong, write all numbers with one decimal sign",
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
        if let Some((text, line)) = &self.unread.first {
            told.push(format!(
                "{} of '{name}' {} no number that can be read, and {} as missing: '{text}' in line {line}{}",
                self.unread.words(),
                if self.unread.cells == 1 { "has" } else { "have" },
                if self.unread.cells == 1 { "counts" } else { "count" },
                if self.unread.cells == 1 { "" } else { " is the first" },
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

/// Whether a column tells dates or clock times, and how many days ago it began.
#[derive(Clone, Default)]
struct Clock {
    is_one: bool,
    before_s: f64,
    days_s: f64,
}

impl Clock {
    /// The next cell as a number.
    fn number(&mut self, cell: Cell) -> f64 {
        self.is_one |= !matches!(cell, Cell::Number(_));
        match cell {
            Cell::Number(number) | Cell::Instant(number) => number,
            Cell::Clock(seconds) => {
                if seconds < self.before_s - HALF_A_DAY_S {
                    self.days_s += 2.0 * HALF_A_DAY_S;
                }
                self.before_s = seconds;
                self.days_s + seconds
            }
        }
    }
}
