//! Where displacements come from: the board's own sensor input, a serial sensor, or a recording.

use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use measurement::MeasurementFile;
use tokio::time::sleep;

use super::serial::{self, Arriving};
use crate::error::ToolError;

/// A position sensor.
pub(crate) enum Sensor {
    /// The board's, which comes with every sample.
    Board,
    /// Lines of micrometres, as they arrive.
    Serial {
        path: PathBuf,
        arriving: Arriving,
        began: Option<Instant>,
    },
    /// Lines of seconds and micrometres, written by something else while the experiment runs.
    Recording { path: PathBuf, began: bool },
}

/// A serial sensor that is asked for its reading now tells the mean of so many, and is given up after so long a silence.
const READINGS: usize = 20;
const SILENCE: Duration = Duration::from_secs(5);

/// What a user calls the board's own sensor.
const BOARD: &str = "board";

impl Sensor {
    /// The sensor that a user names: `board`, a serial device with its speed if it has one, or a file.
    pub(crate) fn open(name: &str) -> Result<Self, ToolError> {
        if name == BOARD {
            return Ok(Self::Board);
        }
        let (path, baud) = match name.rsplit_once('@') {
            Some((path, baud)) if !Path::new(name).exists() => (path, Some(baud)),
            _ => (name, None),
        };
        let path = PathBuf::from(path);
        let kind = fs::metadata(&path).map(|metadata| metadata.file_type());
        if !kind.is_ok_and(|kind| kind.is_char_device() || kind.is_fifo()) {
            let path = PathBuf::from(name);
            return Ok(Self::Recording { path, began: false });
        }
        let baud = baud.map(str::parse).transpose();
        let baud = baud.map_err(|_| cannot_read(&path, "its speed is no number of baud"))?;
        let device = serial::device(&path, baud).map_err(|error| cannot_read(&path, error))?;
        Ok(Self::Serial {
            path,
            arriving: serial::listen(device, Instant::now),
            began: None,
        })
    }

    /// What a serial sensor reads from now on, the mean of some readings (um); `None` of one whose readings come otherwise.
    pub(super) async fn read_now(&self) -> Result<Option<f64>, ToolError> {
        let Self::Serial { path, arriving, .. } = self else {
            return Ok(None);
        };
        // What came before is of another place.
        while arriving.try_recv().is_ok() {}
        let (mut sum_um, mut count) = (0.0, 0);
        let mut last = Instant::now();
        while count < READINGS {
            match arriving.try_recv() {
                Ok((now, um)) => {
                    sum_um += um;
                    count += 1;
                    last = now;
                }
                Err(_) if last.elapsed() > SILENCE => {
                    return Err(cannot_read(path, "it sent no number"));
                }
                Err(_) => sleep(Duration::from_millis(5)).await,
            }
        }
        Ok(Some(sum_um / READINGS as f64))
    }

    /// A waveform begins now; the first one is the experiment's time 0.
    pub(super) fn begin(&mut self) {
        match self {
            Self::Board => {}
            Self::Serial { began, .. } => {
                began.get_or_insert_with(Instant::now);
            }
            Self::Recording { began, .. } => *began = true,
        }
    }

    /// Puts what was sensed into the rows, counted from the reading at time 0. The next experiment
    /// begins anew.
    pub(super) fn read_into(&mut self, file: &mut MeasurementFile) -> Result<(), ToolError> {
        let (path, readings) = match self {
            Self::Board => return Ok(()),
            Self::Serial {
                path,
                arriving,
                began,
            } => {
                let Some(start) = began.take() else {
                    return Ok(());
                };
                let since = |now: Instant| {
                    if now >= start {
                        (now - start).as_secs_f64()
                    } else {
                        -(start - now).as_secs_f64()
                    }
                };
                let readings = arriving.try_iter().map(|(now, um)| (since(now), um));
                (path, readings.collect())
            }
            Self::Recording { began: false, .. } => return Ok(()),
            Self::Recording { path, began } => {
                *began = false;
                let text = fs::read_to_string(&*path).map_err(|error| cannot_read(path, error))?;
                let readings = parse(&text).map_err(|reason| cannot_read(path, reason))?;
                (path, readings)
            }
        };
        if readings.is_empty() {
            return Err(cannot_read(path, "it sent no number"));
        }
        merge(&readings, file);
        Ok(())
    }
}

pub(super) fn cannot_read(path: &Path, reason: impl ToString) -> ToolError {
    ToolError::Sensor {
        path: path.to_owned(),
        reason: reason.to_string(),
    }
}

pub(super) fn finite(text: &str) -> Option<f64> {
    text.trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite())
}

/// Seconds and micrometres of a text with a line for each, in the order of time. Comments and a header are passed over.
pub(crate) fn parse(text: &str) -> Result<Vec<(f64, f64)>, String> {
    let mut readings: Vec<(f64, f64)> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let pair = line
            .split_once(',')
            .and_then(|(t, z)| Some((finite(t)?, finite(z)?)));
        match (pair, readings.last()) {
            (Some((t_s, _)), Some((before_s, _))) if t_s <= *before_s => {
                return Err(format!("line {number} is not later than the one before"));
            }
            (Some(pair), _) => readings.push(pair),
            (None, None) if line.starts_with(|c: char| c.is_ascii_alphabetic()) => {}
            (None, _) => return Err(format!("line {number}, `{line}`, is not two numbers")),
        }
    }
    Ok(readings)
}

/// Gives each row the displacement at its time, on a straight line between two readings; rows outside
/// the readings stay without.
pub(super) fn merge(readings: &[(f64, f64)], file: &mut MeasurementFile) {
    let at = |t_s: f64| {
        let after = readings.partition_point(|(t, _)| *t < t_s);
        let (t1, z1) = *readings.get(after)?;
        if t1 == t_s {
            return Some(z1);
        }
        let (t0, z0) = *readings.get(after.checked_sub(1)?)?;
        Some(z0 + (t_s - t0) / (t1 - t0) * (z1 - z0))
    };
    let zero = at(0.0).unwrap_or(readings[0].1);
    let Some(first) = file.rows.first().copied() else {
        return;
    };
    for row in &mut file.rows {
        // Rests between waveforms count for the sensor.
        let elapsed_s = match (row.t_global_s, first.t_global_s) {
            (Some(now), Some(first_s)) => first.t_s + now - first_s,
            _ => row.t_s,
        };
        row.z_um = at(elapsed_s).map(|z| z - zero);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::Row;
    use proptest::prelude::*;

    fn file(times: &[f64]) -> MeasurementFile {
        MeasurementFile {
            rows: times
                .iter()
                .map(|&t_s| Row {
                    t_s,
                    ..Row::default()
                })
                .collect(),
            ..MeasurementFile::default()
        }
    }

    #[test]
    fn rows_lie_on_lines_between_readings_and_count_from_the_first() {
        let readings = parse("# a recording\nt_s,z_um\n0,5\n1,7\n3,11\n").unwrap();
        let mut file = file(&[0.5, 1.0, 2.0, 3.5]);
        merge(&readings, &mut file);
        let z: Vec<_> = file.rows.iter().map(|row| row.z_um).collect();
        assert_eq!(z, [Some(1.0), Some(2.0), Some(4.0), None]);
    }

    #[test]
    fn a_serial_sensor_is_read_from_now_on() {
        let (send, arriving) = std::sync::mpsc::channel();
        let sensor = Sensor::Serial {
            path: PathBuf::from("laser"),
            arriving,
            began: None,
        };
        let tell = |um: f64| send.send((Instant::now(), um)).expect("it listens");
        // From before the spot was moved.
        tell(1e6);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .build()
            .expect("a runtime");
        let (read, ()) = runtime.block_on(async {
            tokio::join!(sensor.read_now(), async {
                for i in 0..READINGS {
                    tell(i as f64);
                }
            })
        });
        let mean = (READINGS - 1) as f64 / 2.0;
        assert_eq!(read.expect("it was told"), Some(mean));
        let none = runtime.block_on(Sensor::Board.read_now());
        assert_eq!(none.expect("not asked"), None);
    }

    #[test]
    fn a_speed_that_is_none_is_told() {
        let said = Sensor::open("/dev/null@fast").err().expect("no speed");
        let said = said.to_string();
        assert!(
            said.contains("/dev/null") && said.contains("its speed is no number of baud"),
            "{said}"
        );
    }

    #[test]
    fn a_recording_that_is_none_is_told_by_its_line() {
        for (text, line) in [
            ("0,1\n1\n", "line 2, `1`"),
            ("0,1\n1,nan\n", "line 2, `1,nan`"),
            ("0,1\n0,2\n", "line 2 is not later"),
            ("t,z\n0,1\nx,y\n", "line 3, `x,y`"),
        ] {
            let said = parse(text).unwrap_err();
            assert!(said.starts_with(line), "{said}");
        }
    }

    proptest! {
        #[test]
        fn what_was_recorded_comes_back_at_its_times(
            z in proptest::collection::vec(-100.0_f64..100.0, 2..50),
        ) {
            let text: String = z.iter().enumerate().map(|(i, z)| format!("{i},{z:?}\n")).collect();
            let times: Vec<f64> = (0..z.len()).map(|i| i as f64).collect();
            let mut file = file(&times);
            merge(&parse(&text).unwrap(), &mut file);
            for (row, z_um) in file.rows.iter().zip(&z) {
                prop_assert!((row.z_um.unwrap() - (z_um - z[0])).abs() < 1e-9);
            }
        }

        #[test]
        fn any_text_is_readings_or_a_sentence(text in "[0-9a-z,.\\n# -]{0,60}") {
            let _ = parse(&text);
        }
    }
}
