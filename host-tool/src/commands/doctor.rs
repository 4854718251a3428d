//! `doctor`: why a board is not found, and what to do.

use std::fmt;

use miette::Diagnostic;
use mirror_protocol::Identity;
use serde::Serialize;

use crate::board::{Board, Found, Owner, Seen, View, find};
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
    let name = &found.name;
    let not_answering = |error: ToolError| Finding {
        kind: FindingKind::NotAnswering,
        what: format!("{name}: {error}"),
        remedy: error.help().map(|help| help.to_string()),
    };
    let seen = match Board::look(found).await {
        Ok(seen) => seen,
        Err(error) => return vec![not_answering(error)],
    };
    let view: &View = match &seen {
        Seen::Open(board) => board,
        Seen::Through(view, _) => view,
        Seen::InUse(owner) => return vec![in_use(&format!("{name}:"), owner)],
    };
    let status = match view.status().await {
        Ok(status) => status,
        Err(error) => return vec![not_answering(error)],
    };
    let Identity {
        board,
        firmware_version,
        ..
    } = view.identity();
    let board = format!("{name}: {board}, firmware {firmware_version},");
    let ready = || Finding {
        kind: FindingKind::Ready,
        what: format!("{board} is ready"),
        remedy: None,
    };
    let answers = seen
        .owner()
        .map_or_else(ready, |owner| in_use(&board, owner));
    let flaws = status.option_bytes.iter().flat_map(option_flaws);
    let flaws = flaws.map(|flaw| Finding {
        kind: FindingKind::OptionBytes,
        what: format!("{}: {}", found.name, flaw.what),
        remedy: Some(flaw.remedy),
    });
    std::iter::once(answers).chain(flaws).collect()
}

fn in_use(board: &str, owner: &Owner) -> Finding {
    Finding {
        kind: FindingKind::InUse,
        what: format!("{board} in use by {owner}"),
        remedy: Some(
            "wait until that has ended, or end it with Ctrl-C where it runs; `host-tool off` turns the \
             channels off whoever has the board"
                .to_owned(),
        ),
    }
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
