//! `doctor`: why a board is not found, and what to do.

use std::fmt;

use miette::Diagnostic;
use serde::Serialize;

use crate::board::{Board, Found, Seen, find};
use crate::doctor::{Finding, FindingKind, Surroundings};
use crate::error::ToolError;
use crate::option_bytes::option_flaws;
use crate::report;

#[derive(Serialize)]
struct Findings {
    findings: Vec<Finding>,
}

pub(super) async fn run(json: bool) -> Result<(), ToolError> {
    let mut findings = Vec::new();
    let obstacles = Surroundings::of_this_machine().examine();
    let is_closed = |finding: &Finding| {
        matches!(
            finding.kind,
            FindingKind::NoPermission | FindingKind::NoNode
        )
    };
    let usb_is_closed = obstacles.iter().any(is_closed);
    for found in find() {
        // What may not be opened has been told already.
        if !(usb_is_closed && found.is_usb()) {
            findings.extend(greet(&found).await);
        }
    }
    let has_emulated = !findings.is_empty();
    // Where emulated boards run, nobody misses USB.
    let is_missed = |finding: &Finding| {
        !(has_emulated && matches!(finding.kind, FindingKind::NothingOnUsb | FindingKind::NoUsb))
    };
    findings.extend(obstacles.into_iter().filter(is_missed));
    let is_ready = findings
        .iter()
        .any(|finding| finding.kind == FindingKind::Ready);
    report::print(&Findings { findings }, json);
    match is_ready {
        true => Ok(()),
        false => Err(ToolError::NoBoardReady),
    }
}

async fn greet(found: &Found) -> Vec<Finding> {
    let not_answering = |error: ToolError| Finding {
        kind: FindingKind::NotAnswering,
        what: format!("{}: {error}", found.name),
        remedy: error.help().map(|help| help.to_string()),
    };
    let board = match Board::look(found).await {
        Ok(Seen::Open(board)) => board,
        Ok(Seen::InUse(owner)) => {
            return vec![Finding {
                kind: FindingKind::InUse,
                what: format!("{}: in use by {owner}", found.name),
                remedy: Some(
                    "wait until that has ended, or end it with Ctrl-C where it runs; `host-tool off` turns the \
                     channels off whoever has the board"
                        .to_owned(),
                ),
            }];
        }
        Err(error) => return vec![not_answering(error)],
    };
    let status = match board.status().await {
        Ok(status) => status,
        Err(error) => return vec![not_answering(error)],
    };
    let ready = Finding {
        kind: FindingKind::Ready,
        what: format!(
            "{}: {}, firmware {}, is ready",
            found.name,
            board.identity().board,
            board.identity().firmware_version
        ),
        remedy: None,
    };
    let flaws = status.option_bytes.iter().flat_map(option_flaws);
    let flaws = flaws.map(|flaw| Finding {
        kind: FindingKind::OptionBytes,
        what: format!("{}: {}", found.name, flaw.what),
        remedy: Some(flaw.remedy),
    });
    std::iter::once(ready).chain(flaws).collect()
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Finding { kind, what, remedy } in &self.findings {
            let mark = match kind {
                FindingKind::Ready => "ok ",
                _ => "-> ",
            };
            writeln!(f, "{mark}{what}")?;
            if let Some(remedy) = remedy {
                writeln!(f, "     {remedy}")?;
            }
        }
        Ok(())
    }
}
