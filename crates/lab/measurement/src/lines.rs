//! A file line by line, no line longer than a limit.

use input_file::BYTE_ORDER_MARK;
use std::io::{self, BufRead};
use std::ops::Range;

/// The longest line (bytes): a row of every column takes 450, and a comment is a paragraph.
pub(crate) const MOST_OF_A_LINE: usize = 64 * 1024;

/// A line without its end.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Line {
    pub(crate) text: String,
    /// Where its text begins in the file (bytes).
    pub(crate) start: usize,
    /// Counted from 1.
    pub(crate) number: usize,
    /// A line end came after it; the file's last line may lack one.
    pub(crate) ended: bool,
}

/// Why there is no next line.
#[derive(Debug)]
pub(crate) enum LineError {
    /// What the system said.
    Io(io::Error),
    /// Its beginning.
    TooLong(Line),
    /// The line, with marks in place of what is no UTF-8.
    NotText(Line),
}

impl Line {
    /// Its place in the file.
    pub(crate) fn place(&self) -> Range<usize> {
        self.start..self.start + self.text.len()
    }

    /// The cells between its commas, without blanks and quotation marks around them, with their places in the file.
    pub(crate) fn cells(&self) -> impl Iterator<Item = (&str, Range<usize>)> {
        let mut next = self.start;
        self.text.split(',').map(move |cell| {
            let (begin, trimmed) = (next, cell.trim());
            next += cell.len() + 1;
            let quoted = trimmed
                .strip_prefix('"')
                .and_then(|rest| rest.strip_suffix('"'));
            let start = begin + (cell.len() - cell.trim_start().len());
            match quoted {
                Some(inner) => (inner.trim(), start + 1..start + 1 + inner.len()),
                None => (trimmed, start..start + trimmed.len()),
            }
        })
    }
}

/// The lines of a file. They end in a line feed, a carriage return, or both.
pub(crate) struct Lines<R> {
    source: R,
    offset: usize,
    count: usize,
}

impl<R: BufRead> Lines<R> {
    pub(crate) fn new(source: R) -> Self {
        Self {
            source,
            offset: 0,
            count: 0,
        }
    }

    pub(crate) fn into_source(self) -> R {
        self.source
    }

    /// The next line; `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<Line>, LineError> {
        let start = self.offset;
        let (mut bytes, mut ended) = (Vec::new(), false);
        while !ended {
            let arrived = self.source.fill_buf().map_err(LineError::Io)?;
            if arrived.is_empty() {
                break;
            }
            let end = arrived.iter().position(|b| matches!(b, b'\n' | b'\r'));
            bytes.extend_from_slice(&arrived[..end.unwrap_or(arrived.len())]);
            ended = end.is_some();
            let returned = end.is_some_and(|end| arrived[end] == b'\r');
            let taken = end.map_or(arrived.len(), |end| end + 1);
            self.pass(taken);
            if returned && self.source.fill_buf().map_err(LineError::Io)?.first() == Some(&b'\n') {
                self.pass(1);
            }
            if bytes.len() > MOST_OF_A_LINE {
                bytes.truncate(MOST_OF_A_LINE);
                return Err(LineError::TooLong(self.line(start, &bytes, ended).0));
            }
        }
        if bytes.is_empty() && !ended {
            return Ok(None);
        }
        match self.line(start, &bytes, ended) {
            (line, true) => Ok(Some(line)),
            (line, false) => Err(LineError::NotText(line)),
        }
    }

    fn pass(&mut self, count: usize) {
        self.source.consume(count);
        self.offset += count;
    }

    /// The line of these bytes, and whether they are text.
    fn line(&mut self, start: usize, bytes: &[u8], ended: bool) -> (Line, bool) {
        let mark = match bytes.strip_prefix(BYTE_ORDER_MARK.as_bytes()) {
            Some(_) if start == 0 => BYTE_ORDER_MARK.len(),
            _ => 0,
        };
        self.count += 1;
        let text = String::from_utf8_lossy(&bytes[mark..]);
        let is_text = std::str::from_utf8(bytes).is_ok();
        let line = Line {
            text: text.into_owned(),
            start: start + mark,
            number: self.count,
            ended,
        };
        (line, is_text)
    }
}
