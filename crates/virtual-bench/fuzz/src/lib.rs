//! Mutated input for everything that reads bytes or text from outside: the firmware's protocol, the
//! calibration parsers, the readers of measurements, models and effects.
//!
//! A case is a number: it seeds the generator that makes the input, so that a crash can be had again.

mod calibration_bytes;
mod factory;
mod frames;
mod mutate;
mod text;

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What can be fuzzed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Target {
    /// Frames to the firmware's server, over USB.
    Frames,
    /// Calibrations as bytes.
    Calibration,
    /// Calibrations as files.
    CalibrationFile,
    /// Measurement files.
    Measurement,
    /// Model files.
    Model,
    /// Effects of a user's own.
    Effect,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Frames,
        Self::Calibration,
        Self::CalibrationFile,
        Self::Measurement,
        Self::Model,
        Self::Effect,
    ];

    /// Runs `count` cases from `first` on; the cases that panicked.
    pub fn run(self, first: u64, count: u64) -> Vec<u64> {
        let (seeds, reader): (_, fn(&[u8])) = match self {
            Self::Frames => return run_frames(first, count),
            Self::Calibration => (calibration_bytes::seeds(), calibration_bytes::run),
            Self::CalibrationFile => (text::calibration_file_seeds(), text::calibration_file),
            Self::Measurement => (text::measurement_seeds(), text::measurement),
            Self::Model => (text::model_seeds(), text::model),
            Self::Effect => (text::effect_seeds(), text::effect),
        };
        let crashes = |number: &u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(*number);
            let input = mutate::mutated(&seeds, &mut rng);
            catch_unwind(|| reader(&input)).is_err()
        };
        (first..first + count).filter(crashes).collect()
    }
}

fn run_frames(first: u64, count: u64) -> Vec<u64> {
    let seeds = frames::seeds();
    let end = first + count;
    let mut crashed = Vec::new();
    let mut next = first;
    while next < end {
        let case = Cell::new(next);
        let length = frames::CASES_A_BOARD.min(end - next);
        let run = AssertUnwindSafe(|| frames::run(&seeds, next, length, &case));
        match catch_unwind(run) {
            Ok(()) => next += length,
            Err(_) => {
                crashed.push(case.get());
                next = case.get() + 1;
            }
        }
    }
    crashed
}
