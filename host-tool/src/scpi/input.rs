//! What a client sends, cut into lines, in bounded memory.

use std::collections::VecDeque;

/// Longer lines are dropped: sixteen times the longest that a command can need, a board's path as its name.
pub(crate) const MOST_LINE_BYTES: usize = 65_536;
/// More than this does not wait while a command is carried out.
const MOST_WAITING_BYTES: usize = 4 * MOST_LINE_BYTES;

/// Bytes that have arrived and are not carried out yet.
#[derive(Debug, Default)]
pub(crate) struct Input {
    lines: VecDeque<Vec<u8>>,
    /// Bytes of `lines`.
    waiting: usize,
    begun: Vec<u8>,
    /// The line that has begun is too long: what comes of it is dropped up to its end.
    is_dropping: bool,
}

/// Something was dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Overrun;

impl Input {
    /// Takes what has arrived.
    ///
    /// # Errors
    /// Where a line is too long, which is dropped, or too much waits, which all is.
    pub(crate) fn push(&mut self, bytes: &[u8]) -> Result<(), Overrun> {
        let mut outcome = Ok(());
        for byte in bytes {
            if *byte == b'\n' {
                self.end_line();
            } else if !self.is_dropping {
                self.begun.push(*byte);
            }
            if self.begun.len() > MOST_LINE_BYTES {
                self.begun = Vec::new();
                self.is_dropping = true;
                outcome = Err(Overrun);
            }
            if self.waiting > MOST_WAITING_BYTES {
                self.lines.clear();
                self.waiting = 0;
                outcome = Err(Overrun);
            }
        }
        outcome
    }

    fn end_line(&mut self) {
        let line = std::mem::take(&mut self.begun);
        if !std::mem::take(&mut self.is_dropping) {
            // An empty line takes memory too.
            self.waiting += line.len() + size_of::<Vec<u8>>();
            self.lines.push_back(line);
        }
    }

    /// The oldest whole line, without its end.
    pub(crate) fn next_line(&mut self) -> Option<Vec<u8>> {
        let line = self.lines.pop_front()?;
        self.waiting -= line.len() + size_of::<Vec<u8>>();
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_line_that_is_too_long_is_dropped_and_the_next_one_is_whole() {
        let mut input = Input::default();
        let mut overruns = 0;
        for piece in vec![b'x'; 1 << 20].chunks(1000) {
            overruns += usize::from(input.push(piece).is_err());
            assert!(input.begun.len() <= MOST_LINE_BYTES);
        }
        assert_eq!(overruns, 1, "it is told once");
        assert_eq!(input.push(b"y\n*IDN?\n"), Ok(()));
        assert_eq!(input.next_line().as_deref(), Some(&b"*IDN?"[..]));
        assert_eq!(input.next_line(), None);
    }

    #[test]
    fn what_waits_is_bounded_even_where_lines_are_empty() {
        let mut input = Input::default();
        assert_eq!(input.push(&vec![b'\n'; 1 << 20]), Err(Overrun));
        assert!(input.waiting <= MOST_WAITING_BYTES);
        let lines = std::iter::from_fn(|| input.next_line()).count();
        assert!(lines * size_of::<Vec<u8>>() <= MOST_WAITING_BYTES);
        assert_eq!(input.waiting, 0);
    }

    proptest! {
        #[test]
        fn lines_come_back_in_any_pieces(
            lines in proptest::collection::vec("[^\n]{0,30}", 0..10), piece in 1_usize..20,
        ) {
            let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
            let mut input = Input::default();
            let mut found = Vec::new();
            for piece in text.as_bytes().chunks(piece) {
                prop_assert_eq!(input.push(piece), Ok(()));
                found.extend(std::iter::from_fn(|| input.next_line()));
            }
            let found: Vec<String> =
                found.into_iter().map(|line| String::from_utf8(line).expect("text")).collect();
            prop_assert_eq!(found, lines);
        }
    }
}
