//! How a text is written: what stands between its cells, and how its numbers are.

use super::cell::Numbers;
use super::qualified::Qualified;
use std::borrow::Cow;

/// Delimiters in the order in which they are preferred where a line splits alike: a comma may be a decimal one.
const DELIMITERS: [char; 4] = ['\t', ';', ',', ' '];
/// Lines that tell how a table is written.
pub(super) const TELLING: usize = 200;

/// What a comment begins with.
pub(super) const COMMENT: [char; 2] = ['#', '%'];

/// How a text is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Style {
    pub(super) delimiter: char,
    pub(super) numbers: Numbers,
    /// Units, or how uncertain it is, stand behind a number.
    qualified: bool,
}

impl Style {
    /// The style in which most cells of the first lines are numbers, in lines of equal width.
    pub(super) fn of(lines: &[&str]) -> Option<Self> {
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
        let is_quoted = told.iter().any(|line| line.contains('"'));
        let has_both = |style: &Self| style.delimiter == ',' && style.numbers.decimal_comma;
        let mut styles: Vec<Self> = styles.filter(|s| is_quoted || !has_both(s)).collect();
        // Commas between quotation marks are decimal ones where they do not separate thousands.
        styles.sort_by_key(|style| (style.qualified, has_both(style)));
        let mut best: Option<(isize, Self)> = None;
        for style in styles {
            let width = style.width(told);
            // Some lines end with delimiters more than others.
            let is_whole = |line: &&&str| {
                let cells = style.cells(line);
                let beyond = cells.get(width..);
                beyond.is_some_and(|cells| cells.iter().all(|cell| cell.is_empty()))
            };
            let whole = told.iter().filter(is_whole);
            let (mut filled, mut spoilt) = (0, 0);
            for line in whole {
                filled += style.filled(line);
                spoilt += style.spoilt(line);
            }
            // What a style makes no number of speaks against it: 0,1;0,2 is three cells with commas between them.
            let better = filled as isize - spoilt as isize;
            let is_table = width >= 2 && filled >= 4;
            // Units in a header or a remark are not those of cells, and blanks beside tabs are not between them.
            let is_unlikely = style.qualified || style.delimiter == ' ';
            let least = if is_unlikely { told.len() / 2 } else { 0 } as isize;
            if is_table && best.is_none_or(|(most, _)| better > most + least) {
                best = Some((better, style));
            }
        }
        best.map(|(_, style)| style)
    }

    /// How many cells most lines have.
    pub(super) fn width(self, lines: &[&str]) -> usize {
        let told = &lines[..lines.len().min(TELLING)];
        let mut widths: Vec<usize> = told.iter().map(|line| self.cells(line).len()).collect();
        widths.sort_unstable();
        widths.get(widths.len() / 2).copied().unwrap_or(0)
    }

    /// The cells of a line that has so many.
    pub(super) fn whole(self, line: &str, width: usize) -> Option<Vec<Cow<'_, str>>> {
        Some(self.cells(line)).filter(|cells| cells.len() == width)
    }

    /// The cells of a line.
    pub(super) fn cells(self, line: &str) -> Vec<Cow<'_, str>> {
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
    pub(super) fn filled(self, line: &str) -> usize {
        let cells = self.cells(line);
        cells.iter().filter(|cell| self.is_number(cell)).count()
    }

    /// Whether a cell holds a number.
    pub(super) fn is_number(self, cell: &str) -> bool {
        let is_plain = |text: &str| self.numbers.cell(text).is_some();
        let qualified = || Qualified::read(cell).filter(|_| self.qualified);
        is_plain(cell) || qualified().is_some_and(|read| is_plain(read.number))
    }

    /// How many cells of a line hold something else beside numbers; of a header none.
    pub(super) fn spoilt(self, line: &str) -> usize {
        let cells = self.cells(line);
        let said = cells.iter().filter(|cell| !cell.is_empty()).count();
        match self.filled(line) {
            0 => 0,
            filled => said - filled,
        }
    }

    /// That, in words.
    pub(super) fn words(self) -> String {
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
