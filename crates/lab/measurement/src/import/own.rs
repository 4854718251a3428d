//! What a file in the format of measurement files says of itself in `# key=value` lines, beside its table.

use crate::Keys;
use crate::column::Column;
use crate::keys::is_key;
use crate::parse::set_key;
use crate::wholeness::Wholeness;

/// What a program that saves a table may append to a comment: empty cells.
const EMPTY_CELLS: [char; 3] = [',', ';', '\t'];

/// A text's keys, and whether it has its end.
#[derive(Default)]
pub(super) struct Own {
    keys: Keys,
    /// Sentences about keys that cannot be kept.
    told: Vec<String>,
    wholeness: Wholeness,
}

impl Own {
    /// Reads the keys of a text; with them the text without a last line that breaks off.
    pub(super) fn read(text: &str) -> (Self, &str) {
        let (mut own, mut end) = (Self::default(), 0);
        for (number, line) in (1..).zip(text.split_inclusive('\n')) {
            if own.wholeness.is_cut_off(line.ends_with('\n')) {
                break;
            }
            end += line.len();
            let comment = line.trim_end().trim_end_matches(EMPTY_CELLS);
            if let Some((key, value)) = comment.strip_prefix('#').and_then(|c| c.split_once('=')) {
                own.take(key.trim(), value.trim(), number);
            }
        }
        (own, &text[..end])
    }

    fn take(&mut self, key: &str, value: &str, line: usize) {
        if !is_key(key) || self.wholeness.takes(key, value) {
            return;
        }
        if let Err(complaint) = set_key(&mut self.keys, key, value) {
            let message = complaint.message;
            self.told
                .push(format!("line {line} is left out: {message}"));
        }
    }

    /// The keys of a table of so many rows in columns of these names, and what is to be told of them; none of a table in another
    /// format, where comments may mean anything.
    pub(super) fn of_table(mut self, names: &[String], rows: usize) -> (Keys, Vec<String>) {
        let are_known = names.iter().all(|name| Column::from_name(name).is_some());
        if !are_known && !self.wholeness.is_promised() {
            return (Keys::default(), Vec::new());
        }
        if let Some(flaw) = self.wholeness.flaw(rows) {
            self.keys.set("partial", &flaw);
        }
        if let Some(why) = self.keys.get("partial") {
            let told = format!("this file is not whole, and what is made of it says so: {why}");
            self.told.push(told);
        }
        (self.keys, self.told)
    }
}
