//! A text as named columns of numbers.

use super::cell::Numbers;
use super::encoding::decoded;
use super::error::ImportError;
use super::kind::KindOfCells;
use super::own::Own;
use super::qualified::Qualified;
use super::reader::Reader;
use super::sampling::Sampling;
use super::{again, header, labels, merged};
use crate::Keys;
use std::borrow::Cow;

/// Delimiters in the order in which they are preferred where a line splits alike: a comma may be a decimal one.
const DELIMITERS: [char; 4] = ['\t', ';', ',', ' '];
/// Lines that tell how a table is written.
const TELLING: usize = 200;

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

/// How a text is written.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Style {
    delimiter: char,
    numbers: Numbers,
    /// Units, or how uncertain it is, stand behind a number.
    qualified: bool,
}

/// What a comment begins with.
const COMMENT: [char; 2] = ['#', '%'];

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
        // Beside what an oscilloscope states there may be more.
        let most = sampling.as_ref().map_or(names.len(), |_| usize::MAX);
        let wide = style.wide(numbered.clone(), most);
        let (readers, mut rows) = style.columns(numbered.clone(), &names, most);
        let is_empty = |row: &[Option<f64>]| row.iter().all(Option::is_none);
        let without = numbered.zip(&rows).filter(|(_, row)| is_empty(row));
        let without = without.filter_map(|((number, line), _)| {
            let cells = style.cells(line);
            // Words between blanks are a sentence, unless they are as many as columns.
            let may_be = style.delimiter != ' ' || cells.len() == names.len();
            may_be.then_some((number, cells))
        });
        let above: Vec<_> = lines[..first].iter().map(|l| style.cells(l)).collect();
        let again = again::headings(without, &above)?;
        let is_certain = readers.iter().any(Reader::is_certain);
        let of_all = wide.into_iter().chain(again);
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
    /// The style in which most cells of the first lines are numbers, in lines of equal width.
    fn of(lines: &[&str]) -> Option<Self> {
        let both = [(false, false), (false, true), (true, false), (true, true)];
        let styles = both.into_iter().flat_map(|(qualified, grouped)| {
            DELIMITERS.into_iter().flat_map(move |delimiter| {
                [false, true].map(|decimal_comma| Self {
                    delimiter,
                    numbers: Numbers {
                        decimal_comma,
                        grouped,
                        day_first: false,
                    },
                    qualified,
                })
            })
        });
        let told = &lines[..lines.len().min(TELLING)];
        let mut best: Option<(isize, Self)> = None;
        let sound = |style: &Self| !(style.delimiter == ',' && style.numbers.decimal_comma);
        for style in styles.filter(sound) {
            let width = style.width(told);
            let whole = told.iter().filter(|line| style.cells(line).len() == width);
            let (mut filled, mut spoilt) = (0, 0);
            for line in whole {
                filled += style.filled(line);
                spoilt += style.spoilt(line);
            }
            // What a style makes no number of speaks against it: 0,1;0,2 is three cells with commas between them.
            let better = filled as isize - spoilt as isize;
            let is_table = width >= 2 && filled >= 4;
            // Units in a header or a remark are not those of cells.
            let least = if style.qualified { told.len() / 2 } else { 0 } as isize;
            if is_table && best.is_none_or(|(most, _)| better > most + least) {
                best = Some((better, style));
            }
        }
        best.map(|(_, style)| style)
    }

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

    /// Where the table begins, and what its columns are called; their numbers where nothing tells it.
    fn headed(
        self,
        lines: &[&str],
        comments: &[&str],
    ) -> Result<(usize, Vec<String>), ImportError> {
        let width = self.width(lines);
        let is_whole = |line: &str| self.cells(line).len() == width;
        let is_row = |line: &&str| self.filled(line) >= 2 && is_whole(line);
        let first = lines.iter().position(is_row).unwrap_or(0);
        // Channels may be numbers: above a line without any they are names.
        let are_names = |below: &&&str| is_whole(below) && self.filled(below) == 0;
        let first = match lines.get(first + 1).filter(are_names) {
            Some(_) => first + 2,
            None => first,
        };
        let above: Vec<_> = lines[..first]
            .iter()
            .rev()
            .map(|l| self.whole(l, width))
            .collect();
        let commented = || {
            let Some(table) = lines.get(first).map(|line| line.as_ptr()) else {
                return Ok(None);
            };
            let above = comments.iter().rev().skip_while(|l| l.as_ptr() > table);
            let contents = above.map(|l| l.trim_start().trim_start_matches(COMMENT).trim());
            header::names(&contents.map(|l| self.whole(l, width)).collect::<Vec<_>>())
        };
        let labelled = || {
            let rows = lines[first..].iter().take(TELLING);
            let rows: Vec<_> = rows.filter_map(|l| self.whole(l, width)).collect();
            labels::names(&rows, |cell| self.is_number(cell))
        };
        let names = match header::names(&above)? {
            Some(names) => Some(names),
            None => commented()?.or_else(labelled),
        };
        let numbers = || (1..=width).map(|number| number.to_string()).collect();
        let names = names.unwrap_or_else(numbers);
        let rows: Vec<_> = lines[first..].iter().take(TELLING).collect();
        let holds_numbers = |column: usize| {
            let mut cells = rows.iter().map(|line| self.cells(line));
            cells.any(|cells| cells.get(column).is_some_and(|cell| self.is_number(cell)))
        };
        let begin = first.saturating_sub(1);
        let near: Vec<_> = lines[begin..].iter().take(first - begin + 1).collect();
        let near: Vec<_> = near.iter().map(|l| self.whole(l, width)).collect();
        let (names, numbering) =
            merged::spread(names, &near, |cell| self.is_number(cell), holds_numbers);
        Ok((first.max(numbering.map_or(0, |at| begin + at + 1)), names))
    }

    /// How many cells most lines have.
    fn width(self, lines: &[&str]) -> usize {
        let told = &lines[..lines.len().min(TELLING)];
        let mut widths: Vec<usize> = told.iter().map(|line| self.cells(line).len()).collect();
        widths.sort_unstable();
        widths.get(widths.len() / 2).copied().unwrap_or(0)
    }

    /// The cells of a line that has so many.
    fn whole(self, line: &str, width: usize) -> Option<Vec<Cow<'_, str>>> {
        Some(self.cells(line)).filter(|cells| cells.len() == width)
    }

    fn cells(self, line: &str) -> Vec<Cow<'_, str>> {
        if self.delimiter == ' ' {
            return line
                .split_whitespace()
                .map(bare)
                .map(Cow::Borrowed)
                .collect();
        }
        if !line.contains('"') {
            return line
                .split(self.delimiter)
                .map(bare)
                .map(Cow::Borrowed)
                .collect();
        }
        // Quotation marks hold a cell together, two of them are one (RFC 4180).
        let (mut cells, mut cell, mut is_quoted) = (Vec::new(), String::new(), false);
        let mut letters = line.chars().peekable();
        while let Some(letter) = letters.next() {
            match letter {
                '"' if is_quoted && letters.peek() == Some(&'"') => {
                    letters.next();
                    cell.push('"');
                }
                '"' => is_quoted = !is_quoted,
                letter if letter == self.delimiter && !is_quoted => {
                    cells.push(Cow::Owned(std::mem::take(&mut cell).trim().to_owned()));
                }
                letter => cell.push(letter),
            }
        }
        cells.push(Cow::Owned(cell.trim().to_owned()));
        cells
    }

    /// How many cells of a line hold a number.
    fn filled(self, line: &str) -> usize {
        let cells = self.cells(line);
        cells.iter().filter(|cell| self.is_number(cell)).count()
    }

    fn is_number(self, cell: &str) -> bool {
        let is_plain = |text: &str| self.numbers.cell(text).is_some();
        let qualified = || Qualified::read(cell).filter(|_| self.qualified);
        is_plain(cell) || qualified().is_some_and(|read| is_plain(read.number))
    }

    /// How many cells of a line hold something else beside numbers; of a header none.
    fn spoilt(self, line: &str) -> usize {
        let cells = self.cells(line);
        let said = cells.iter().filter(|cell| !cell.is_empty()).count();
        match self.filled(line) {
            0 => 0,
            filled => said - filled,
        }
    }

    fn words(self) -> String {
        let between = match self.delimiter {
            '\t' => "tabs",
            ';' => "semicolons",
            ',' => "commas",
            _ => "blanks",
        };
        let decimal = match self.numbers.decimal_comma {
            true => ", decimal commas",
            false => "",
        };
        let grouped = if self.numbers.grouped {
            ", thousands in groups"
        } else {
            ""
        };
        format!("{between} between cells{decimal}{grouped}")
    }
}

/// A cell without blanks and quotation marks around it.
fn bare(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}
