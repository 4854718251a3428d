//! Where a person types commands for an emulated board: lines that can be edited, and the ones before.

use std::io::{self, BufRead, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Result;
use quantities::is_unit_of;
use rustyline::DefaultEditor;
use rustyline::error::ReadlineError;

const PROMPT: &str = "host-tool> ";

/// A command runs, and Ctrl-C is meant for it.
static RUNS_COMMAND: AtomicBool = AtomicBool::new(false);

/// Whether Ctrl-C ends the command that runs, and not the board.
pub(crate) fn is_interrupt_for_command() -> bool {
    RUNS_COMMAND.load(Ordering::Relaxed)
}

/// Reads lines from a person, or from what stands in their place.
pub(crate) enum Terminal {
    /// A terminal: with editing and the lines before. Ctrl-C drops the line, Ctrl-D ends.
    Edited(Box<DefaultEditor>),
    /// A file or a pipe.
    Plain,
}

impl Terminal {
    /// Standard input.
    pub(crate) fn open() -> Result<Self> {
        Ok(match io::stdin().is_terminal() {
            true => Self::Edited(Box::new(DefaultEditor::new()?)),
            false => Self::Plain,
        })
    }

    /// The words of the next line; `None` where there is no more.
    pub(crate) fn read(&mut self) -> Result<Option<Vec<String>>> {
        let Some(line) = self.line()? else {
            return Ok(None);
        };
        Ok(Some(words(&line).unwrap_or_else(|| {
            println!("a quotation mark is open in that line");
            Vec::new()
        })))
    }

    /// Runs a command, to which Ctrl-C belongs meanwhile.
    pub(crate) fn meanwhile<T>(&mut self, command: impl FnOnce() -> T) -> T {
        let is_persons = matches!(self, Self::Edited(_));
        RUNS_COMMAND.store(is_persons, Ordering::Relaxed);
        let done = command();
        RUNS_COMMAND.store(false, Ordering::Relaxed);
        done
    }

    fn line(&mut self) -> Result<Option<String>> {
        let Self::Edited(editor) = self else {
            return Ok(io::stdin().lock().lines().next().transpose()?);
        };
        match editor.readline(PROMPT) {
            Ok(line) => {
                editor.add_history_entry(&line)?;
                Ok(Some(line))
            }
            Err(ReadlineError::Interrupted) => Ok(Some(String::new())),
            Err(ReadlineError::Eof) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }
}

/// The words of a line as a shell splits them, with units put to the numbers that they were set apart from; `None` where
/// a quotation mark is open.
fn words(line: &str) -> Option<Vec<String>> {
    let mut words: Vec<String> = Vec::new();
    for word in shlex::split(line)? {
        match words.last_mut() {
            Some(number) if is_unit_of(number, &word) => number.push_str(&word),
            // What the book shows is often copied with the tool's name.
            None if word == "host-tool" => {}
            _ => words.push(word),
        }
    }
    Some(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_split_as_a_shell_does_it_and_units_belong_to_their_numbers() {
        for (line, split) in [
            ("set-z 120um", vec!["set-z", "120um"]),
            (
                "  set-z   120 um --hold 2 s ",
                vec!["set-z", "120um", "--hold", "2s"],
            ),
            ("host-tool set-z 0.12 mm", vec!["set-z", "0.12mm"]),
            (
                "set-pose 120 um 1 mrad -2 mdeg",
                vec!["set-pose", "120um", "1mrad", "-2mdeg"],
            ),
            ("spot 10 um -20 um", vec!["spot", "10um", "-20um"]),
            ("oven 30 °C", vec!["oven", "30°C"]),
            (
                "record --period 500 µs",
                vec!["record", "--period", "500µs"],
            ),
            ("record -o 'a file.csv'", vec!["record", "-o", "a file.csv"]),
            (
                "set-drive 1 V 2 V 1.5 V 0 V",
                vec!["set-drive", "1V", "2V", "1.5V", "0V"],
            ),
            ("explain um", vec!["explain", "um"]),
            ("", vec![]),
            ("# said aside", vec![]),
        ] {
            assert_eq!(
                words(line),
                Some(split.into_iter().map(str::to_owned).collect()),
                "{line}"
            );
        }
        assert_eq!(words("record -o 'a"), None);
    }
}
