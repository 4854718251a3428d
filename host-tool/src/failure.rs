//! A failure as JSON, on standard output where the command has printed no report.

use miette::Diagnostic;
use serde::Serialize;

use crate::error::ToolError;
use crate::report;

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

/// The line.
pub(crate) fn line(error: &ToolError) -> String {
    let failure = Failure {
        code: error.code(),
        message: error.to_string(),
        help: error.help().map(|help| help.to_string()),
    };
    report::line(&Line { error: failure })
}

#[cfg(test)]
mod tests {
    use super::*;

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
