//! Ctrl-C as a terminal sends it.

use std::process::{Child, Command};

/// Interrupts a tool that runs.
pub(crate) fn interrupt(tool: &Child) {
    let id = tool.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status();
    assert!(sent.expect("`kill` runs").success());
}
