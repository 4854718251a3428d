//! `record`: a measurement file of what the board reads while it goes on with what it does, for as long as it was
//! told to by whoever told it.

use std::fmt;
use std::io;
use std::path::PathBuf;

use indicatif::ProgressStyle;
use measurement::{Keys, Row};
use mirror_protocol::{ChannelState, Identity, Telemetry};
use quantities::Span;
use serde::Serialize;

use crate::board::{Board, Samples};
use crate::commands::interrupt::Interrupt;
use crate::commands::measure::run::{Ended, partial};
use crate::commands::moving::check_states;
use crate::commands::uncertainty::Uncertainty;
use crate::error::{BeyondBoard, OutputError, ToolError};
use crate::new_file::NewFile;
use crate::recording::{Recording, Rows};
use crate::report::{self, counted, decimal};
use crate::system::standard_output;
use crate::verbosity::note;
use crate::working::bar;

#[derive(Serialize)]
struct RecordReport {
    file: PathBuf,
    samples: usize,
    /// Those that the link was too slow for.
    lost: usize,
    duration_s: f64,
    /// Whether somebody stopped the board meanwhile.
    stopped: bool,
}

/// Records into `file`, or to the standard output where there is none.
pub(super) async fn run(
    board: &Board,
    file: Option<NewFile>,
    duration: Span,
    period: Span,
    json: bool,
) -> Result<(), ToolError> {
    let interrupt = Interrupt::listen()?;
    let period_ticks = board.period_ticks(period)?;
    let period = board.span(0, period_ticks.into());
    let asked = (duration.s / period.s).round().max(1.0);
    if asked > f64::from(u32::MAX) {
        return Err(BeyondBoard::TooManySamples { asked }.into());
    }
    let expected = asked as u32;
    let stops = board.status().await?.stops;
    let is_piped = file.is_none();
    let mut stream = board.stream(period_ticks, expected).await?;
    let recorder = match file {
        Some(file) => Recorder::begin(board.identity(), file),
        None => Recorder::to_standard_output(board.identity()),
    };
    let mut recorder = match recorder {
        Ok(recorder) => recorder,
        Err(unwritten) => {
            // As below: it would send on to nobody.
            let _ = board.stop_stream().await;
            return Err(unwritten.into());
        }
    };
    let collected = collect(&mut stream, expected, &mut recorder, json);
    let mut ended = match interrupt.or(collected).await {
        Err(ToolError::Interrupted) => board.stop_stream().await.map(|()| Ended::Interrupted),
        collected => collected.map(|()| Ended::Complete),
    };
    let (samples, duration_s) = (recorder.samples, recorder.last_s);
    if let Err(ToolError::Output(unwritten)) = &ended {
        // The board would send on to nobody; the reason to stop is told in any case.
        let _ = board.stop_stream().await;
        return match unwritten {
            OutputError::CutShort { source, .. }
                if is_piped && source.kind() == io::ErrorKind::BrokenPipe =>
            {
                Ok(())
            }
            _ => ended.map(drop),
        };
    }
    if let Err(ToolError::Tripped { .. }) = ended {
        // It would send on to nobody; the fault is what is told in any case.
        let _ = board.stop_stream().await;
    }
    let (mut stopped, lost) = (false, (expected as usize).saturating_sub(samples));
    let is_short =
        lost > 0 && matches!(ended, Ok(Ended::Complete) | Err(ToolError::NoAnswer { .. }));
    match board.status().await {
        Ok(status) => {
            stopped = status.stops != stops;
            // The board is well, so what is missing was lost on the way.
            if is_short {
                ended = Err(ToolError::SamplesLost {
                    received: samples,
                    expected: expected as usize,
                });
            }
        }
        Err(error) if is_short => ended = Err(error),
        Err(_) => {}
    }
    let recorded = RecordReport {
        file: recorder.finish(partial(&ended).as_deref())?,
        samples,
        lost: if is_short { lost } else { 0 },
        duration_s,
        stopped,
    };
    match is_piped {
        true => note(recorded.to_string().trim_end()),
        false => report::print(&recorded, json),
    }
    match ended? {
        Ended::Complete => Ok(()),
        // It drives nothing itself: the board goes on with what it does.
        Ended::Interrupted => Err(ToolError::RecordingInterrupted),
    }
}

/// Whether a file is there still is looked at so often (s of the board's time), and at its end.
const LOOK_S: f64 = 1.0;

/// What the standard output is called where a file's name would stand.
const STANDARD_OUTPUT: &str = "standard output";

/// Where rows go.
#[derive(Debug)]
enum Sink {
    File(Recording),
    StandardOutput(Rows),
}

/// Samples on their way into a measurement file.
#[derive(Debug)]
pub(super) struct Recorder {
    sink: Sink,
    tick_hz: u32,
    first_tick: Option<u32>,
    pub(super) samples: usize,
    /// Time of the last sample.
    last_s: f64,
    /// When the file was last seen to be there.
    seen_s: f64,
}

impl Recorder {
    /// Gives the file its name and its beginning.
    pub(super) fn begin(identity: &Identity, file: NewFile) -> Result<Self, OutputError> {
        let recording = Recording::begin(file, &keys(identity), &like())?;
        Ok(Self::of(Sink::File(recording), identity))
    }

    fn to_standard_output(identity: &Identity) -> Result<Self, OutputError> {
        let output = standard_output();
        let rows = output.and_then(|output| Rows::begin(output, &keys(identity), &like()));
        let rows = rows.map_err(|source| cut_short(0, source))?;
        Ok(Self::of(Sink::StandardOutput(rows), identity))
    }

    fn of(sink: Sink, identity: &Identity) -> Self {
        Self {
            sink,
            tick_hz: identity.tick_hz,
            first_tick: None,
            samples: 0,
            last_s: 0.0,
            seen_s: 0.0,
        }
    }

    /// Ends the file; `partial` says why it is not whole.
    pub(super) fn finish(self, partial: Option<&str>) -> Result<PathBuf, OutputError> {
        match self.sink {
            Sink::File(recording) => recording.finish(partial),
            Sink::StandardOutput(rows) => {
                let safe = rows.safe();
                let finished = rows.finish(partial);
                finished.map_err(|source| cut_short(safe, source))?;
                Ok(STANDARD_OUTPUT.into())
            }
        }
    }

    pub(super) fn append(&mut self, sample: &Telemetry) -> Result<(), OutputError> {
        let first = *self.first_tick.get_or_insert(sample.tick);
        let row = row(sample, sample.tick.wrapping_sub(first), self.tick_hz);
        match &mut self.sink {
            Sink::File(recording) => {
                recording.append(&row)?;
                if row.t_s - self.seen_s >= LOOK_S {
                    recording.stays()?;
                    self.seen_s = row.t_s;
                }
            }
            Sink::StandardOutput(rows) => {
                let appended = rows.append(&row);
                appended.map_err(|source| cut_short(rows.safe(), source))?;
            }
        }
        self.samples += 1;
        self.last_s = row.t_s;
        Ok(())
    }
}

fn cut_short(rows: usize, source: io::Error) -> OutputError {
    OutputError::CutShort {
        path: STANDARD_OUTPUT.into(),
        rows,
        source,
    }
}

/// A row with all that one may have: a sensor that is lost now may be found again.
fn like() -> Row {
    Row {
        current_a: [Some(0.0); 4],
        z_um: Some(0.0),
        asked_um: Some(0.0),
        asked_tilt_x_deg: Some(0.0),
        asked_tilt_y_deg: Some(0.0),
        trigger: Some(0),
        uncertainty_um: Some(0.0),
        ..Row::default()
    }
}

/// Samples until there are enough; those that arrived are kept whatever happens.
async fn collect(
    stream: &mut Samples,
    expected: u32,
    recorder: &mut Recorder,
    quiet: bool,
) -> Result<(), ToolError> {
    let bar = bar(expected.into(), quiet);
    let style =
        ProgressStyle::with_template("recording {wide_bar} {pos}/{len} samples, {eta} left");
    bar.set_style(style.expect("a fixed template"));
    let mut is_sound = false;
    while let Some(sample) = stream.next_of_all().await? {
        recorder.append(&sample)?;
        bar.inc(1);
        if is_sound {
            check_states(&sample.states)?;
        }
        // One that has tripped before goes on as it is.
        is_sound = !has_tripped(&sample);
    }
    bar.finish_and_clear();
    Ok(())
}

fn has_tripped(sample: &Telemetry) -> bool {
    let tripped = |state: &ChannelState| matches!(state, ChannelState::Tripped(_));
    sample.states.iter().any(tripped)
}

fn keys(identity: &Identity) -> Keys {
    let mut keys = Keys::default();
    keys.set("experiment", "record");
    keys.set("device", &identity.board);
    keys
}

fn row(sample: &Telemetry, ticks: u32, tick_hz: u32) -> Row {
    let tilts_rad = sample.pose.tilt_rad;
    let tilt_deg = |axis: usize| tilts_rad.map(|rad| decimal(rad[axis]).to_degrees());
    Row {
        t_s: f64::from(ticks) / f64::from(tick_hz),
        voltage_v: sample.drive_v.map(decimal),
        current_a: sample.current_a.map(|current| Some(decimal(current))),
        z_um: sample.sensor_z_um.map(decimal),
        asked_um: Some(decimal(sample.pose.z_um)),
        asked_tilt_x_deg: tilt_deg(0),
        asked_tilt_y_deg: tilt_deg(1),
        trigger: Some(sample.trigger.bits()),
        uncertainty_um: Uncertainty::from(sample).z_um,
        ..Row::default()
    }
}

impl fmt::Display for RecordReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "recorded   {} of {} s in {}",
            counted(self.samples, "sample"),
            self.duration_s,
            self.file.display()
        )?;
        if self.lost > 0 {
            let besides = if self.stopped {
                ", which carried the stop besides"
            } else {
                ""
            };
            let lost = counted(self.lost, "sample");
            writeln!(
                f,
                "lost       {lost}, too many for the link{besides}; each row has its own sample's time"
            )?;
        }
        match self.stopped {
            true => writeln!(
                f,
                "stopped    the board was turned off by `host-tool off` meanwhile"
            ),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_link_lost_is_told() {
        let mut report = RecordReport {
            file: "r.csv".into(),
            samples: 1,
            lost: 0,
            duration_s: 0.0,
            stopped: false,
        };
        assert_eq!(report.to_string(), "recorded   1 sample of 0 s in r.csv\n");
        (report.samples, report.lost, report.stopped) = (19_990, 10, true);
        let lost = "lost       10 samples, too many for the link, which carried the stop besides; each row";
        assert!(report.to_string().contains(lost), "{report}");
        (report.lost, report.stopped) = (1, false);
        let lost = "lost       1 sample, too many for the link; each row";
        assert!(report.to_string().contains(lost), "{report}");
    }
}
