//! A story that was told, and what came of it.

use std::time::Duration;

use super::mirror::HiddenIn;
use super::person::{Move, There};

/// What was tried on the mirror with one calibration.
pub(super) struct Chapter {
    pub(super) title: String,
    /// What the model that the board goes by leaves of the session (um, root mean square).
    pub(super) session_rms_um: f64,
    /// How far the rest that its positions count from is from where the mirror rested before it was ever driven (um).
    pub(super) rest_um: f64,
    pub(super) moves: Vec<Move>,
}

impl Chapter {
    /// How far the mirror was from where it was to be (um, root mean square).
    pub(super) fn error_rms_um(&self) -> f64 {
        rms(self.moves.iter().filter_map(Move::error_um))
    }

    pub(super) fn print(&self) {
        println!("\n{}", self.title);
        println!(
            "  the model leaves {:.3} um rms of the session",
            self.session_rms_um
        );
        println!(
            "  from rest, which is {:+.3} um from where it was at first",
            self.rest_um
        );
        println!("  predicted     read       was     error");
        for moved in &self.moves {
            let asked_um = moved.asked_um;
            match &moved.came {
                Ok(There { read_um, plate_um }) => println!(
                    "  {asked_um:>9.3} {read_um:>8.3} {plate_um:>9.3} {:>+9.3} um",
                    plate_um - asked_um
                ),
                Err(why) => println!("  {asked_um:>9.3} {why}"),
            }
        }
        println!("  {:.3} um rms\n", self.error_rms_um());
    }
}

/// A story that was told to its end.
pub(super) struct Story {
    pub(super) seed: u64,
    pub(super) hidden: HiddenIn,
    pub(super) verdict: String,
    /// What the diagnosis names, the best first.
    pub(super) suspects: Vec<String>,
    pub(super) chapters: Vec<Chapter>,
    /// Why `calibrate` left the board as it was, where its trial was worse.
    pub(super) refusal: Option<String>,
    pub(super) took: Duration,
}

impl Story {
    /// The error of `set-z` on the board as it came, and in the end (um, root mean square), at the positions that were reached
    /// both times.
    pub(super) fn errors_um(&self) -> Option<[f64; 2]> {
        let (first, last) = (self.chapters.first()?, self.chapters.last()?);
        let both: Vec<[f64; 2]> = first
            .moves
            .iter()
            .filter_map(|moved| {
                let again = last
                    .moves
                    .iter()
                    .find(|again| again.asked_um == moved.asked_um)?;
                Some([moved.error_um()?, again.error_um()?])
            })
            .collect();
        Some([0, 1].map(|when| rms(both.iter().map(|errors| errors[when]))))
    }

    /// What this bench cannot better (um, root mean square).
    pub(super) fn limit_um(&self) -> f64 {
        let moves = self
            .chapters
            .last()
            .into_iter()
            .flat_map(|last| &last.moves);
        rms(moves.map(|moved| self.hidden.limit_um(moved.asked_um)))
    }

    /// Whether the error fell ten times, or to what this bench cannot better.
    pub(super) fn ends_well(&self) -> bool {
        let enough = |[before, after]: [f64; 2]| after <= 0.1 * before || after <= self.limit_um();
        self.errors_um().is_some_and(enough)
    }
}

/// Root mean square.
fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count().max(1) as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}
