//! Where a table begins in its text, and what its columns are called.

use super::error::ImportError;
use super::style::{COMMENT, Style, TELLING};
use super::{header, labels, merged};

impl Style {
    /// Where the table begins, and what its columns are called; their numbers where nothing tells it.
    pub(super) fn headed(
        self,
        lines: &[&str],
        comments: &[&str],
    ) -> Result<(usize, Vec<String>), ImportError> {
        let width = self.width(lines);
        let first = self.first(lines, width);
        let width = self
            .wider(&lines[..first])
            .map_or(width, |wide| wide.max(width));
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
        let units = lines[..first].iter().map(|line| self.cells(line));
        let names = names.map(|names| labels::with_units(names, units));
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

    /// How many columns the line right above the table names, which may be more than most rows have cells where the last ones are
    /// empty. Between blanks a name and its unit are two cells.
    fn wider(self, above: &[&str]) -> Option<usize> {
        let cells = self.cells(above.last()?);
        (self.delimiter != ' ' && header::is_one(&cells)).then_some(cells.len())
    }

    /// The table's first row.
    fn first(self, lines: &[&str], width: usize) -> usize {
        let is_whole = |line: &str| self.cells(line).len() == width;
        let is_row = |line: &&str| self.filled(line) >= 2 && is_whole(line);
        let first = lines.iter().position(is_row).unwrap_or(0);
        let first = self.below_labels(lines, first, width);
        // Channels may be numbers: above a line without any they are names.
        let are_names = |below: &&&str| is_whole(below) && self.filled(below) == 0;
        if lines.get(first + 1).filter(are_names).is_some() {
            return first + 2;
        }
        // Rows whose last cells are empty may end before them; below headings nothing else is numbers alone.
        let is_short = |line: &&&str| {
            let is_within = self.cells(line).len() <= width;
            is_within && self.filled(line) > 0 && self.spoilt(line) == 0
        };
        let short = lines[..first].iter().rev().take_while(is_short).count();
        match lines[..first - short].last() {
            Some(heading) if is_whole(heading) => first - short,
            _ => first,
        }
    }

    /// The first row below lines that each begin with a word, or hold nothing, the last of which are headings, where the rows begin
    /// with numbers: what stands beside those words is no reading, `Vertical Scale,0.5,20` above `TIME,CH1,CH2`.
    fn below_labels(self, lines: &[&str], first: usize, width: usize) -> usize {
        let is_labelled = |line: &&&str| {
            let cells = self.cells(line);
            !self.is_number(&cells[0]) && (!cells[0].is_empty() || self.filled(line) == 0)
        };
        let labels = lines[first..].iter().take_while(is_labelled).count();
        let below = first + labels;
        let is_heading = |line: &&&str| self.cells(line).len() >= width && self.filled(line) == 0;
        let heading = lines[first..below].last().filter(is_heading);
        let begins = lines.get(below).map(|row| self.cells(row));
        let is_row = begins.is_some_and(|cells| self.is_number(&cells[0]));
        match heading {
            Some(_) if is_row => below,
            _ => first,
        }
    }
}
