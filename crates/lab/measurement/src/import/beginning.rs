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
}
