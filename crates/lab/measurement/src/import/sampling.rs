//! Times that an oscilloscope states as a start and an increment above its samples.

use super::cell::{Cell, Numbers};
use super::heading::headings;
use std::borrow::Cow;

/// When samples were taken, as Rigol's oscilloscopes write it: `X,CH1,Start,Increment` above `Sequence,Volt,-1.2e-3,2e-6`, or
/// `CH1V,t0 =-0.0012, tInc = 2e-06`.
#[derive(Debug, PartialEq)]
pub(super) struct Sampling {
    start_s: f64,
    increment_s: f64,
    /// The column of the samples' numbers, which becomes their times; where there is none, the rows are counted.
    sequence: Option<usize>,
    /// What the columns are called, those of the start and the increment left out.
    names: Vec<String>,
    /// Where the samples begin.
    pub(super) first: usize,
}

impl Sampling {
    /// The one that these lines state.
    pub(super) fn find(lines: &[Vec<Cow<'_, str>>], numbers: Numbers) -> Option<Self> {
        (0..lines.len()).find_map(|at| {
            Self::beneath(&lines[at..], numbers)
                .or_else(|| Self::within(&lines[at], numbers))
                .map(|sampling| Self {
                    first: at + sampling.first,
                    ..sampling
                })
        })
    }

    /// Start and increment beneath their names, and nothing beneath them.
    fn beneath(lines: &[Vec<Cow<'_, str>>], numbers: Numbers) -> Option<Self> {
        let [names, values, sample, ..] = lines else {
            return None;
        };
        let place = |name: &str| {
            names
                .iter()
                .position(|cell| cell.eq_ignore_ascii_case(name))
        };
        let (start, increment) = (place("start")?, place("increment")?);
        let is_empty = |at: usize| sample.get(at).is_none_or(|cell| cell.is_empty());
        let columns = start.min(increment);
        let units = values.get(..columns)?;
        (is_empty(start) && is_empty(increment)).then_some(())?;
        Some(Self::new(
            number(values.get(start)?, numbers)?,
            number(values.get(increment)?, numbers)?,
            &names[..columns],
            Some(units),
        ))
    }

    /// Start and increment in the line of the names.
    fn within(names: &[Cow<'_, str>], numbers: Numbers) -> Option<Self> {
        let stated = |name: &str| {
            names.iter().enumerate().find_map(|(at, cell)| {
                let (key, value) = cell.split_once('=')?;
                let is_it = key.trim().eq_ignore_ascii_case(name);
                let value = value.trim().trim_end_matches(['s', 'S']).trim_end();
                is_it.then(|| Some((at, number(value, numbers)?)))?
            })
        };
        let ((start, start_s), (increment, increment_s)) = (stated("t0")?, stated("tInc")?);
        let columns = start.min(increment);
        Some(Self::new(start_s, increment_s, &names[..columns], None))
    }

    fn new(
        start_s: f64,
        increment_s: f64,
        names: &[Cow<'_, str>],
        units: Option<&[Cow<'_, str>]>,
    ) -> Self {
        let mut names = names.to_vec();
        let mut units = units.map(<[_]>::to_vec);
        let is_numbers = |at: &usize| {
            let unit = units.as_ref().map(|units| &units[*at]);
            names[*at].eq_ignore_ascii_case("x")
                && unit.is_none_or(|unit| unit.eq_ignore_ascii_case("sequence"))
        };
        let sequence = (0..names.len()).find(is_numbers);
        if let Some(at) = sequence {
            names[at] = if units.is_some() { "Time" } else { "Time (s)" }.into();
            if let Some(units) = &mut units {
                units[at] = "s".into();
            }
        }
        let names = match &units {
            Some(units) => headings(units, Some(&names)),
            None => headings(&names, None),
        };
        Self {
            start_s,
            increment_s,
            sequence,
            names,
            first: if units.is_some() { 2 } else { 1 },
        }
    }

    /// What the columns are called with the times among them.
    pub(super) fn names(&self) -> Vec<String> {
        let counted = self.sequence.is_none().then(|| "Time (s)".to_owned());
        self.names.iter().cloned().chain(counted).collect()
    }

    /// Writes the times into rows, in which these are the first columns.
    pub(super) fn time(&self, rows: &mut [Vec<Option<f64>>]) {
        let columns = self.names.len();
        for (index, row) in rows.iter_mut().enumerate() {
            row.resize(columns, None);
            match self.sequence {
                Some(at) => row[at] = row[at].map(|sample| self.at(sample)),
                None => row.push(Some(self.at(index as f64))),
            }
        }
    }

    fn at(&self, sample: f64) -> f64 {
        self.start_s + self.increment_s * sample
    }

    pub(super) fn words(&self) -> String {
        format!(
            "samples from {:?} s on every {:?} s, as its header says",
            self.start_s, self.increment_s
        )
    }
}

fn number(cell: &str, numbers: Numbers) -> Option<f64> {
    match numbers.cell(cell)? {
        Cell::Number(number) => Some(number),
        _ => None,
    }
}
