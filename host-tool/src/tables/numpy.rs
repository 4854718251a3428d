//! NumPy's arrays: `.npy`, and `.npz`, which is an archive of them (NEP 1, and `numpy.lib.format`).

use std::io::{Cursor, Read};

use measurement::Keys;
use measurement::import::{ImportError, Table};
use zip::ZipArchive;

/// What an array's file begins with.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";
/// The most of a member of an archive that is read (bytes), as of a table.
const MOST: u64 = 200 * input_file::MB;

/// The table in a `.npy`: a row an item of the first axis, and a column an item of the second or a field.
pub(super) fn array(bytes: &[u8]) -> Result<Table, ImportError> {
    let Array { names, columns } = Array::read(bytes)?;
    of_columns(names, columns, "NumPy's array")
}

/// Whether an archive is NumPy's.
pub(super) fn is_archive(bytes: &[u8]) -> bool {
    let archive = ZipArchive::new(Cursor::new(bytes));
    archive.is_ok_and(|archive| {
        archive
            .file_names()
            .flatten()
            .any(|name| name.ends_with(".npy"))
    })
}

/// The table in a `.npz`: its arrays side by side, those of one axis by their names.
pub(super) fn archive(bytes: &[u8]) -> Result<Table, ImportError> {
    let broken = |error: String| refused(format!("the archive is not whole: {error}"));
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(e.to_string()))?;
    let (mut names, mut columns) = (Vec::new(), Vec::new());
    for index in 0..archive.len() {
        let member = archive.by_index(index).map_err(|e| broken(e.to_string()))?;
        let name = member.name().map_err(|e| broken(e.to_string()))?;
        let name = name.trim_end_matches(".npy").to_owned();
        let mut content = Vec::new();
        let read = member.take(MOST).read_to_end(&mut content);
        read.map_err(|error| broken(error.to_string()))?;
        let array = Array::read(&content)?;
        let is_alone = array.columns.len() == 1;
        names.extend(array.names.into_iter().map(|own| match is_alone {
            true => name.clone(),
            false => format!("{name}_{own}"),
        }));
        columns.extend(array.columns);
    }
    of_columns(names, columns, "NumPy's archive")
}

fn refused(message: impl Into<String>) -> ImportError {
    ImportError::new(
        message,
        "save numbers, as an array of two axes, as fields, or as arrays of one length",
    )
}

fn of_columns(
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    written: &str,
) -> Result<Table, ImportError> {
    let rows = columns.first().map_or(0, Vec::len);
    if columns.iter().any(|column| column.len() != rows) {
        let lengths = names.iter().zip(&columns);
        let lengths = lengths.map(|(name, column)| format!("{name} has {}", column.len()));
        let lengths: Vec<String> = lengths.collect();
        return Err(refused(format!(
            "the arrays differ in length: {}",
            lengths.join(", ")
        )));
    }
    let row = |index: usize| {
        let cells = columns.iter().map(|column| column[index]);
        cells
            .map(|value| (!value.is_nan()).then_some(value))
            .collect()
    };
    Ok(Table {
        rows: (0..rows).map(row).collect(),
        names,
        kinds: Vec::new(),
        keys: Keys::default(),
        told: Vec::new(),
        written: written.to_owned(),
    })
}

/// An array as columns of numbers.
struct Array {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

/// A number as an array stores it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct NumberKind {
    /// `f`, `i`, `u` or `b`.
    letter: u8,
    size: usize,
    is_big_endian: bool,
}

impl Array {
    fn read(bytes: &[u8]) -> Result<Self, ImportError> {
        let (header, data) = split(bytes).ok_or_else(|| refused("the array is not whole"))?;
        let fields = fields(header)?;
        let shape = shape(header).ok_or_else(|| refused("the array has no shape"))?;
        let is_columns_first =
            value(header, "fortran_order").is_some_and(|v| v.starts_with("True"));
        let (rows, across) = match shape[..] {
            [rows] => (rows, 1),
            [rows, across] => (rows, across),
            _ => return Err(refused(format!("the array has {} axes", shape.len()))),
        };
        let size: usize = fields.iter().map(|(_, kind)| kind.size).sum();
        let whole = rows
            .checked_mul(across)
            .and_then(|items| items.checked_mul(size));
        if whole != Some(data.len()) || across.saturating_mul(fields.len()) > MOST_COLUMNS {
            return Err(refused("the array is not whole"));
        }
        let mut array = Self {
            names: Vec::new(),
            columns: Vec::new(),
        };
        for column in 0..across {
            let mut offset = 0;
            for (name, kind) in &fields {
                let at = |row: usize| {
                    let item = match is_columns_first {
                        true => column * rows + row,
                        false => row * across + column,
                    };
                    let begin = item * size + offset;
                    kind.number(&data[begin..begin + kind.size])
                };
                array.names.push(match name {
                    Some(name) if across == 1 => name.clone(),
                    _ => (array.columns.len() + 1).to_string(),
                });
                array.columns.push((0..rows).map(at).collect());
                offset += kind.size;
            }
        }
        Ok(array)
    }
}

/// More columns than this are no measurement of a mirror.
const MOST_COLUMNS: usize = 1000;

impl NumberKind {
    /// Of a type string such as `<f8`.
    fn read(text: &str) -> Option<Self> {
        let bytes = text.as_bytes();
        let (&order, rest) = bytes.split_first()?;
        let (&letter, size) = rest.split_first()?;
        let size: usize = std::str::from_utf8(size).ok()?.parse().ok()?;
        let is_known = matches!(
            (letter, size),
            (b'f', 4 | 8) | (b'i' | b'u', 1 | 2 | 4 | 8) | (b'b', 1)
        );
        (is_known && matches!(order, b'<' | b'>' | b'|' | b'=')).then_some(Self {
            letter,
            size,
            is_big_endian: order == b'>',
        })
    }

    fn number(self, bytes: &[u8]) -> f64 {
        let mut least_first = [0; 8];
        for (index, byte) in bytes.iter().enumerate() {
            let place = if self.is_big_endian {
                self.size - 1 - index
            } else {
                index
            };
            least_first[place] = *byte;
        }
        let whole = u64::from_le_bytes(least_first);
        match (self.letter, self.size) {
            (b'f', 4) => f64::from(f32::from_bits(whole as u32)),
            (b'f', _) => f64::from_bits(whole),
            // The sign is in the highest bit of the number's own size.
            (b'i', size) => ((whole << (64 - 8 * size)) as i64 >> (64 - 8 * size)) as f64,
            _ => whole as f64,
        }
    }
}

/// Header and data.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (&[major, _], rest) = rest.split_first_chunk::<2>()?;
    let (length, rest) = if major == 1 {
        let (length, rest) = rest.split_first_chunk::<2>()?;
        (usize::from(u16::from_le_bytes(*length)), rest)
    } else {
        let (length, rest) = rest.split_first_chunk::<4>()?;
        (usize::try_from(u32::from_le_bytes(*length)).ok()?, rest)
    };
    let (header, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, data))
}

/// What stands behind a key of the header, a dictionary of Python's.
fn value<'h>(header: &'h str, key: &str) -> Option<&'h str> {
    let (_, after) = header.split_once(&format!("'{key}':"))?;
    Some(after.trim_start())
}

fn shape(header: &str) -> Option<Vec<usize>> {
    let (inside, _) = value(header, "shape")?.strip_prefix('(')?.split_once(')')?;
    let axes = inside
        .split(',')
        .map(str::trim)
        .filter(|axis| !axis.is_empty());
    axes.map(|axis| axis.parse().ok()).collect()
}

/// Names and kinds of an item's numbers.
fn fields(header: &str) -> Result<Vec<(Option<String>, NumberKind)>, ImportError> {
    let of = value(header, "descr").unwrap_or_default();
    let unknown = |kind: &str| {
        refused(format!(
            "the array holds '{kind}', which are no numbers that are read"
        ))
    };
    let quoted = |text: &str| -> Vec<String> {
        let parts = text.split('\'').skip(1).step_by(2);
        parts.map(str::to_owned).collect()
    };
    if let Some(list) = of.strip_prefix('[') {
        let (list, _) = list.split_once(']').ok_or_else(|| unknown("nothing"))?;
        let words = quoted(list);
        let pairs = words
            .chunks_exact(2)
            .map(|pair| match NumberKind::read(&pair[1]) {
                Some(kind) => Ok((Some(pair[0].clone()), kind)),
                None => Err(unknown(&pair[1])),
            });
        return pairs.collect();
    }
    let words = quoted(of);
    let kind = words.first().map_or("", String::as_str);
    match NumberKind::read(kind) {
        Some(kind) => Ok(vec![(None, kind)]),
        None => Err(unknown(kind)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Write;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    /// An array as NumPy writes it, version 1.0.
    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let length = (header.len() as u16).to_le_bytes();
        [MAGIC, &[1, 0], &length, header.as_bytes(), data].concat()
    }

    fn bytes(numbers: &[f64]) -> Vec<u8> {
        numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
    }

    #[test]
    fn arrays_are_read_in_both_orders() {
        let rows = [0.0, 0.0, 1.0, 26.0, 2.0, 90.0];
        let columns = [0.0, 1.0, 2.0, 0.0, 26.0, 90.0];
        for (order, numbers) in [("False", rows), ("True", columns)] {
            let header =
                format!("{{'descr': '<f8', 'fortran_order': {order}, 'shape': (3, 2), }}\n");
            let table = array(&npy(&header, &bytes(&numbers))).expect("a table");
            assert_eq!(table.names, ["1", "2"]);
            assert_eq!(table.rows[2], [Some(2.0), Some(90.0)], "{order}");
        }
    }

    #[test]
    fn fields_keep_their_names_and_numbers_their_signs() {
        let header =
            "{'descr': [('V', '>f4'), ('z_nm', '<i2')], 'fortran_order': False, 'shape': (2,), }";
        let data: Vec<u8> = [(0.0_f32, 0_i16), (1.5, -300)]
            .iter()
            .flat_map(|(volts, z)| {
                [volts.to_be_bytes().to_vec(), z.to_le_bytes().to_vec()].concat()
            })
            .collect();
        let table = array(&npy(header, &data)).expect("a table");
        assert_eq!(table.names, ["V", "z_nm"]);
        assert_eq!(table.rows[1], [Some(1.5), Some(-300.0)]);
    }

    #[test]
    fn an_archive_s_arrays_stand_side_by_side() {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }";
        for (name, numbers) in [("V", [0.0, 1.0, 2.0]), ("z_um", [0.0, 26.0, f64::NAN])] {
            let file = format!("{name}.npy");
            archive
                .start_file(file, SimpleFileOptions::default())
                .expect("a member");
            archive
                .write_all(&npy(header, &bytes(&numbers)))
                .expect("written");
        }
        let content = archive.finish().expect("whole").into_inner();
        assert!(is_archive(&content));
        let table = super::archive(&content).expect("a table");
        assert_eq!(table.names, ["V", "z_um"]);
        assert_eq!(
            table.rows[1..],
            [[Some(1.0), Some(26.0)], [Some(2.0), None]]
        );
    }

    #[test]
    fn what_is_no_table_is_told() {
        for (header, said) in [
            (
                "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }",
                "'|O'",
            ),
            (
                "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, 4), }",
                "3 axes",
            ),
            (
                "{'descr': '<f8', 'fortran_order': False, 'shape': (9, 9), }",
                "not whole",
            ),
        ] {
            let error = array(&npy(header, &[0; 8]))
                .expect_err("refused")
                .to_string();
            assert!(error.contains(said), "{error}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(header in "[ -~]{0,120}", data in prop::collection::vec(any::<u8>(), 0..64)) {
            let _ = array(&npy(&header, &data));
            let _ = array(&data);
            let _ = archive(&data);
        }

        #[test]
        fn what_is_written_is_read(numbers in prop::collection::vec(-1e9..1e9_f64, 2..60)) {
            let rows = numbers.len() / 2;
            let numbers = &numbers[..2 * rows];
            let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({rows}, 2), }}");
            let table = array(&npy(&header, &bytes(numbers))).expect("a table");
            let read: Vec<f64> = table.rows.iter().flatten().map(|cell| cell.expect("a number")).collect();
            prop_assert_eq!(&read[..], numbers);
        }
    }
}
