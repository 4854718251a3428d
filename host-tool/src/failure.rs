//! A failure as JSON, on standard output where the command has printed no report.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::ErrorKind;
use miette::Diagnostic;
use serde::Serialize;

use crate::error::ToolError;
use crate::report;
use crate::verbosity::say;

#[derive(Serialize)]
struct Line {
    error: Failure,
}

/// What scripts learn of a failure.
#[derive(Serialize)]
struct Failure {
    /// The kind of failure; it stays the same where the words change.
    code: &'static str,
    /// What happened.
    message: String,
    /// What to do next.
    help: Option<String>,
}

/// Tells a failure, and returns the code in which it ends.
pub(crate) fn tell(error: ToolError, json: bool) -> u8 {
    let exit_code = error.exit_code();
    if json && !report::has_report() {
        report::write(&line(&error));
    }
    say(format_args!("{:?}", miette::Report::new(error)));
    exit_code
}

/// The line.
fn line(error: &ToolError) -> String {
    let failure = Failure {
        code: error.code(),
        message: error.to_string(),
        help: error.help().map(|help| help.to_string()),
    };
    report::line(&Line { error: failure })
}

/// Tells what is wrong with a command line, in words and where they ask for it as JSON; or shows what was asked for instead of a
/// command: help, or the version.
pub(crate) fn of_usage(error: &clap::Error, words: impl Iterator<Item = OsString>) -> ExitCode {
    // What follows `--` is for no option.
    let mut options = words.take_while(|word| word != "--");
    if error.use_stderr() && options.any(|word| word == "--json") {
        report::write(&usage_line(error));
    }
    // Where standard error is closed, nobody reads it.
    let _ = error.print();
    ExitCode::from(error.exit_code() as u8)
}

/// The line of a command line that is none. What clap says are paragraphs, of which the first is what happened.
fn usage_line(error: &clap::Error) -> String {
    let told = error.render().to_string();
    let mut paragraphs = told
        .split("\n\n")
        .map(|paragraph| paragraph.split_whitespace().collect::<Vec<_>>().join(" "));
    let first = paragraphs.next().unwrap_or_default();
    let (message, help) = match error.kind() {
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => (
            "a command is missing".to_owned(),
            "`host-tool --help` shows those there are".to_owned(),
        ),
        _ => (
            first.trim_start_matches("error: ").to_owned(),
            paragraphs.collect::<Vec<_>>().join("; "),
        ),
    };
    let failure = Failure {
        code: "usage",
        message,
        help: Some(help),
    };
    report::line(&Line { error: failure })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::Arguments;

    #[test]
    fn a_command_line_that_is_none_has_a_line_too() {
        let said = |words: &str| -> serde_json::Value {
            let error = Arguments::try_parse_from(words.split(' ')).expect_err("it is none");
            serde_json::from_str(&usage_line(&error)).expect("JSON")
        };
        for (words, message, help) in [
            ("host-tool set-z 3", "'3'", "--help"),
            ("host-tool set-z", "<Z>", "Usage: host-tool set-z"),
            ("host-tool set-x 3um", "'set-x'", "'set-z'"),
            ("host-tool status --histroy", "'--histroy'", "'--history'"),
            ("host-tool room maybe", "'maybe'", "--help"),
            ("host-tool", "a command is missing", "host-tool --help"),
            ("host-tool measure", "a command is missing", "--help"),
        ] {
            let error = &said(words)["error"];
            assert_eq!(error["code"], "usage", "{words}");
            let told = |key: &str| error[key].as_str().expect("text").to_owned();
            assert!(told("message").contains(message), "{words}: {error}");
            assert!(told("help").contains(help), "{words}: {error}");
            assert!(!told("message").starts_with("error"), "{error}");
        }
    }

    #[test]
    fn a_failure_has_its_code_what_happened_and_what_to_do() {
        let error = ToolError::NoSuchFault {
            name: "over-\"temp\"".to_owned(),
            nearest: Some("over-temperature".to_owned()),
        };
        let value: serde_json::Value = serde_json::from_str(&line(&error)).expect("JSON");
        let failure = &value["error"];
        assert_eq!(failure["code"], "no-such-fault");
        assert_eq!(failure["message"], error.to_string());
        assert!(
            error
                .to_string()
                .ends_with("did you mean `over-temperature`?")
        );
        assert!(failure["help"].as_str().expect("words").contains("explain"));
    }
}
