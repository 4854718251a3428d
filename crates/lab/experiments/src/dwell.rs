//! What drives a mirror from one reading of an experiment to the next.

use crate::experiment::{ACTUATORS, Experiment, Quantity, Run, Signal};
use crate::reading::{Reading, SLOWING};

/// What drives a mirror up to one reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dwell {
    /// Time at 0 V before it, which the experiment's own clock leaves out (s).
    pub rest_s: f64,
    /// How long the drive is held, or takes to get there (s).
    pub duration_s: f64,
    /// Voltage at each actuator at its begin (V).
    pub from_v: [f64; ACTUATORS],
    /// Voltage at each actuator at its end (V): another one along a curve only.
    pub to_v: [f64; ACTUATORS],
    /// How far a stage has moved the mirror (um).
    pub stage_um: f64,
}

impl Experiment {
    /// Every reading with what drives the mirror up to it. `None` where positions move: what drives a mirror there is the
    /// board's to find.
    pub fn dwells(&self) -> Option<Vec<Dwell>> {
        let mut dwells = Vec::new();
        for run in &self.runs {
            let first = dwells.len();
            for _ in 0..run.cycles_of_steps() {
                run.add_dwells(self.reading, &mut dwells)?;
            }
            if let Some(first) = dwells.get_mut(first) {
                first.rest_s = run.rest_s;
            }
        }
        Some(dwells)
    }

    /// Whether the drive moves in straight lines from reading to reading, or is held.
    pub fn is_curved(&self) -> bool {
        matches!(self.reading, Reading::Evenly { .. })
    }
}

impl Run {
    /// A periodic signal is read in one go.
    fn cycles_of_steps(&self) -> u32 {
        match self.signal {
            Signal::Steps { .. } => self.cycles,
            Signal::Lines { .. } | Signal::Sine(_) | Signal::Triangle(_) => 1,
        }
    }

    fn add_dwells(&self, reading: Reading, dwells: &mut Vec<Dwell>) -> Option<()> {
        match (&self.signal, reading) {
            (Signal::Steps { values, dwell_s }, _) => {
                for &value in values {
                    let parts = match reading {
                        Reading::AfterSteps { rate_hz } => after_a_step(*dwell_s, 1.0 / rate_hz),
                        Reading::EndOfDwell | Reading::Evenly { .. } => vec![*dwell_s],
                    };
                    for duration_s in parts {
                        dwells.push(self.dwell(duration_s, value, value)?);
                    }
                }
            }
            (Signal::Sine(wave), Reading::Evenly { readings }) => {
                let at = |reading: u32| {
                    wave.sine(f64::from(reading) / f64::from(readings) * f64::from(self.cycles))
                };
                let duration_s = self.duration_s() / f64::from(readings);
                for reading in 0..readings {
                    dwells.push(self.dwell(duration_s, at(reading), at(reading + 1))?);
                }
            }
            // Only positions go along these.
            (Signal::Sine(_) | Signal::Lines { .. } | Signal::Triangle(_), _) => return None,
        }
        Some(())
    }

    fn dwell(&self, duration_s: f64, from: f64, to: f64) -> Option<Dwell> {
        let (from_v, to_v, stage_um) = match self.quantity {
            Quantity::Position => return None,
            Quantity::StageHeight => ([0.0; ACTUATORS], [0.0; ACTUATORS], to),
            Quantity::Voltage { active, others_v } => {
                let drive = |volts: f64| active.map(|moves| if moves { volts } else { others_v });
                (drive(from), drive(to), 0.0)
            }
        };
        Some(Dwell {
            rest_s: 0.0,
            duration_s,
            from_v,
            to_v,
            stage_um,
        })
    }
}

/// From reading to reading after a step that is held so long (s).
fn after_a_step(hold_s: f64, first_s: f64) -> Vec<f64> {
    /// Where a board would be as fast as it can, its tick (s).
    const FASTEST_S: f64 = 1e-4;
    let (mut dwells, mut passed_s) = (Vec::new(), 0.0);
    while passed_s < hold_s * (1.0 - 1e-9) {
        let slowed_s: f64 = passed_s / f64::from(SLOWING);
        let dwell_s = slowed_s.max(first_s.max(FASTEST_S)).min(hold_s - passed_s);
        dwells.push(dwell_s);
        passed_s += dwell_s;
    }
    dwells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_after_a_step_are_dense_first_and_end_in_time() {
        let dwells = after_a_step(30.0, 2e-4);
        assert_eq!(dwells[0], 2e-4);
        approx::assert_relative_eq!(dwells.iter().sum::<f64>(), 30.0, max_relative = 1e-12);
        // 20 of the first, up to 4 ms, then ln(30 s / 4 ms) / ln(1 + 1/20) = 183, and the last.
        assert!((200..210).contains(&dwells.len()), "{}", dwells.len());
    }

    #[test]
    fn a_sweep_is_read_at_the_end_of_every_step() {
        let dwells = Experiment::sweep(3.5, 7, 1.0, 2).dwells().expect("drives");
        assert_eq!(dwells.len(), 30);
        assert!(dwells.iter().all(|dwell| dwell.from_v == dwell.to_v));
        let first: Vec<f64> = dwells.iter().take(9).map(|dwell| dwell.to_v[3]).collect();
        assert_eq!(first, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 3.0]);
    }

    #[test]
    fn each_actuator_alone_is_heated_after_a_rest_with_the_others_sensed() {
        let dwells = Experiment::single(3.5, 1, 1.0).dwells().expect("drives");
        let told: Vec<_> = dwells.iter().map(|d| (d.rest_s, d.to_v)).collect();
        assert_eq!(told[1], (0.0, [3.5, 0.2, 0.2, 0.2]));
        assert_eq!(told[2], (2.0, [0.2, 0.0, 0.2, 0.2]));
        assert_eq!(told[7], (0.0, [0.2, 0.2, 0.2, 3.5]));
    }

    #[test]
    fn a_sine_goes_in_lines_from_reading_to_reading() {
        let sine = Experiment::sine(1.0, 0.5, 20.0, 3);
        let dwells = sine.dwells().expect("drives");
        assert_eq!(dwells.len(), 300);
        approx::assert_relative_eq!(dwells[24].to_v[0], 1.5, max_relative = 1e-12);
        approx::assert_relative_eq!(dwells[299].to_v[2], 1.0, max_relative = 1e-12);
        for pair in dwells.windows(2) {
            assert_eq!(pair[0].to_v, pair[1].from_v);
            approx::assert_relative_eq!(pair[0].duration_s, 5e-4, max_relative = 1e-12);
        }
        assert_eq!(sine.drive_key().as_deref(), Some("1.0+0.5*sin(2*pi*f*t)"));
    }

    #[test]
    fn a_stage_moves_and_nothing_is_driven() {
        let dwells = Experiment::reference(&[0.0, 40.0], 1.0).dwells();
        let dwells = dwells.expect("nothing to find");
        assert_eq!((dwells[1].to_v, dwells[1].stage_um), ([0.0; 4], 40.0));
    }

    #[test]
    fn what_drives_a_position_is_the_board_s_to_find() {
        assert_eq!(Experiment::positions("rest", &[10.0], 1.0).dwells(), None);
    }
}
