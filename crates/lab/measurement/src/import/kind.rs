//! Cells that are numbers of another kind: parts of a hundred, and times.

/// What a cell's number is, where it is no plain one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A number with `%` behind it.
    Percent,
    /// A date with a time, or a time of some day.
    Clock,
    /// How long something took.
    Duration,
}

/// The first cell of a kind in a column.
#[derive(Clone, Debug, PartialEq)]
pub struct KindOfCells {
    /// Which of the table's columns, from 0.
    pub column: usize,
    /// What its cells are.
    pub kind: Kind,
    pub(super) cell: String,
    pub(super) line: usize,
}
