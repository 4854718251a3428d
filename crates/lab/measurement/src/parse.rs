//! From text to rows. Every error points at its cell.

use crate::column::{COLUMNS, Column, suggestion};
use crate::error::Complaint;
use crate::keys::{NUMERIC, is_key};
use crate::plausibility::Device;
use crate::{ACTUATORS, InputError, Keys, MeasurementFile, Row, plausibility};
use miette::NamedSource;
use std::ops::Range;
use std::sync::Arc;

impl MeasurementFile {
    /// Reads a file's text; `name` is what errors call it.
    ///
    /// # Errors
    /// [`InputError::Content`] for anything but at least two rows of finite numbers in known columns at increasing
    /// times, and for values that are evidently in a wrong unit (see [`plausibility`]).
    pub fn parse(name: &str, text: &str) -> Result<Self, InputError> {
        Self::parse_of(name, text, &Device::default())
    }

    /// The same of a device that something is known of.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), and for what this device cannot have shown.
    pub fn parse_of(name: &str, text: &str, device: &Device) -> Result<Self, InputError> {
        Parser { name, text }.file(device)
    }
}

struct Parser<'a> {
    name: &'a str,
    text: &'a str,
}

/// A row with the place of each of its cells, in the order of the header.
struct Record {
    row: Row,
    cells: Vec<Range<usize>>,
}

impl Parser<'_> {
    fn file(&self, device: &Device) -> Result<MeasurementFile, InputError> {
        let (keys, notes) = self.comments()?;
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(self.text.as_bytes());
        let header = reader
            .headers()
            .map_err(|error| self.csv_error(&error))?
            .clone();
        let columns = self.columns(&header)?;
        let mut records = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| self.csv_error(&error))?;
            records.push(self.row(&columns, &record)?);
        }
        self.check_times(&columns, &records)?;
        let file = MeasurementFile {
            keys,
            notes,
            rows: records.iter().map(|record| record.row).collect(),
        };
        if let Some((index, column, complaint)) = plausibility::check(&file, device) {
            let cell = columns
                .iter()
                .position(|&c| c == column || c == column.of_all())
                .unwrap_or(0);
            return Err(self.error(records[index].cells[cell].clone(), complaint));
        }
        Ok(file)
    }

    fn comments(&self) -> Result<(Keys, Vec<String>), InputError> {
        let (mut keys, mut notes) = (Keys::default(), Vec::new());
        let mut start = 0;
        for line in self.text.split_inclusive('\n') {
            let place = start..start + line.trim_end().len();
            start += line.len();
            let Some(comment) = line.strip_prefix('#').map(str::trim) else {
                continue;
            };
            match comment.split_once('=') {
                Some((key, value)) if is_key(key.trim()) => {
                    self.key(&mut keys, key.trim(), value.trim())
                        .map_err(|complaint| self.error(place, complaint))?;
                }
                _ => notes.push(comment.to_owned()),
            }
        }
        Ok((keys, notes))
    }

    fn key(&self, keys: &mut Keys, key: &str, value: &str) -> Result<(), Complaint> {
        if keys.get(key).is_some() {
            return Err(Complaint::new(
                format!("the key '{key}' is given twice"),
                "remove one of the two",
            ));
        }
        let is_number = || {
            value
                .parse::<f64>()
                .is_ok_and(|number| number.is_finite() && number >= 0.0)
        };
        if NUMERIC.contains(&key) && !is_number() {
            return Err(Complaint::new(
                format!("{key} must be a number that is not negative, not '{value}'"),
                "write it like 20 or 1.5",
            ));
        }
        keys.set(key, value);
        Ok(())
    }

    fn columns(&self, header: &csv::StringRecord) -> Result<Vec<Column>, InputError> {
        if header.is_empty() {
            let complaint = Complaint::new(
                "the file is empty",
                "a measurement file has a header line such as t_s,V_V,z_um, and rows",
            );
            return Err(self.error(0..0, complaint));
        }
        let cells = self.cells(header);
        let mut columns = Vec::new();
        for (name, cell) in header.iter().zip(&cells) {
            let complaint = match Column::from_name(name) {
                None => Complaint::new(format!("there is no column '{name}'"), suggestion(name)),
                Some(column) if columns.contains(&column) => Complaint::new(
                    format!("the column '{name}' is there twice"),
                    "remove one of the two",
                ),
                Some(column) => {
                    columns.push(column);
                    continue;
                }
            };
            return Err(self.error(cell.clone(), complaint));
        }
        match missing(&columns) {
            None => Ok(columns),
            Some(complaint) => {
                Err(self.error(cells[0].start..cells[cells.len() - 1].end, complaint))
            }
        }
    }

    fn row(&self, columns: &[Column], record: &csv::StringRecord) -> Result<Record, InputError> {
        let cells = self.cells(record);
        let mut row = Row::default();
        for ((&column, text), cell) in columns.iter().zip(record).zip(&cells) {
            if text.is_empty() && column.may_be_empty() {
                continue;
            }
            let value =
                number(column, text).map_err(|complaint| self.error(cell.clone(), complaint))?;
            column.store(&mut row, value);
        }
        Ok(Record { row, cells })
    }

    fn check_times(&self, columns: &[Column], records: &[Record]) -> Result<(), InputError> {
        if records.len() < 2 {
            let rows = if records.is_empty() {
                "no rows"
            } else {
                "only one row"
            };
            let complaint = Complaint::new(
                format!("the file has {rows}"),
                "a measurement needs two rows at least",
            );
            return Err(self.error(
                self.text.trim_end().len()..self.text.trim_end().len(),
                complaint,
            ));
        }
        for column in [Column::Time, Column::GlobalTime] {
            let Some(cell) = columns.iter().position(|&c| c == column) else {
                continue;
            };
            let times: Vec<_> = records
                .iter()
                .filter_map(|r| Some((column.value(&r.row)?, &r.cells[cell])))
                .collect();
            for pair in times.windows(2) {
                let ((before, _), (now, place)) = (pair[0], pair[1]);
                if now <= before {
                    let what = if now == before {
                        "is there twice"
                    } else {
                        "goes back"
                    };
                    let complaint = Complaint::new(
                        format!("the time {what}: {now} s comes after {before} s"),
                        "rows must be in the order of time, each at its own time",
                    );
                    return Err(self.error(place.clone(), complaint));
                }
            }
        }
        Ok(())
    }

    /// Where each field stands in the text. The record knows where it begins and its fields' lengths without the commas
    /// and blanks between them, so the fields are looked for one after the other.
    fn cells(&self, record: &csv::StringRecord) -> Vec<Range<usize>> {
        let mut from = record
            .position()
            .map_or(0, |position| position.byte() as usize)
            .min(self.text.len());
        record
            .iter()
            .map(|field| {
                let start = from
                    + self
                        .text
                        .get(from..)
                        .and_then(|rest| rest.find(field))
                        .unwrap_or(0);
                from = (start + field.len()).min(self.text.len());
                let rest = self.text.get(from..).unwrap_or("");
                let end = from;
                from += rest.find(',').map_or(rest.len(), |comma| comma + 1);
                start..end
            })
            .collect()
    }

    fn csv_error(&self, error: &csv::Error) -> InputError {
        let at = error
            .position()
            .map_or(0, |position| position.byte() as usize)
            .min(self.text.len());
        let line = self
            .text
            .get(at..)
            .unwrap_or("")
            .lines()
            .next()
            .unwrap_or("");
        let complaint = match error.kind() {
            csv::ErrorKind::UnequalLengths {
                expected_len, len, ..
            } => Complaint::new(
                format!("this row has {len} cells, the header has {expected_len}"),
                "every row needs one cell a column; what was not measured is left empty",
            ),
            _ => Complaint::new(
                format!("this is not CSV: {error}"),
                "the file must be plain text with commas between the cells",
            ),
        };
        self.error(at..at + line.len(), complaint)
    }

    fn error(&self, place: Range<usize>, complaint: Complaint) -> InputError {
        let before = self.text.get(..place.start).unwrap_or(self.text);
        InputError::Content {
            file: self.name.into(),
            line: before.matches('\n').count() + 1,
            message: complaint.message,
            help: complaint.help,
            text: Arc::new(NamedSource::new(self.name, self.text.to_owned())),
            place: place.into(),
        }
    }
}

impl Column {
    /// The column that may stand for this one in all four actuators.
    fn of_all(self) -> Self {
        match self {
            Self::Voltage(_) => Self::VoltageOfAll,
            Self::Current(_) => Self::CurrentOfEach,
            other => other,
        }
    }
}

fn missing(columns: &[Column]) -> Option<Complaint> {
    let has = |column| columns.contains(&column);
    if !has(Column::Time) {
        return Some(Complaint::new(
            "the column t_s is missing",
            "add the time of each row, in seconds",
        ));
    }
    let each = (0..ACTUATORS)
        .filter(|&actuator| has(Column::Voltage(actuator)))
        .count();
    if each == 0 && !has(Column::VoltageOfAll) {
        return Some(Complaint::new(
            "the drive is missing",
            "add V_V, or V1_V to V4_V, in volts",
        ));
    }
    if each != 0 && has(Column::VoltageOfAll) {
        return Some(Complaint::new(
            "V_V stands beside the single actuators' voltages",
            "give either V_V or V1_V to V4_V",
        ));
    }
    if each != 0 && each != ACTUATORS {
        let absent = (0..ACTUATORS)
            .find(|&actuator| !has(Column::Voltage(actuator)))
            .unwrap_or(0)
            + 1;
        return Some(Complaint::new(
            format!("the column V{absent}_V is missing"),
            "give all of V1_V to V4_V, or V_V alone",
        ));
    }
    if has(Column::CurrentOfEach) && (0..ACTUATORS).any(|actuator| has(Column::Current(actuator))) {
        return Some(Complaint::new(
            "I_A stands beside the single actuators' currents",
            "give either I_A or I1_A to I4_A",
        ));
    }
    None
}

fn number(column: Column, text: &str) -> Result<f64, Complaint> {
    let name = COLUMNS
        .iter()
        .find(|(_, known)| *known == column)
        .map_or("", |(name, _)| name);
    if text.is_empty() {
        return Err(Complaint::new(
            format!("{name} is empty"),
            "time and drive are needed in every row",
        ));
    }
    let value: f64 = text.parse().map_err(|_| {
        Complaint::new(
            format!("'{text}' is not a number"),
            format!("{name} takes plain numbers, its unit stands in its name"),
        )
    })?;
    if !value.is_finite() {
        return Err(Complaint::new(
            format!("{name} is '{text}'"),
            "leave a cell empty where nothing was measured",
        ));
    }
    Ok(value)
}
