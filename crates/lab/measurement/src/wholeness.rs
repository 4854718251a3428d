//! Whether a file has its end: one that was written as the rows came says at its beginning that its last line will tell.

/// The key that such a file begins with, and its value: the key that it ends with.
pub(crate) const ENDS_WITH: &str = "ends_with";
/// The key of the last line, and its value: how many rows there are.
pub(crate) const ROWS: &str = "rows";

/// What a file says of its end.
#[derive(Default)]
pub(crate) struct Wholeness {
    promised: bool,
    /// What the last line says.
    rows: Option<usize>,
    /// A line that breaks off.
    cut_off: bool,
}

impl Wholeness {
    /// Whether this comment is about the file's end, and no key of the measurement.
    pub(crate) fn takes(&mut self, key: &str, value: &str) -> bool {
        if key == ENDS_WITH && value == ROWS {
            self.promised = true;
            return true;
        }
        let rows = value.parse().ok().filter(|_| self.promised && key == ROWS);
        self.rows = self.rows.or(rows);
        rows.is_some()
    }

    /// Whether the file says that its last line will tell.
    pub(crate) fn is_promised(&self) -> bool {
        self.promised
    }

    /// Whether the next line, with or without a line end, is one that the writer was interrupted in. Files by hand may end without one.
    pub(crate) fn is_cut_off(&mut self, is_ended: bool) -> bool {
        self.cut_off = self.promised && !is_ended;
        self.cut_off
    }

    /// Why a file of so many rows is not whole.
    pub(crate) fn flaw(&self, count: usize) -> Option<String> {
        match self.rows {
            _ if !self.promised => None,
            Some(rows) if rows == count => None,
            Some(rows) => Some(format!("it says that it has {rows} rows, and has {count}")),
            None if self.cut_off => Some(format!(
                "it was cut short after {count} rows, in the middle of a line, which is left out"
            )),
            None => Some(format!("it was cut short after {count} rows")),
        }
    }
}
