//! A serial sensor: lines of micrometres, each with the time at which it arrived.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Instant;

use super::readings::finite;

/// The longest line of a sensor (bytes): a number takes twenty, and what is longer is passed over.
const MOST_OF_A_LINE: u64 = 1024;

/// Readings as they arrive (um).
pub(super) type Arriving = Receiver<(Instant, f64)>;

/// Reads `device` in a thread of its own for as long as somebody listens; `clock` tells the time of each reading.
pub(super) fn listen(device: File, clock: impl Fn() -> Instant + Send + 'static) -> Arriving {
    let (send, arriving) = channel();
    thread::spawn(move || {
        let mut device = BufReader::new(device);
        let (mut line, mut is_rest) = (Vec::new(), false);
        while let Ok(1..) = (&mut device)
            .take(MOST_OF_A_LINE)
            .read_until(b'\n', &mut line)
        {
            let is_whole = line.ends_with(b"\n") && !is_rest;
            is_rest = !line.ends_with(b"\n");
            // Text that is no text, as a sensor sends it when it is switched on, is passed over like any other.
            let um = finite(&String::from_utf8_lossy(&line)).filter(|_| is_whole);
            line.clear();
            if um.is_some_and(|um| send.send((clock(), um)).is_err()) {
                return;
            }
        }
    });
    arriving
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
    use std::path::PathBuf;
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::time::Duration;

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
        let arriving = listen(device, clock);
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
        let read: Vec<f64> = listen(recording, Instant::now)
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
}
