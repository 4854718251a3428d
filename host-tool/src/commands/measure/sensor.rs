//! Where displacements come from: the board's own sensor input, a serial sensor, or a recording.

use std::fs;
use std::path::{Path, PathBuf};

use measurement::MeasurementFile;
use quantities::Span;

use super::readings::{Impossible, LONGEST_UM, is_possible, merge, recorded};
use super::serial::{Serial, cannot_read};
use crate::board::Board;
use crate::commands::moving::read;
use crate::error::{SensorFault, ToolError};
use crate::names::nearest;
use crate::system::{is_device, serial_device};
use crate::verbosity::note;

/// A position sensor.
pub(crate) enum Sensor {
    /// The board's, which comes with every sample.
    Board,
    /// Lines of micrometres, as they arrive.
    Serial(Serial),
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

/// Makes sure that the whole lines of a recording that is there already can be read. The last one may be on its way.
fn check_recording(path: &Path) -> Result<(), ToolError> {
    let text = input_file::read_text(path, input_file::MOST_MADE)?;
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let read = recorded(whole).map_err(|reason| cannot_read(path, reason));
    read.map(drop)
}

/// What a user calls the board's own sensor.
const BOARD: &str = "board";

impl Sensor {
    /// The sensor that a user names: `board`, a serial device with its speed if it has one, or a file.
    pub(crate) fn open(name: &str) -> Result<Self, ToolError> {
        let sensor = Self::named(name)?;
        if let Self::Recording { path, .. } = &sensor {
            match path.exists() {
                true => check_recording(path)?,
                false => note(format_args!(
                    "{name} is not there yet; it is read once the measurement is done"
                )),
            }
        }
        Ok(sensor)
    }

    fn named(name: &str) -> Result<Self, ToolError> {
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
            return Ok(Self::Recording { path, began: false });
        }
        let baud = baud.map(str::parse).transpose();
        let baud = baud.map_err(|_| cannot_read(&path, "its speed is no number of baud"))?;
        let device = serial_device(&path, baud).map_err(|error| cannot_read(&path, error))?;
        Ok(Self::Serial(Serial::on(path, device)))
    }

    /// The sensor that a user names, where it can be asked at any time.
    ///
    /// # Errors
    /// Where it cannot, as a recording.
    pub(crate) fn open_live(name: &str) -> Result<Self, ToolError> {
        match Self::named(name)? {
            Self::Recording { path, .. } => {
                let reason = match path.exists() {
                    true => "it is a file",
                    false => "there is no such device",
                };
                Err(SensorFault::NotAtAnyTime { path, reason }.into())
            }
            sensor => Ok(sensor),
        }
    }

    /// The same, where it is there.
    ///
    /// # Errors
    /// Where it is not, or the board does not answer.
    pub(crate) async fn at_any_time(board: &Board, name: &str) -> Result<Self, ToolError> {
        let sensor = Self::open_live(name)?;
        match sensor.is_there(board).await? {
            true => Ok(sensor),
            false => Err(SensorFault::NoSensor.into()),
        }
    }

    /// Whether there is one, which sends what can be read: a single reading that the board's input skips is no reason to say that nothing is
    /// connected to it.
    ///
    /// # Errors
    /// Where the board does not answer, or a serial sensor sends what is no reading.
    pub(crate) async fn is_there(&self, board: &Board) -> Result<bool, ToolError> {
        match self {
            Self::Board => Ok(read(board).await?.0.sensor_z_um.is_some()),
            Self::Serial(serial) => serial.is_heard().await.map(|()| true),
            Self::Recording { .. } => Ok(true),
        }
    }

    /// What a serial sensor reads from now on, the mean of some readings (um); `None` of one whose readings come otherwise.
    pub(crate) async fn read_now(&self) -> Result<Option<f64>, ToolError> {
        match self {
            Self::Serial(serial) => serial.read_now().await.map(Some),
            Self::Board | Self::Recording { .. } => Ok(None),
        }
    }

    /// A waveform begins now; the first one is the experiment's time 0.
    pub(super) fn begin(&mut self) {
        match self {
            Self::Board => {}
            Self::Serial(serial) => serial.begin(),
            Self::Recording { began, .. } => *began = true,
        }
    }

    /// The scatter of a serial sensor as the mirror rests now, where it tells it (um).
    pub(super) fn noise_at_rest_um(&mut self) -> Option<f64> {
        match self {
            Self::Serial(serial) => serial.noise_um(),
            Self::Board | Self::Recording { .. } => None,
        }
    }

    /// Hears a serial sensor that is so late on until it has told what it reads now, or is silent.
    pub(super) async fn hear_on(&mut self, lag: Span) {
        if let Self::Serial(serial) = self {
            serial.hear_on(lag).await;
        }
    }

    /// Puts what a sensor that is so late has sensed into the rows, counted from the reading at time 0, and tells which of its numbers
    /// are no readings. The next experiment begins anew.
    pub(super) fn read_into(
        &mut self,
        lag: Span,
        file: &mut MeasurementFile,
    ) -> Result<Impossible, ToolError> {
        let (path, readings): (_, Vec<_>) = match self {
            Self::Board => return Ok(Impossible::out_of(file)),
            Self::Serial(serial) => match serial.take() {
                Some(readings) => (&serial.path, readings),
                None => return Ok(Impossible::NONE),
            },
            Self::Recording { began: false, .. } => return Ok(Impossible::NONE),
            Self::Recording { path, began } => {
                *began = false;
                let text = input_file::read_text(path, input_file::MOST_MADE)?;
                let readings = recorded(&text).map_err(|reason| cannot_read(path, reason))?;
                (path, readings)
            }
        };
        let (told, impossible) = (readings.len(), Impossible::among(&readings));
        let possible = readings.into_iter().filter(|(_, um)| is_possible(*um));
        let readings: Vec<_> = possible.map(|(t_s, um)| (t_s - lag.s, um)).collect();
        match (readings.len(), told) {
            (0, 0) => return Err(cannot_read(path, "it sent no number")),
            (0, _) => {
                let reason = format!(
                    "all numbers that it sent are beyond {LONGEST_UM} um, up to {:.0}: does it count in nm?",
                    impossible.largest_um
                );
                return Err(cannot_read(path, reason));
            }
            _ => {}
        }
        merge(&readings, file);
        if lag.s > 0.0 {
            file.keys.set("sensor_lag_s", &lag.s.to_string());
        }
        Ok(impossible)
    }
}

/// What is to be said of so many numbers that are no readings.
pub(super) fn impossible_words(numbers: usize) -> String {
    format!(
        "{numbers} numbers of the sensor are beyond {LONGEST_UM} um, which no mirror reaches, and count as missing: has it lost the mirror, or \
         does it count in nm?"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::Row;
    use std::sync::mpsc::channel;
    use std::time::{Duration, Instant};

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

    /// A calibration plays many experiments, each of which begins at a time of its own.
    #[test]
    fn what_cannot_be_asked_at_any_time_is_refused_before_anything_is_driven() {
        let folder = tempfile::tempdir().expect("a folder");
        let recording = folder.path().join("readings.csv");
        fs::write(&recording, "0,1\n").expect("written");
        for (name, told) in [
            ("s_notthere", "there is no such device"),
            (&*recording.to_string_lossy(), "it is a file"),
        ] {
            let said = Sensor::open_live(name).err().expect("refused").to_string();
            assert!(
                said.contains(told) && said.contains("at any time"),
                "{said}"
            );
        }
        assert!(matches!(Sensor::open_live("board"), Ok(Sensor::Board)));
    }

    /// Rows 0.1 s apart.
    fn rows(count: u32) -> MeasurementFile {
        let row = |index| Row {
            t_s: 0.1 * f64::from(index),
            ..Row::default()
        };
        MeasurementFile {
            rows: (0..count).map(row).collect(),
            ..MeasurementFile::default()
        }
    }

    #[test]
    fn what_a_late_sensor_tells_is_of_before_and_what_no_mirror_reaches_is_missing() {
        let (send, arriving) = channel();
        let mut sensor = Sensor::Serial(Serial::at("laser".into(), arriving));
        sensor.begin();
        let start = Instant::now();
        let tell = |t_s: f64, um| {
            let at = start + Duration::from_secs_f64(t_s);
            send.send((at, um)).expect("it listens");
        };
        // 200 ms late of a mirror that moves by 10 um a second.
        (0..60).for_each(|index| tell(0.01 * f64::from(index), 0.1 * f64::from(index - 20)));
        for um in [9.91e37, -1e30, 12_500.0] {
            tell(0.7, um);
        }
        let mut file = rows(5);
        let lag = Span { s: 0.2 };
        let impossible = sensor.read_into(lag, &mut file).expect("readings");
        assert_eq!(impossible.numbers, 3);
        for row in &file.rows[..4] {
            let z_um = row.z_um.expect("it was told");
            // The rows begin a moment before `start`.
            assert!((z_um - 10.0 * row.t_s).abs() < 0.1, "{z_um} at {}", row.t_s);
        }
        assert_eq!(file.rows[4].z_um, None);
        assert_eq!(file.keys.get("sensor_lag_s"), Some("0.2"));

        sensor.begin();
        tell(1.0, 9.91e37);
        let said = sensor.read_into(lag, &mut file).expect_err("no reading");
        let said = said.to_string();
        assert!(said.contains("beyond 10000 um"), "{said}");
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
