//! What came of stories, as a table.

use std::fs;
use std::path::PathBuf;

use anyhow::Result;
use xtask::cargo::workspace;

use super::told::Story;

/// Where the table of all effects stands, and what stands above it.
const PAGE: &str = "docs/figures/story.md";
const ABOVE: &str = "\
# Whole stories

`cargo xtask story --full` tells the story of [its page](../guide/story.md) for every effect that a diagnosis can name, and
writes this table. Each is hidden, at a size that happens, in a mirror that nothing was developed on; the board, the tool and all
commands are those that a user has. The virtual mirrors share no equation with the model. They are of the families A, B and E, from
which, with other seeds, the thresholds of the diagnosis come, too: mirrors of the other families are too hot for this board, or do
not come so far. What a verdict is worth on layouts that it never saw [was measured apart](diagnosis.md).

- *As it came* to *calibrated*: how far the mirror was from 20, 60, 120 and 160 um above its rest when `set-z` said so, root mean
  square, by where the mirror was and not by its sensor. First the board as the factory left it; then with the inverse of the fitted model;
  of the model with the first suspect added; after `calibrate --quick`. Where the board turned itself off on the way, which a
  calibration for another mirror lets happen, the position is left out. *Calibration refused*: `calibrate` found in its own trial
  that the new calibration was worse, and left the board as it was.
- *Rest*: where the mirror rested when it was calibrated, beside where it did before it was ever driven. A position counts from where
  the mirror rested when the measurements began that its calibration was made from: a sensor is zeroed there, and knows of nothing
  before. What the rest does after that is an error as any other.
- *Falls*: from the first to the last, at the positions that were reached both times.
- *Limit*: what the position sensor, zeroed at rest, is off by at these positions, which nobody can better who has no other, and
  three standard deviations of what wanders in it.
- *s*: how long the story took, on a machine that others used too.

An error that neither fell ten times nor to the limit is said to fall short.
";

/// The table's first lines.
pub(super) const HEADING: &str = "| seed | hidden | verdict | as it came, um | fitted | with the suspect | calibrated | rest, um | falls | limit, um | s |\n\
                                  |---|---|---|---|---|---|---|---|---|---|---|";

/// What came of a story.
pub(super) fn row(story: &Story) -> String {
    let mut errors: Vec<String> = story
        .chapters
        .iter()
        .map(|chapter| format!("{:.3}", chapter.error_rms_um()))
        .collect();
    // Where nothing is named there is nothing to add.
    if story.suspects.is_empty() {
        errors.insert(2, "-".to_owned());
    }
    let verdict = [&[story.verdict.clone()][..], &story.suspects].concat();
    // As it is printed; what rounds to zero has no sign.
    let rest_um = story.chapters.last().map_or(0.0, |last| last.rest_um);
    let rest_um = (1e3 * rest_um).round() / 1e3 + 0.0;
    let [before, after] = story.errors_um().unwrap_or([f64::NAN; 2]);
    format!(
        "| {} | {} | {} | {} | {rest_um:+.3} | {} times{} | {:.3} | {:.0} |",
        story.seed,
        story.hidden.effect,
        verdict.join(" "),
        errors.join(" | "),
        times(before / after),
        match (story.ends_well(), &story.refusal) {
            (true, _) => "",
            (false, None) => ": falls short",
            (false, Some(_)) => ": falls short, calibration refused",
        },
        story.limit_um(),
        story.took.as_secs_f64(),
    )
}

/// How many times the error fell: less than ten is never told as ten.
fn times(fell: f64) -> String {
    match fell < 10.0 {
        true => format!("{:.1}", (10.0 * fell).floor() / 10.0),
        false => format!("{fell:.0}"),
    }
}

#[test]
fn less_than_ten_times_is_not_told_as_ten() {
    let told = [9.57, 9.99, 10.0, 608.6].map(times);
    assert_eq!(told, ["9.5", "9.9", "10", "609"]);
}

/// Writes the page with these rows, and returns where.
pub(super) fn write(rows: &[String]) -> Result<PathBuf> {
    let path = workspace().join(PAGE);
    fs::write(&path, format!("{ABOVE}\n{HEADING}\n{}\n", rows.join("\n")))?;
    Ok(path)
}
