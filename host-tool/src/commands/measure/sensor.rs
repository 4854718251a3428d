//! Where displacements come from: the board's own sensor input, a serial sensor, or a recording.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use measurement::MeasurementFile;
use tokio::time::sleep;

use super::readings::{merge, recorded};
use super::serial::{self, Arriving};
use crate::board::Board;
use crate::commands::moving::read;
use crate::error::ToolError;
use crate::names::nearest;
use crate::system::{is_device, serial_device};
use crate::verbosity::note;

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

/// Where serial devices are, which are there before anything is measured or not at all.
const DEVICES: &str = "/dev/";

/// Why no recording will ever have this name: what is a device's, a folder's or a misspelt one's.
fn never_a_recording(name: &str, has_speed: bool) -> Option<String> {
    let path = Path::new(name);
    if path.is_dir() {
        return Some("it is a folder".to_owned());
    }
    if path.exists() {
        return None;
    }
    if path.starts_with(DEVICES) || has_speed {
        return Some("there is no such device; is it plugged in?".to_owned());
    }
    let near = nearest(name, [BOARD]).filter(|_| path.extension().is_none());
    near.map(|name| format!("there is no such file; did you mean `{name}`?"))
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
        if !kind.is_ok_and(is_device) {
            if let Some(reason) = never_a_recording(name, baud.is_some()) {
                return Err(cannot_read(Path::new(name), reason));
            }
            let path = PathBuf::from(name);
            if !path.exists() {
                note(format_args!(
                    "{name} is not there yet; it is read once the measurement is done"
                ));
            }
            return Ok(Self::Recording { path, began: false });
        }
        let baud = baud.map(str::parse).transpose();
        let baud = baud.map_err(|_| cannot_read(&path, "its speed is no number of baud"))?;
        let device = serial_device(&path, baud).map_err(|error| cannot_read(&path, error))?;
        Ok(Self::Serial {
            path,
            arriving: serial::listen(device, Instant::now),
            began: None,
        })
    }

    /// The sensor that a user names, where it is there and answers at any time.
    ///
    /// # Errors
    /// Where it does not, or the board does not answer.
    pub(crate) async fn at_any_time(board: &Board, name: &str) -> Result<Self, ToolError> {
        let sensor = Self::open(name)?;
        if let Self::Recording { path, .. } = &sensor {
            let reason = "it is asked at every point, which a recording cannot answer";
            return Err(cannot_read(path, reason));
        }
        match sensor.is_there(board).await? {
            true => Ok(sensor),
            false => Err(ToolError::NoSensor),
        }
    }

    /// Whether there is one: a single reading that the board's input skips is no reason to say that nothing is connected to it.
    ///
    /// # Errors
    /// Where the board does not answer.
    pub(crate) async fn is_there(&self, board: &Board) -> Result<bool, ToolError> {
        match self {
            Self::Board => Ok(read(board).await?.0.sensor_z_um.is_some()),
            Self::Serial { .. } | Self::Recording { .. } => Ok(true),
        }
    }

    /// What a serial sensor reads from now on, the mean of some readings (um); `None` of one whose readings come otherwise.
    pub(crate) async fn read_now(&self) -> Result<Option<f64>, ToolError> {
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
                let text = input_file::read_text(path, input_file::MOST_MADE)?;
                let readings = recorded(&text).map_err(|reason| cannot_read(path, reason))?;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A measurement takes minutes, and nothing would be read at its end.
    #[test]
    fn what_will_be_no_recording_is_refused_before_anything_is_measured() {
        let folder = tempfile::tempdir().expect("a folder");
        let of_a_name = folder.path().to_string_lossy();
        for (name, told) in [
            ("/dev/ttyMISSING0", "no such device"),
            ("/dev/ttyMISSING0@115200", "no such device"),
            ("laser@115200", "no such device"),
            (&*of_a_name, "it is a folder"),
            ("bord", "did you mean `board`?"),
        ] {
            let said = Sensor::open(name).err().expect("refused").to_string();
            assert!(said.contains(told), "{name}: {said}");
        }
        for later in ["readings.csv", "to/come", "blackboard.csv"] {
            assert!(Sensor::open(later).is_ok(), "{later}");
        }
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
}
