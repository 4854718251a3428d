//! A text as named columns of numbers.

use super::again;
use super::encoding::decoded;
use super::error::ImportError;
use super::kind::KindOfCells;
use super::own::Own;
use super::reader::Reader;
use super::sampling::Sampling;
use super::style::{COMMENT, Style, TELLING};
use super::summary;

use crate::Keys;
use std::borrow::Cow;

/// Named columns of numbers, as a text has them.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The columns' names, with their units in brackets where those stand in a line of their own; their numbers where the text has
    /// no header.
    pub names: Vec<String>,
    /// The rows; `None` where a cell holds no number. An infinity is one.
    pub rows: Vec<Vec<Option<f64>>>,
    /// Where cells hold something else than plain numbers: parts of a hundred, or times, in seconds since some day.
    pub kinds: Vec<KindOfCells>,
    /// What a file in the format of measurement files states in `# key=value` lines.
    pub keys: Keys,
    /// What is to be told of columns, by their places, or of all: how cells were read that may mean two things, and which were not.
    pub told: Vec<(Option<usize>, String)>,
    /// How the text is written, in words.
    pub written: String,
}

impl Table {
    /// Reads a text of unknown style: UTF-8, UTF-16 with its mark, or Latin-1; tabs, semicolons, commas or blanks between cells;
    /// points or commas in numbers, and thousands in groups; dates and clock times. What stands between quotation marks is one cell. Lines
    /// that begin with `#` or `%` are comments, of which the last one before the table that can may have its names, as
    /// `numpy.savetxt` writes it, and which are keys in a file in the format of measurement files; other lines before the table are passed over. Oscilloscopes' labels beside their samples, and times that
    /// they state as a start and an increment, are read.
    ///
    /// # Errors
    /// Where no two lines have as many cells, two or more, with numbers in them; where a unit beneath a heading contradicts it, or
    /// headings of another table stand below.
    pub fn read(bytes: &[u8]) -> Result<Self, ImportError> {
        Self::find(bytes)?.ok_or_else(|| {
            ImportError::new(
                "this is no table of numbers",
                "a table has a row a line, with commas, semicolons, tabs or blanks between its cells; of a spreadsheet, save the sheet as CSV",
            )
        })
    }

    /// The same; `None` where there is no table.
    ///
    /// # Errors
    /// Where a table cannot be read as one.
    pub fn find(bytes: &[u8]) -> Result<Option<Self>, ImportError> {
        let (text, encoding) = decoded(bytes);
        let (own, text) = Own::read(&text);
        let (comments, table): (Vec<_>, Vec<_>) = (1..)
            .zip(text.lines())
            .filter(|(_, line)| !line.trim().is_empty())
            .partition(|(_, line)| line.trim_start().starts_with(COMMENT));
        let (numbers, lines): (Vec<usize>, Vec<&str>) = table.into_iter().unzip();
        let comments: Vec<&str> = comments.into_iter().map(|(_, line)| line).collect();
        let Some(style) = Style::of(&lines) else {
            return Ok(None);
        };
        let told: Vec<_> = lines.iter().take(TELLING).map(|l| style.cells(l)).collect();
        let sampling = Sampling::find(&told, style.numbers);
        let (first, names) = match &sampling {
            Some(sampling) => (sampling.first, sampling.names()),
            None => style.headed(&lines, &comments)?,
        };
        let numbered = numbers[first..].iter().copied().zip(&lines[first..]);
        let (sums, of_sums) = summary::rows(style, numbered.clone());
        let numbered = numbered.filter(|(number, _)| sums.binary_search(number).is_err());
        // Beside what an oscilloscope states there may be more.
        let most = sampling.as_ref().map_or(names.len(), |_| usize::MAX);
        let wide = style.wide(numbered.clone(), most);
        let (readers, mut rows) = style.columns(numbered.clone(), &names, most);
        let is_empty = |row: &[Option<f64>]| row.iter().all(Option::is_none);
        let without = numbered.clone().zip(&rows).filter(|(_, row)| is_empty(row));
        let without = without.filter_map(|((number, line), _)| {
            let cells = style.cells(line);
            // Words between blanks are a sentence, unless they are as many as columns.
            let may_be = style.delimiter != ' ' || cells.len() == names.len();
            may_be.then_some((number, cells))
        });
        let above: Vec<_> = lines[..first].iter().map(|l| style.cells(l)).collect();
        let again = again::headings(without, &above)?;
        let is_certain = readers.iter().any(Reader::is_certain);
        if wide.is_some() {
            // They were told, and hold nothing that was read.
            let mut lines = numbered.map(|(_, line)| line);
            rows.retain(|_| {
                let line = lines.next();
                line.is_none_or(|line| !style.is_wide(&style.cells(line), most))
            });
        }
        let of_all = wide.into_iter().chain(of_sums).chain(again);
        let mut told: Vec<_> = of_all.map(|sentence| (None, sentence)).collect();
        for (column, (reader, name)) in readers.iter().zip(&names).enumerate() {
            let sentences = reader.sentences(name, style.numbers, is_certain);
            told.extend(sentences.into_iter().map(|said| (Some(column), said)));
        }
        let both = readers.iter().zip(&names);
        let names: Vec<_> = both.map(|(reader, name)| reader.named(name)).collect();
        if let Some(sampling) = &sampling {
            sampling.time(&mut rows);
        }
        let (keys, of_keys) = own.of_table(&names, rows.len());
        told.extend(of_keys.into_iter().map(|sentence| (None, sentence)));
        let times = sampling.map(|sampling| format!(", {}", sampling.words()));
        let numbered = (0..).zip(&readers);
        let kinds = numbered.flat_map(|(column, reader)| reader.kinds(column));
        Ok(Some(Self {
            names,
            rows,
            kinds: kinds.collect(),
            keys,
            told,
            written: format!("{encoding}, {}{}", style.words(), times.unwrap_or_default()),
        }))
    }
}

impl Style {
    /// Whether a number stands behind the last column of so many, so that cells may be those of others.
    fn is_wide(self, cells: &[Cow<'_, str>], most: usize) -> bool {
        let beyond = cells.get(most..).unwrap_or_default();
        beyond.iter().any(|cell| self.is_number(cell))
    }

    /// That there are such lines.
    fn wide<'l>(
        self,
        lines: impl Iterator<Item = (usize, &'l &'l str)>,
        most: usize,
    ) -> Option<String> {
        let mut wide = lines.filter(|(_, line)| self.is_wide(&self.cells(line), most));
        let (first, line) = wide.next()?;
        let cells = self.cells(line).len();
        let (rows, are) = match wide.count() {
            0 => ("1 row".to_owned(), "is"),
            others => (format!("{} rows", others + 1), "are"),
        };
        Some(format!(
            "{rows} with more numbers than columns {are} left out, as line {first} with {cells} cells for {most}: which of them \
             belong together cannot be told"
        ))
    }

    /// The columns of numbered lines, and how they were read; nothing of lines with more than so many cells.
    fn columns<'l>(
        self,
        lines: impl Iterator<Item = (usize, &'l &'l str)> + Clone,
        names: &[String],
        most: usize,
    ) -> (Vec<Reader>, Vec<Vec<Option<f64>>>) {
        let width = names.len();
        let new = |name: &String| Reader::new(self.numbers, name);
        let mut readers: Vec<Reader> = names.iter().map(new).collect();
        let row = |(number, line): (usize, &&str)| {
            let cells = self.cells(line);
            if self.is_wide(&cells, most) {
                return vec![None; width];
            }
            let both = readers.iter_mut().zip(&cells);
            let mut row: Vec<_> = both
                .map(|(reader, cell)| reader.read(cell, number))
                .collect();
            // A line without any number is a remark.
            if row.iter().any(Option::is_some) {
                let both = readers.iter_mut().zip(&cells).zip(&row);
                let unread = both.filter(|(_, value)| value.is_none());
                unread.for_each(|((reader, cell), _)| reader.miss(cell, number));
            }
            row.resize(width, None);
            row
        };
        let mut rows: Vec<Vec<Option<f64>>> = lines.clone().map(row).collect();
        for (column, reader) in readers.iter_mut().enumerate() {
            if !reader.is_in_question() {
                continue;
            }
            let cells: Vec<_> = lines
                .clone()
                .zip(&rows)
                .map(|((number, line), row)| {
                    let cell = self.cells(line).into_iter().nth(column);
                    let cell = cell.filter(|_| row.iter().any(Option::is_some));
                    cell.map(|cell| (cell, number))
                })
                .collect();
            let cells = cells
                .iter()
                .map(|cell| cell.as_ref().map(|(text, number)| (&**text, *number)));
            let values = rows.iter().map(|row| row[column]).collect();
            if let Some((other, values)) = reader.otherwise(&names[column], values, cells) {
                *reader = other;
                let cells = rows.iter_mut().map(|row| &mut row[column]);
                cells.zip(values).for_each(|(cell, value)| *cell = value);
            }
        }
        (readers, rows)
    }
}
