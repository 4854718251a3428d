//! What a command has to say: as text for people, as JSON for scripts.

use std::fmt::Display;
use std::io::{ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) use experiment_player::decimal;
use serde::Serialize;

/// A report has been printed: standard output holds one value, whatever comes after.
static HAS_REPORT: AtomicBool = AtomicBool::new(false);

/// The version of what `--json` prints, which docs/reference/json.md tells: another number where a key is taken away, or means
/// something else. More keys are the same version.
const FORMAT: u32 = 1;

/// A report, or what stands in its place, with the version of its form.
#[derive(Serialize)]
struct Versioned<'a, T> {
    format: u32,
    #[serde(flatten)]
    report: &'a T,
}

/// A report as one line of JSON.
pub(crate) fn line(report: &impl Serialize) -> String {
    let versioned = Versioned {
        format: FORMAT,
        report,
    };
    let line = serde_json::to_string(&versioned).expect("reports hold only numbers and text");
    line + "\n"
}

/// Whether the command has printed its report.
pub(crate) fn has_report() -> bool {
    HAS_REPORT.load(Ordering::Relaxed)
}

/// Prints `report` in the form that was asked for.
pub(crate) fn print(report: &(impl Serialize + Display), json: bool) {
    HAS_REPORT.store(true, Ordering::Relaxed);
    if json {
        write(&line(report));
    } else {
        write(&report.to_string());
    }
}

/// Prints a line that is for people only.
pub(crate) fn say(line: &str, json: bool) {
    if !json {
        write(&format!("{line}\n"));
    }
}

/// Writes to standard output. A reader that has seen enough, such as `head`, ends the tool quietly.
pub(crate) fn write(text: &str) {
    match std::io::stdout().write_all(text.as_bytes()) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        Err(error) => {
            crate::verbosity::say(format_args!("standard output cannot be written: {error}"));
            std::process::exit(1);
        }
    }
}

/// So many of a thing.
pub(crate) fn counted(count: usize, thing: &str) -> String {
    match count {
        1 => format!("1 {thing}"),
        _ => format!("{count} {thing}s"),
    }
}

/// Four numbers in a row, with their unit.
pub(crate) fn row(values: [f64; 4], decimals: usize, unit: &str) -> String {
    row_of_known(values.map(Some), decimals, unit)
}

/// A number with so many decimals, and no sign where none of its digits tells one.
fn fixed(value: f64, decimals: usize) -> String {
    let digits = format!("{value:.decimals$}");
    match digits.strip_prefix('-') {
        Some(unsigned) if unsigned.chars().all(|c| matches!(c, '0' | '.')) => unsigned.to_owned(),
        _ => digits,
    }
}

/// Four numbers in a row, with a dash where one is not known. Rows of any unit stand in line.
pub(crate) fn row_of_known(values: [Option<f64>; 4], decimals: usize, unit: &str) -> String {
    let cell = |value: Option<f64>| match value {
        Some(value) => format!("{:>9} {unit:<2}", fixed(value, decimals)),
        None => format!("{:>9}   ", "-"),
    };
    values.map(cell).join("").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_not_told_as_many() {
        let told = [0, 1, 2].map(|count| counted(count, "sample"));
        assert_eq!(told, ["0 samples", "1 sample", "2 samples"]);
    }

    #[test]
    fn a_zero_has_no_sign() {
        assert_eq!(fixed(-0.0004, 3), "0.000");
        assert_eq!(fixed(-0.0, 0), "0");
        assert_eq!(fixed(-0.0006, 3), "-0.001");
        assert_eq!(fixed(-10.0, 1), "-10.0");
        assert_eq!(
            row([-1e-5, 1.0, 0.0, -2.0], 3, "mA").matches('-').count(),
            1
        );
    }
}
