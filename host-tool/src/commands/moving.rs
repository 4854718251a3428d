//! What the commands that drive the mirror share: settling, reading, and saying it.

use std::fmt;

use control_core::{Limit, Limits};
use mirror_protocol::{ChannelState, Commanded, LEASE_FOREVER_MS, Status, Telemetry};
use quantities::{Hold, Span};
use serde::Serialize;

use crate::board::Board;
use crate::commands::interrupt::Interrupt;
use crate::error::{SensorFault, ToolError};
use crate::verbosity::note;

use crate::report::{decimal, row, row_of_known};

/// Readings are the mean of so many samples, a millisecond apart.
const READING_SAMPLES: u32 = 100;
const READING_PERIOD: Span = Span { s: 1e-3 };
/// What is allowed for reading in a lease: twice as long as it takes.
const READING_S: f64 = 2.0 * READING_SAMPLES as f64 * READING_PERIOD.s;

/// A position is held for so long where nobody says for how long.
const USUAL: Span = Span { s: 600.0 };

/// How long the board holds a position of several that are read one after the other. A tool that others keep waiting on a busy machine is in
/// time for the next one, and a tool that was killed leaves the mirror driven for no longer.
pub(super) const UNTIL_THE_NEXT: Hold = Hold::For(HELD_UNTIL_THE_NEXT);
const HELD_UNTIL_THE_NEXT: Span = Span { s: 10.0 };

/// What was read while the mirror stood.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Readings {
    pub(super) drive_v: [f64; 4],
    pub(super) current_a: [f64; 4],
    /// Above ambient, as the currents imply; unknown where a drive is too small to tell.
    pub(super) temperature_rise_k: [Option<f64>; 4],
    /// Position sensor on the board, which the controller never sees.
    pub(super) sensor_z_um: Option<f64>,
    /// Those that acted meanwhile.
    #[serde(skip)]
    pub(super) limits: Limits,
}

/// How long to wait for the mirror, and how long the board then holds it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    pub(super) settle: Span,
    pub(super) hold: Hold,
}

impl Pace {
    /// One by which the board is driven no longer than is allowed, all in all: what `settle` takes of that, `hold` has less. A hold that
    /// nobody names is 10 minutes.
    ///
    /// # Errors
    /// Where `hold` alone is longer than `longest`, or `settle` leaves nothing of it.
    pub(super) fn new(settle: Span, hold: Option<Hold>, longest: Hold) -> Result<Self, ToolError> {
        let Hold::For(allowed) = longest else {
            let hold = hold.unwrap_or(Hold::For(USUAL));
            return Ok(Self { settle, hold });
        };
        let asked = match hold {
            None => USUAL,
            Some(Hold::For(asked)) if asked.s <= allowed.s => asked,
            Some(hold) => return Err(ToolError::HoldTooLong { hold, longest }),
        };
        let left = left_to_hold(settle, allowed);
        if left.s <= 0.0 {
            return Err(ToolError::DrivenTooLong {
                settle,
                hold: asked,
                longest,
            });
        }
        if hold.is_some() && left.s < asked.s {
            note(format_args!(
                "held for {left} in place of {asked}: with --settle {settle} that is the longest that this bench allows"
            ));
        }
        let hold = Hold::For(Span {
            s: asked.s.min(left.s),
        });
        Ok(Self { settle, hold })
    }

    /// Makes sure that the board may be driven for as long as it takes to settle and is then held for, position by position.
    ///
    /// # Errors
    /// Where that is longer than `longest`.
    pub(super) fn check_next(settle: Span, longest: Hold) -> Result<(), ToolError> {
        match longest {
            Hold::For(allowed) if left_to_hold(settle, allowed).s < HELD_UNTIL_THE_NEXT.s => {
                Err(ToolError::DrivenTooLong {
                    settle,
                    hold: HELD_UNTIL_THE_NEXT,
                    longest,
                })
            }
            _ => Ok(()),
        }
    }

    /// The lease to ask for: the hold begins when the mirror has settled and been read.
    pub(super) fn lease_ms(&self) -> u32 {
        let Hold::For(hold) = self.hold else {
            return LEASE_FOREVER_MS;
        };
        ((self.settle.s + READING_S + hold.s) * 1e3).round() as u32
    }

    /// What becomes of the drives, as a line for people.
    pub(super) fn line(&self) -> String {
        match self.hold {
            Hold::For(hold) => format!("held for   {hold}, then ramped to zero (see --hold)"),
            Hold::Forever => "held       until told otherwise".to_owned(),
        }
    }

    /// The same within a sentence.
    pub(super) fn words(&self) -> String {
        match self.hold {
            Hold::For(_) => {
                let lease_s = self.lease_ms().div_ceil(1000);
                format!("held for {lease_s} s at most, then ramped to zero")
            }
            Hold::Forever => "held until told otherwise".to_owned(),
        }
    }
}

/// What settling and reading leave of what is allowed, to a millisecond, in which a lease is asked for.
fn left_to_hold(settle: Span, allowed: Span) -> Span {
    let ms = ((allowed.s - settle.s - READING_S) * 1e3).round();
    Span { s: ms / 1e3 }
}

/// A command that drives: it hears Ctrl-C before the board is asked, and says what the board goes on with.
pub(super) struct Move<'a> {
    board: &'a Board,
    pace: Pace,
    /// How often the board had been stopped before.
    stops: u32,
    interrupt: Interrupt,
}

impl<'a> Move<'a> {
    /// From now on Ctrl-C no longer ends the tool by itself. `status` is what the board told before it is asked to move.
    pub(super) fn begin(board: &'a Board, pace: Pace, status: &Status) -> Result<Self, ToolError> {
        let interrupt = Interrupt::listen()?;
        Ok(Self {
            board,
            pace,
            stops: status.stops,
            interrupt,
        })
    }

    /// The answer to `command`. Who interrupts it before it comes is told that the board may have taken the command.
    pub(super) async fn answered(
        &self,
        command: impl Future<Output = Result<Commanded, ToolError>>,
    ) -> Result<Commanded, ToolError> {
        let hold = self.pace.words();
        self.interrupt
            .or_else(command, || ToolError::PerhapsDriven { hold })
            .await
    }

    /// As [`read_settled`], for a command that ends by it, with the board's status afterwards. It ends at once where the board does not
    /// drive what it was asked for any more. Who interrupts it is told that the board drives on.
    pub(super) async fn settle_and_read(
        &self,
        commanded: &Commanded,
    ) -> Result<(Readings, Span, Status), ToolError> {
        let board = self.board;
        let read = async {
            board
                .wait_while(commanded.tick, self.pace.settle, |status| {
                    self.check(status)
                })
                .await?;
            let read = read(board).await;
            let status = board.status().await?;
            self.check(&status)?;
            let (readings, tick) = read?;
            Ok((readings, board.span(commanded.tick, tick), status))
        };
        let hold = self.pace.words();
        self.interrupt
            .or_else(read, || ToolError::StillDriven { hold })
            .await
    }

    /// Whether the board goes on with what it was asked for.
    fn check(&self, status: &Status) -> Result<(), ToolError> {
        if status.stops != self.stops {
            return Err(ToolError::TurnedOff);
        }
        check_states(&status.telemetry.states)?;
        match status.health.lease_left_ms {
            Some(_) => Ok(()),
            None => Err(ToolError::HeldTooShortly {
                hold: self.pace.hold,
            }),
        }
    }
}

/// Lets the mirror settle after `commanded` for at least so long, then reads it. With the readings
/// comes how long it had.
pub(super) async fn read_settled(
    board: &Board,
    commanded: &Commanded,
    settle: Span,
) -> Result<(Readings, Span), ToolError> {
    board.wait(commanded.tick, settle).await?;
    let (readings, tick) = read(board).await?;
    Ok((readings, board.span(commanded.tick, tick)))
}

/// Reads the mirror while it stands. With the readings comes the tick of the first of them.
pub(super) async fn read(board: &Board) -> Result<(Readings, u32), ToolError> {
    let period_ticks = board.period_ticks(READING_PERIOD)?;
    let samples = board.samples(period_ticks, READING_SAMPLES).await?;
    for sample in &samples {
        check_states(&sample.states)?;
    }
    Ok((Readings::mean(&samples), samples[0].tick))
}

/// Whether the board drove on under its lease: it says so until the next command where it did not.
pub(super) fn check_lease(limits: Limits) -> Result<(), ToolError> {
    match limits.contains(Limit::LeaseLapsed) {
        false => Ok(()),
        true => Err(SensorFault::DrivenOtherwise {
            found: "it has ramped to zero, for it heard nothing of this tool in time".to_owned(),
        }
        .into()),
    }
}

/// Says so where somebody has left the mirror to the room, which the board knows.
pub(super) fn note_uncompensated(status: &Status) {
    if status.telemetry.room.is_some() && !status.health.compensates_room {
        note("the room is not compensated; `host-tool room on` has the board compensate it");
    }
}

/// Whether no channel has tripped.
pub(super) fn check_states(states: &[ChannelState; 4]) -> Result<(), ToolError> {
    for (channel, state) in (1..).zip(states) {
        if let ChannelState::Tripped(fault) = *state {
            return Err(ToolError::Tripped { channel, fault });
        }
    }
    Ok(())
}

impl Readings {
    /// The mean of `samples`, of which there is at least one.
    pub(super) fn mean(samples: &[Telemetry]) -> Self {
        let mean = |value: &dyn Fn(&Telemetry) -> Option<f32>| -> Option<f64> {
            let sum: Option<f64> = samples
                .iter()
                .map(|sample| value(sample).map(decimal))
                .sum();
            sum.map(|sum| sum / samples.len() as f64)
        };
        let channels = |value: &dyn Fn(&Telemetry, usize) -> Option<f32>| -> [Option<f64>; 4] {
            std::array::from_fn(|i| mean(&|sample| value(sample, i)))
        };
        let always = |means: [Option<f64>; 4]| means.map(Option::unwrap_or_default);
        Self {
            drive_v: always(channels(&|sample, i| Some(sample.drive_v[i]))),
            current_a: always(channels(&|sample, i| Some(sample.current_a[i]))),
            temperature_rise_k: channels(&|sample, i| sample.temperature_k[i]),
            sensor_z_um: mean_of_those_read(samples),
            limits: samples.iter().fold(Limits::NONE, |limits, sample| {
                limits.union(Limits::from_bits(sample.limits))
            }),
        }
    }
}

/// What a position sensor read, where it did: it may skip a sample.
fn mean_of_those_read(samples: &[Telemetry]) -> Option<f64> {
    let read = samples.iter().filter_map(|sample| sample.sensor_z_um);
    let read: Vec<f64> = read.filter(|um| um.is_finite()).map(decimal).collect();
    (!read.is_empty()).then(|| read.iter().sum::<f64>() / read.len() as f64)
}

impl fmt::Display for Readings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "drives     {}", row(self.drive_v, 3, "V"))?;
        writeln!(
            f,
            "currents   {}",
            row(self.current_a.map(|i| i * 1e3), 3, "mA")
        )?;
        writeln!(
            f,
            "temp. rise {}",
            row_of_known(self.temperature_rise_k, 1, "K")
        )
    }
}

#[cfg(test)]
mod tests {
    use miette::Diagnostic;

    use super::*;

    #[test]
    fn no_lease_is_longer_than_is_allowed() {
        let span = |s| Span { s };
        for (settle_s, hold_s, longest_s, lease_ms) in [
            (1.0, None, 600.0, Some(600_000)),
            (1.0, None, 3600.0, Some(601_200)),
            (1.0, Some(598.8), 600.0, Some(600_000)),
            (1.0, Some(600.0), 600.0, Some(600_000)),
            (1.0, Some(600.1), 600.0, None),
            (4.0, Some(2.0), 10.0, Some(6_200)),
            (599.9, None, 600.0, None),
            (7200.0, Some(5.0), 10.0, None),
        ] {
            let hold = hold_s.map(|s| Hold::For(span(s)));
            let pace = Pace::new(span(settle_s), hold, Hold::For(span(longest_s)));
            assert_eq!(
                pace.ok().map(|pace| pace.lease_ms()),
                lease_ms,
                "{settle_s} s and {hold_s:?} s of {longest_s} s"
            );
        }
        let forever = Pace::new(span(1.0), Some(Hold::Forever), Hold::Forever);
        assert_eq!(forever.expect("allowed").lease_ms(), LEASE_FOREVER_MS);
    }

    #[test]
    fn a_hold_that_was_too_short_is_to_be_longer() {
        for (asked_s, help) in [
            (0.0, "--hold 10s"),
            (1.0, "--hold 10s"),
            (20.0, "--hold 40s"),
        ] {
            let hold = Hold::For(Span { s: asked_s });
            let error = ToolError::HeldTooShortly { hold };
            let said = error.help().expect("what to do").to_string();
            assert!(said.ends_with(help), "{said}");
        }
    }

    #[test]
    fn a_sensor_that_skips_a_sample_is_read_by_the_others() {
        let sample = |sensor_z_um| Telemetry {
            sensor_z_um,
            ..Telemetry::default()
        };
        let z_um = |read: &[Option<f32>]| {
            let samples: Vec<Telemetry> = read.iter().copied().map(sample).collect();
            Readings::mean(&samples).sensor_z_um
        };
        assert_eq!(
            z_um(&[Some(10.0), None, Some(20.0), Some(f32::NAN)]),
            Some(15.0)
        );
        assert_eq!(z_um(&[None, None]), None);
    }
}
