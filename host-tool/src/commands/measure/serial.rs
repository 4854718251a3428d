//! A serial sensor: lines of micrometres, each with the time at which it arrived.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use quantities::Span;
use tokio::time::sleep;

use super::readings::{LONGEST_UM, is_none, is_possible, micrometres};
use super::rest::noise_um;
use crate::error::{SensorFault, ToolError};

/// The longest line of a sensor (bytes): a number takes twenty, and what is longer is passed over.
const MOST_OF_A_LINE: u64 = 1024;

/// Readings as they arrive (um).
pub(super) type Arriving = Receiver<(Instant, f64)>;

/// So many lines without a number among them are not what a sensor says only as it is switched on.
const UNREAD_LINES: usize = 5;
/// So much of such a line is told (characters).
const TOLD_OF_A_LINE: usize = 40;

/// One that is asked for its reading now tells the mean of so many, and is given up after so long a silence.
const READINGS: usize = 20;
const SILENCE: Duration = Duration::from_secs(5);
const LOOK: Duration = Duration::from_millis(5);
/// The clocks of a board and of this machine go apart by so much in eight minutes (100 ppm).
const CLOCKS: Duration = Duration::from_millis(50);
/// Its noise is that of so many readings at rest at most: of the last seconds, in which the mirror hardly moves any more.
const NOISE_READINGS: usize = 100;

/// A serial sensor, and what has been heard of it since the experiment before.
pub(crate) struct Serial {
    pub(super) path: PathBuf,
    arriving: Arriving,
    /// Lines that are no numbers.
    unread: Receiver<String>,
    heard: Vec<(Instant, f64)>,
    /// Time 0 of the experiment.
    began: Option<Instant>,
}

impl Serial {
    /// The sensor on a device, which is listened to from now on.
    pub(super) fn on(path: PathBuf, device: File) -> Self {
        let (send, unread) = channel();
        let arriving = listen(device, Instant::now, send);
        Self {
            unread,
            ..Self::at(path, arriving)
        }
    }

    pub(super) fn at(path: PathBuf, arriving: Arriving) -> Self {
        Self {
            path,
            arriving,
            unread: channel().1,
            heard: Vec::new(),
            began: None,
        }
    }

    /// Makes sure that what it sends can be read: a number comes, or a line by which it says that it has none now.
    ///
    /// # Errors
    /// Where neither does, with what comes instead.
    pub(super) async fn is_heard(&self) -> Result<(), ToolError> {
        let begun = Instant::now();
        let mut lines = Vec::new();
        while lines.len() < UNREAD_LINES && begun.elapsed() < SILENCE {
            lines.extend(self.unread.try_iter());
            if self.arriving.try_recv().is_ok() || lines.iter().any(|line| is_none(line)) {
                return Ok(());
            }
            sleep(LOOK).await;
        }
        let reason = match lines.last() {
            Some(line) => {
                let line: String = line.chars().filter(|c| !c.is_control()).collect();
                let line: String = line.trim().chars().take(TOLD_OF_A_LINE).collect();
                format!(
                    "it sent no number of micrometres but `{line}`; a line such as 12.345 is expected, and nothing else in it"
                )
            }
            None => format!("it sent no line in {} s", SILENCE.as_secs()),
        };
        Err(cannot_read(&self.path, reason))
    }

    /// What it reads from now on, the mean of some readings (um).
    pub(super) async fn read_now(&self) -> Result<f64, ToolError> {
        // What came before is of another place.
        while self.arriving.try_recv().is_ok() {}
        let (mut sum_um, mut count) = (0.0, 0);
        let mut last = Instant::now();
        while count < READINGS {
            match self.arriving.try_recv() {
                Ok((now, um)) if is_possible(um) => {
                    sum_um += um;
                    count += 1;
                    last = now;
                }
                _ if last.elapsed() > SILENCE => {
                    let reason = format!("it sent no number of at most {LONGEST_UM} um");
                    return Err(cannot_read(&self.path, reason));
                }
                Ok(_) => {}
                Err(_) => sleep(LOOK).await,
            }
        }
        Ok(sum_um / READINGS as f64)
    }

    /// A waveform begins now; the first one is the experiment's time 0.
    pub(super) fn begin(&mut self) {
        self.began.get_or_insert_with(Instant::now);
    }

    /// Its scatter, one standard deviation, as the mirror rests now (um); `None` where too little has been heard of it, or it does not scatter.
    pub(super) fn noise_um(&mut self) -> Option<f64> {
        self.heard.extend(self.arriving.try_iter());
        let last = self.heard.iter().rev().map(|(_, um)| *um);
        let last = last.take(NOISE_READINGS).filter(|um| is_possible(*um));
        let last: Vec<f64> = last.collect();
        noise_um(&last).filter(|um| last.len() >= READINGS && *um > 0.0)
    }

    /// Hears it on, which is so late, until it has told what it reads now, or is silent.
    pub(super) async fn hear_on(&mut self, lag: Span) {
        let told = Instant::now() + Duration::from_secs_f64(lag.s) + CLOCKS;
        while Instant::now() < told + SILENCE {
            self.heard.extend(self.arriving.try_iter());
            let last = self.heard.iter().rev().find(|(_, um)| is_possible(*um));
            if last.is_some_and(|(at, _)| *at >= told) {
                return;
            }
            sleep(LOOK).await;
        }
    }

    /// Seconds of the experiment, and micrometres, as they arrived before it and in it; `None` where none has begun. The next experiment begins
    /// anew.
    pub(super) fn take(&mut self) -> Option<Vec<(f64, f64)>> {
        self.heard.extend(self.arriving.try_iter());
        let heard = std::mem::take(&mut self.heard);
        let start = self.began.take()?;
        let since = |now: Instant| {
            if now >= start {
                (now - start).as_secs_f64()
            } else {
                -(start - now).as_secs_f64()
            }
        };
        Some(
            heard
                .into_iter()
                .map(|(now, um)| (since(now), um))
                .collect(),
        )
    }
}

/// Reads `device` in a thread of its own for as long as somebody listens; `clock` tells the time of each reading. Whole lines that are no
/// numbers go to `unread`. The first line is passed over: it may have begun before the device was opened.
fn listen(
    device: File,
    clock: impl Fn() -> Instant + Send + 'static,
    unread: Sender<String>,
) -> Arriving {
    let (send, arriving) = channel();
    thread::spawn(move || {
        let mut device = BufReader::new(device);
        let (mut line, mut is_rest) = (Vec::new(), true);
        while let Ok(1..) = (&mut device)
            .take(MOST_OF_A_LINE)
            .read_until(b'\n', &mut line)
        {
            let is_whole = line.ends_with(b"\n") && !is_rest;
            is_rest = !line.ends_with(b"\n");
            // Text that is no text, as a sensor sends it when it is switched on, is passed over like any other.
            let text = String::from_utf8_lossy(&line).into_owned();
            line.clear();
            match micrometres(&text) {
                _ if !is_whole => {}
                Some(um) => {
                    if send.send((clock(), um)).is_err() {
                        return;
                    }
                }
                // Nobody may ask for them any more.
                None => drop(unread.send(text)),
            }
        }
    });
    arriving
}

pub(super) fn cannot_read(path: &Path, reason: impl ToString) -> ToolError {
    let (path, reason) = (path.to_owned(), reason.to_string());
    SensorFault::Sensor { path, reason }.into()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::commands::measure::readings::merge;
    use crate::system::serial_device as device;
    use measurement::{MeasurementFile, Row};
    use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
    use rustix::termios::{LocalModes, OutputModes, tcgetattr};
    use std::io::{Seek, Write};
    use std::sync::atomic::{AtomicU32, Ordering};

    /// The sensor's end of a pseudo terminal, and the tool's.
    fn pseudo_terminal() -> (File, PathBuf) {
        let sensor = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)
            .expect("a pseudo terminal");
        unlockpt(&sensor).expect("it is ours");
        let name = ptsname(&sensor, Vec::new()).expect("it has a name");
        (File::from(sensor), name.into_string().expect("text").into())
    }

    #[test]
    fn readings_are_merged_at_the_times_at_which_they_arrived() {
        let (mut sensor, path) = pseudo_terminal();
        let device = device(&path, Some(115_200)).expect("it opens");
        let start = Instant::now();
        // A reading every 100 ms, whenever it is really read.
        let count = AtomicU32::new(0);
        let clock =
            move || start + Duration::from_millis(100) * count.fetch_add(1, Ordering::Relaxed);
        let arriving = listen(device, clock, channel().0);
        // Noise of a sensor that is switched on, and bytes that would be signals, or the end, to a terminal.
        sensor
            .write_all(b"\xff\xfelaser on\r\n\x03\n\x04\nnan\n")
            .unwrap();
        for um in [5.0, 7.0, 6.0, 9.0] {
            sensor.write_all(format!("{um:.3}\r\n").as_bytes()).unwrap();
        }
        let next = || arriving.recv().expect("a reading");
        let readings = [(); 4].map(|()| next());
        let since = |now: Instant| (now - start).as_secs_f64();
        let readings = readings.map(|(now, um)| (since(now), um));
        let mut file = MeasurementFile::default();
        for t_s in [0.0, 0.05, 0.1, 0.25, 0.3, 0.4] {
            file.rows.push(Row {
                t_s,
                ..Row::default()
            });
        }
        merge(&readings, &mut file);
        let z: Vec<_> = file.rows.iter().map(|row| row.z_um).collect();
        for (found, is) in z.iter().zip([0.0, 1.0, 2.0, 2.5, 4.0]) {
            assert!((found.unwrap() - is).abs() < 1e-9, "{z:?}");
        }
        assert_eq!(z[5], None, "nothing arrived by then");
    }

    #[test]
    fn a_line_that_is_too_long_or_breaks_off_is_no_reading() {
        let mut recording = tempfile::tempfile().unwrap();
        // Zeros alone would be numbers, in whatever pieces they come.
        recording.write_all(&vec![b'0'; 1 << 20]).unwrap();
        recording.write_all(b"\n12.5\n12.").unwrap();
        recording.rewind().unwrap();
        let read: Vec<f64> = listen(recording, Instant::now, channel().0)
            .iter()
            .map(|(_, um)| um)
            .collect();
        assert_eq!(read, [12.5]);
    }

    #[test]
    fn a_terminal_echoes_nothing_and_has_the_speed_that_was_asked_for() {
        let (_sensor, path) = pseudo_terminal();
        let device = device(&path, Some(9600)).expect("it opens");
        let modes = tcgetattr(&device).expect("a terminal");
        assert!(
            !modes
                .local_modes
                .intersects(LocalModes::ECHO | LocalModes::ISIG | LocalModes::ICANON)
        );
        assert!(!modes.output_modes.contains(OutputModes::OPOST));
        assert_eq!(modes.input_speed(), 9600);
    }

    /// A sensor, and who tells what it reads.
    fn laser() -> (Serial, Sender<(Instant, f64)>) {
        let (send, arriving) = channel();
        (Serial::at("laser".into(), arriving), send)
    }

    #[test]
    fn a_serial_sensor_tells_its_own_noise_where_it_has_been_heard_for_long_enough() {
        let (mut sensor, send) = laser();
        let tell = |um| send.send((Instant::now(), um)).expect("it listens");
        // An even spread of one standard deviation of 1 um, in the order of a prime's multiples.
        let scatter = |index: i32| 1.732 * (f64::from(index * 37 % 101) / 50.0 - 1.0);
        (0..10).for_each(|index| tell(scatter(index)));
        assert_eq!(sensor.noise_um(), None);
        (10..150).for_each(|index| tell(scatter(index)));
        tell(9.91e37);
        let um = sensor.noise_um().expect("it scatters");
        assert!((0.5..1.5).contains(&um), "{um}");
        (0..100).for_each(|_| tell(12.5));
        assert_eq!(sensor.noise_um(), None, "it does not tell");
    }

    #[test]
    fn a_serial_sensor_is_heard_until_it_has_told_the_end() {
        let (mut sensor, send) = laser();
        let lag = Span { s: 0.1 };
        let end = Instant::now() + Duration::from_millis(100);
        let teller = std::thread::spawn(move || {
            while send.send((Instant::now(), 1.0)).is_ok() {
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        runtime().block_on(sensor.hear_on(lag));
        assert!(sensor.heard.last().is_some_and(|(at, _)| *at >= end));
        drop(sensor);
        teller.join().expect("it ends");
    }

    fn runtime() -> tokio::runtime::Runtime {
        tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .build()
            .expect("a runtime")
    }

    #[test]
    fn what_a_serial_sensor_sends_is_tried_and_told() {
        let heard = |sends: &str| {
            let (mut sensor, path) = pseudo_terminal();
            let device = device(&path, None).expect("it opens");
            let serial = Serial::on(path, device);
            // The end of a line that was begun before.
            sensor.write_all(b"2.5\n").expect("it is read");
            sensor.write_all(sends.as_bytes()).expect("it is read");
            let heard = runtime().block_on(serial.is_heard());
            heard.map_err(|error| error.to_string())
        };
        for sends in [
            "12.5\n",
            "laser on\n12.5 um\n",
            "nan\n",
            "\r\n",
            "9.91e37\n",
        ] {
            assert_eq!(heard(sends), Ok(()), "{sends}");
        }
        for line in ["0.5,12.3", "12,3", "12.3 nm", "z = 12.3"] {
            let said = heard(&format!("{line}\n").repeat(5)).expect_err("no number");
            assert!(said.contains(&format!("but `{line}`")), "{said}");
        }
    }

    #[test]
    fn a_serial_sensor_is_read_from_now_on() {
        let (sensor, send) = laser();
        let tell = |um: f64| send.send((Instant::now(), um)).expect("it listens");
        // From before the spot was moved.
        tell(1e6);
        let runtime = runtime();
        let (read, ()) = runtime.block_on(async {
            tokio::join!(sensor.read_now(), async {
                tell(9.91e37);
                for i in 0..READINGS {
                    tell(i as f64);
                }
            })
        });
        let mean = (READINGS - 1) as f64 / 2.0;
        assert_eq!(read.expect("it was told"), mean);
    }
}
