//! How long a board is waited for.

use std::time::Duration;

use crate::error::ToolError;

/// As the protocol has it.
pub(super) const ANSWER_TIMEOUT: Duration =
    Duration::from_millis(mirror_protocol::ANSWER_TIMEOUT_MS);

/// What a board can be asked, as an error message says it.
pub(super) type Request = &'static str;

pub(super) fn no_answer(request: Request, limit: Duration) -> ToolError {
    ToolError::NoAnswer {
        request,
        seconds: limit.as_secs_f64(),
    }
}
