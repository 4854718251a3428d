//! What a shell is told when somebody presses Tab. The script that `completions` prints asks this tool itself, so that
//! boards, effects, faults and presets are those there are.

pub(crate) mod candidates;

use std::io;

use clap::CommandFactory;
use clap_complete::env::Shells;
use clap_complete::{CompleteEnv, Shell};

use crate::cli::Arguments;

/// Set to the shell's name while that asks.
const VARIABLE: &str = "HOST_TOOL_COMPLETE";
const NAME: &str = "host-tool";

/// Answers a shell that asks, and ends this process then.
pub(crate) fn answer() {
    CompleteEnv::with_factory(Arguments::command)
        .var(VARIABLE)
        .complete();
}

/// The script that makes a shell ask.
pub(crate) fn script(shell: Shell) -> io::Result<String> {
    let mut script = Vec::new();
    let shell = shell.to_string();
    if let Some(shell) = Shells::builtins().completer(&shell) {
        shell.write_registration(VARIABLE, NAME, NAME, NAME, &mut script)?;
    }
    Ok(String::from_utf8_lossy(&script).into_owned())
}
