//! One emulated board: its process, its plant, its log.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ExitStatus};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use board_sockets::stop_fifos;
use rustix::fs::{CWD, Mode, mkfifoat};
use rustix::process::{Pid, Signal, kill_process};
use rustix::thread::{CpuSet, sched_setaffinity};
use tempfile::TempDir;

use crate::controls::{Controls, Surroundings};
use crate::logs::LogTable;
use crate::pace::{Pace, Speed};
use crate::place::{FlashClaim, claim_socket, place_flash, private_directory, remove};
use crate::plant::{Connected, Plant, Progress};
use crate::qemu;
use crate::stack::Stack;
use crate::start_error::StartError;

/// How long QEMU may take to offer its socket: it takes a second, and machines have stood still for 20. That it has ended is
/// noticed at once.
const START_TIMEOUT: Duration = Duration::from_secs(60);

/// By then a board has checked its heaters, twice with a pause of a quarter of a second.
const CHECKED_S: f64 = 0.26;

/// What to emulate.
#[derive(Clone, Debug)]
pub struct Emulation {
    /// The firmware's image for MPS2-AN386.
    pub image: PathBuf,
    /// What is on the board.
    pub connected: Connected,
    /// What is around the mirror as the board starts.
    pub around: Surroundings,
    /// Where the board's socket is placed: [`board_sockets::boards_directory`], or a private directory.
    pub boards_directory: PathBuf,
    /// The board's name among those of that directory.
    pub name: String,
    /// The file that is its flash, made where it is missing; without one its flash is erased, and
    /// goes with the board.
    pub flash: Option<PathBuf>,
    /// How fast its clock goes.
    pub speed: Speed,
    /// Whether QEMU's monitor runs, which [`EmulatedBoard::stack`] asks. Who reaches it can have QEMU read and write
    /// the user's files, so it is for tests.
    pub has_monitor: bool,
}

/// A board that runs until it is dropped.
#[derive(Debug)]
pub struct EmulatedBoard {
    qemu: Child,
    image: PathBuf,
    socket: PathBuf,
    progress: Arc<Progress>,
    controls: Controls,
    log: Log,
    directory: TempDir,
    _flash: Option<FlashClaim>,
}

impl EmulatedBoard {
    /// Starts a board and waits until its socket takes connections.
    ///
    /// # Errors
    /// Where anything it needs is missing; nothing is left running then.
    pub fn start(emulation: &Emulation) -> Result<Self, StartError> {
        let elf = fs::read(&emulation.image).map_err(|source| StartError::Image {
            path: emulation.image.clone(),
            source,
        })?;
        let table = LogTable::from_elf(&elf)?;
        let plant = Plant::new(&emulation.connected, emulation.around)?;
        let socket = claim_socket(&emulation.boards_directory, &emulation.name)?;
        let directory = private_directory()?;
        let image = fs::canonicalize(&emulation.image)?;

        let fifos = [plant_link::TO_PLANT, plant_link::FROM_PLANT]
            .map(|name| directory.path().join(OsStr::from_bytes(name.to_bytes())));
        let stop = stop_fifos(&socket);
        stop.iter().try_for_each(|fifo| remove(fifo))?;
        for fifo in fifos.iter().chain(&stop) {
            mkfifoat(CWD, fifo, Mode::RUSR | Mode::WUSR).map_err(io::Error::from)?;
        }
        let flash = place_flash(directory.path(), emulation.flash.as_deref())?;
        let mut qemu = qemu::command(&image, directory.path(), &socket, emulation.has_monitor)
            .spawn()
            .map_err(StartError::Qemu)?;
        let together = Processor::current();
        together.keep(Pid::from_child(&qemu));
        let progress = Arc::new(Progress::default());
        let log = Log::default();
        let controls = plant.controls();
        let pace = Pace::at(emulation.speed, &socket);
        let ticks = Arc::clone(&progress);
        run_plant(plant, fifos, together, pace, ticks, log.clone());
        let complaints = collect_log(&mut qemu, table, log.clone());

        let mut board = Self {
            qemu,
            image,
            socket,
            progress,
            controls,
            log,
            directory,
            _flash: flash,
        };
        board.wait_for_socket(&complaints)?;
        Ok(board)
    }

    /// The socket on which the board takes requests.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// The directory of its files, which goes when the board is dropped.
    pub fn directory(&self) -> &Path {
        self.directory.path()
    }

    /// Time that has passed for the board and its mirror.
    pub fn simulated_s(&self) -> f64 {
        self.progress.simulated_s()
    }

    /// Exchanges between the board and its plant so far: one a control tick, and fewer while it is left alone.
    pub fn exchanges(&self) -> u64 {
        self.progress.exchanges()
    }

    /// The bench around it.
    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    /// Wears out the board's flash: from now on it takes nothing more.
    ///
    /// # Errors
    /// Where the system cannot.
    pub fn wear_out_flash(&self) -> io::Result<()> {
        let worn = OsStr::from_bytes(plant_link::FLASH_IS_WORN.to_bytes());
        fs::write(self.directory.path().join(worn), [])
    }

    /// The firmware's log so far.
    pub fn log(&self) -> Vec<String> {
        self.log.lines()
    }

    /// How much of its stack the firmware has used since its last reset.
    ///
    /// # Errors
    /// Where the emulator has no monitor or does not tell, or the image does not say where the stack is.
    pub fn stack(&self) -> io::Result<Stack> {
        Stack::of(&self.image, self.directory.path())
    }

    /// The emulator's process.
    pub fn process_id(&self) -> u32 {
        self.qemu.id()
    }

    /// Stops the emulator's process where it is, as a machine without a processor to spare does.
    ///
    /// # Errors
    /// Where the system cannot.
    pub fn pause(&self) -> io::Result<()> {
        Ok(kill_process(Pid::from_child(&self.qemu), Signal::STOP)?)
    }

    /// Lets it go on.
    ///
    /// # Errors
    /// Where the system cannot.
    pub fn resume(&self) -> io::Result<()> {
        Ok(kill_process(Pid::from_child(&self.qemu), Signal::CONT)?)
    }

    /// Kills the emulator, as unplugging would; later requests find no board.
    ///
    /// # Errors
    /// Where the system cannot.
    pub fn kill(&mut self) -> io::Result<()> {
        self.qemu.kill()?;
        self.qemu.wait()?;
        Ok(())
    }

    /// Whether the board has ended, and how.
    ///
    /// # Errors
    /// Where the system cannot tell.
    pub fn exit_status(&mut self) -> io::Result<Option<ExitStatus>> {
        self.qemu.try_wait()
    }

    fn wait_for_socket(&mut self, complaints: &Receiver<String>) -> Result<(), StartError> {
        let pause = Duration::from_millis(10);
        for _ in 0..START_TIMEOUT.as_millis() / pause.as_millis() {
            if let Some(status) = self.qemu.try_wait()? {
                if status.code() == Some(qemu::NOT_FOUND) {
                    return Err(StartError::NoQemu);
                }
                let said: Vec<String> = complaints.iter().collect();
                return Err(StartError::NotUp(format!(
                    "{status}; it said: {}",
                    said.join("; ")
                )));
            }
            if self.socket.exists() && self.simulated_s() > CHECKED_S {
                return Ok(());
            }
            thread::sleep(pause);
        }
        Err(StartError::NotUp(format!(
            "nothing happened for {} s",
            START_TIMEOUT.as_secs()
        )))
    }
}

impl Drop for EmulatedBoard {
    fn drop(&mut self) {
        // Whatever fails here, the firmware also ends by itself when its plant is gone.
        let _ = self.kill();
        let _ = fs::remove_file(&self.socket);
        for fifo in stop_fifos(&self.socket) {
            let _ = fs::remove_file(fifo);
        }
    }
}

/// The processor that board and plant share. They take turns at every tick, and handing over within
/// one processor takes a tenth of the time of waking another one up.
#[derive(Clone, Copy)]
struct Processor(usize);

impl Processor {
    fn current() -> Self {
        Self(rustix::thread::sched_getcpu())
    }

    /// Keeps a thread, and those that it starts, here. Where the system does not let it, the
    /// emulation is slower and nothing else.
    fn keep(self, thread: Pid) {
        let mut processors = CpuSet::new();
        processors.set(self.0);
        let _ = sched_setaffinity(Some(thread), &processors);
    }
}

/// Lines that several threads add to.
#[derive(Clone, Debug, Default)]
struct Log(Arc<Mutex<Vec<String>>>);

impl Log {
    fn add(&self, line: String) {
        if let Ok(mut lines) = self.0.lock() {
            lines.push(line);
        }
    }

    fn lines(&self) -> Vec<String> {
        self.0.lock().map(|lines| lines.clone()).unwrap_or_default()
    }
}

/// Runs the plant until the board ends.
fn run_plant(
    plant: Plant,
    fifos: [PathBuf; 2],
    together: Processor,
    pace: Pace,
    progress: Arc<Progress>,
    log: Log,
) {
    let run = move || {
        together.keep(rustix::thread::gettid());
        // Opening a FIFO waits for the other end, so both sides open in the same order.
        let board = File::open(&fifos[0])?;
        let answer = File::options().write(true).open(&fifos[1])?;
        plant.run(board, answer, pace, &progress)
    };
    thread::spawn(move || {
        if let Err(error) = run() {
            log.add(format!("plant: {error}"));
        }
    });
}

/// Collects the firmware's log, and hands on what QEMU itself complains of.
fn collect_log(qemu: &mut Child, table: LogTable, log: Log) -> Receiver<String> {
    if let Some(frames) = qemu.stdout.take() {
        thread::spawn(move || table.decode(frames, |line| log.add(line)));
    }
    let (sender, complaints) = channel();
    if let Some(stderr) = qemu.stderr.take() {
        thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
    }
    complaints
}
