//! `report` and `replay`: a session, what it says and what it is computed from as one page, and the same once more.

use std::fmt;
use std::path::{Path, PathBuf};

use identification::dataset::{Thinned, thinned};
use input_file::MOST_WRITTEN;
use lab_view::{MeasuredText, Opening};
use measurement::Session;
use serde::Serialize;

use super::loaded::{cache_directory, model_and_session, own_effect, warn};
use crate::cli::{LabInput, Report};
use crate::error::{ToolError, UnusableInput};
use crate::new_file::NewFile;
use crate::page::{Difference, Inside, Run, differences, shown_otherwise};
use crate::report as printed;
use crate::tried::Tried;
use crate::verbosity::say;
use crate::working::while_working;

const WORKING: &str =
    "fitting, trying every effect, and mirrors that lack nothing (kept for the next time)";
/// What a page should stay below (bytes), so that it can be sent by mail and opens at once.
const LARGE: usize = 2_000_000;

#[derive(Serialize)]
struct WrittenPage {
    /// The page.
    page: PathBuf,
    bytes: usize,
    /// The verdict in words.
    verdict: String,
    /// Rows of the session that are not in the page.
    rows_left_out: usize,
}

/// `report`: everything about a session in one page.
pub(crate) fn report(ask: Report, json: bool) -> Result<(), ToolError> {
    let input = LabInput {
        model: ask.model,
        files: ask.files,
    };
    let (model, session) = model_and_session(&input)?;
    session.check_points()?;
    let tried = ask.trial.as_deref().map(Tried::load).transpose()?;
    let Thinned {
        session,
        rows_left_out,
        ..
    } = thinned(&session);
    let text = |path: &PathBuf| {
        own_effect(path)?;
        Ok(input_file::read_text(path, MOST_WRITTEN)?)
    };
    let opening = Opening {
        model: model.to_toml(),
        files: texts(&session),
        own_effects: ask
            .effect
            .iter()
            .map(text)
            .collect::<Result<_, ToolError>>()?,
    };
    let file = NewFile::page(ask.output.clone(), ask.force)?.beside(&input.files)?;
    let run = while_working(WORKING, json, || {
        Run::carry_out(opening, rows_left_out, tried, &cache_directory())
    });
    let run = run.map_err(|error| error.of(&ask.output))?;
    let html = run.to_html();
    let written = WrittenPage {
        page: file.write(&html)?,
        bytes: html.len(),
        verdict: run.verdict(),
        rows_left_out,
    };
    printed::print(&written, json);
    if written.bytes > LARGE {
        say(format_args!(
            "warning: the page is large; a session of fewer files makes a smaller one"
        ));
    }
    Ok(())
}

fn texts(session: &Session) -> Vec<MeasuredText> {
    let text = |(name, file): &(String, measurement::MeasurementFile)| MeasuredText {
        name: name.clone(),
        text: file.to_string(),
    };
    session.files.iter().map(text).collect()
}

impl fmt::Display for WrittenPage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.verdict)?;
        if self.rows_left_out > 0 {
            writeln!(
                f,
                "  {} rows of dense sampling are left out; all of the page is computed from the others",
                self.rows_left_out
            )?;
        }
        let megabytes = self.bytes as f64 / 1e6;
        writeln!(
            f,
            "  {} ({megabytes:.1} MB) shows it in any browser, without a network; `host-tool replay` repeats it",
            self.page.display()
        )
    }
}

/// What became of a run that was repeated.
#[derive(Serialize)]
struct Replayed {
    /// The verdict in words, of this run.
    verdict: String,
    /// Version of the tool that wrote the page.
    version: String,
    /// Numbers and words that were compared.
    compared: usize,
    /// Those that are not the same, and the first place where the page shows something else.
    differences: Vec<Difference>,
    /// Whether what the page shows was compared, too: what this version on this processor writes is the same to the last letter.
    shown_compared: bool,
}

/// `replay`: the run of a page once more.
pub(crate) fn replay(page: &Path, json: bool) -> Result<(), ToolError> {
    let bytes = input_file::read(page, input_file::MOST_MADE)?;
    let not_whole = |reason| UnusableInput::NotAReport {
        path: page.to_owned(),
        reason,
    };
    let inside = Inside::read(&bytes).map_err(not_whole)?;
    let run = while_working(WORKING, json, || {
        Run::carry_out(
            inside.opening.clone(),
            inside.rows_left_out,
            inside.tried.clone(),
            &cache_directory(),
        )
    });
    let run = run.map_err(|error| error.of(page))?;
    warn(&run.flaws);
    let (compared, mut differences) = differences(&inside, &run.inside);
    let shown_compared = differences.is_empty() && inside.version == env!("CARGO_PKG_VERSION");
    if shown_compared {
        let shown = String::from_utf8_lossy(&bytes);
        differences.extend(shown_otherwise(&shown, &run.to_html()));
    }
    let count = differences.iter().filter(|d| !d.is_rounding()).count();
    let replayed = Replayed {
        verdict: run.verdict(),
        version: inside.version,
        compared,
        differences,
        shown_compared,
    };
    printed::print(&replayed, json);
    match count {
        0 => Ok(()),
        count => Err(ToolError::ReplayDiffers {
            path: page.to_owned(),
            count,
            version: replayed.version,
        }),
    }
}

impl fmt::Display for Replayed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.verdict)?;
        let (rounding, other): (Vec<_>, Vec<_>) = self
            .differences
            .iter()
            .partition(|difference| difference.is_rounding());
        let compared = self.compared;
        if self.differences.is_empty() {
            writeln!(
                f,
                "  the same as in the page: all of {compared} numbers and words, to the last bit"
            )?;
            return self.shown(f);
        }
        if !rounding.is_empty() {
            writeln!(
                f,
                "  {} of {compared} numbers differ by rounding, as another processor's mathematics does",
                rounding.len()
            )?;
        }
        if other.is_empty() {
            writeln!(f, "  all others are the same as in the page")?;
            return self.shown(f);
        }
        writeln!(
            f,
            "  {} of {compared} numbers and words are not the page's:",
            other.len()
        )?;
        for difference in other.iter().take(SHOWN) {
            writeln!(f, "    {difference}")?;
        }
        match other.len().saturating_sub(SHOWN) {
            0 => Ok(()),
            more => writeln!(f, "    and {more} more"),
        }
    }
}

impl Replayed {
    /// What is known of what the page shows, where nothing differs.
    fn shown(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.shown_compared {
            true => writeln!(f, "  and so is all that the page shows"),
            false => writeln!(
                f,
                "  what the page shows was not compared, only what it carries: another version or processor wrote it"
            ),
        }
    }
}

/// Differences that are listed.
const SHOWN: usize = 12;
