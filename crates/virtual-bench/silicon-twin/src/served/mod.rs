//! A board that host tools find: the twin in a thread of its own, behind the same socket and FIFOs as other emulated boards.

mod stops;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use emulated_board::{
    Connected, Controls, LogError, LogTable, Pace, Speed, Stack, StartError, Surroundings,
    ToolLink, claim_socket,
};

use crate::board::Board;
use crate::chip::Reset;
use crate::chip::memory::SRAM;
use crate::coverage::{self, Coverage};
use crate::rtt;
use crate::timing::{Handling, Timing};
use crate::{Failure, Image, ImageError, Twin};
use stops::Stops;

/// What the board does between two looks at its links, at most: short beside a frame of USB, so that a request waits for
/// the bus and not for a look.
const SLICE_S: f64 = 2e-4;
/// Control ticks in that time.
const TICKS: u32 = 2;
/// By then a board has started, which takes some 20 ms, and checked its heaters, twice with a pause of a quarter of a second.
const CHECKED_S: f64 = 0.3;
/// How long a board may take by the wall's clock until its host knows it: twenty times what it takes on two idle cores.
const START_TIMEOUT: Duration = Duration::from_secs(20);

/// What to run.
#[derive(Clone, Debug)]
pub struct Serving {
    /// The image that is flashed.
    pub image: PathBuf,
    /// What is on the board.
    pub connected: Connected,
    /// What is around the mirror as the board starts.
    pub around: Surroundings,
    /// Where the board's socket is placed.
    pub boards_directory: PathBuf,
    /// The board's name among those of that directory.
    pub name: String,
    /// How fast its clock goes.
    pub speed: Speed,
}

/// Why a board does not start.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The image cannot be read.
    #[error(
        "the firmware image {path} cannot be read: {source}; `cargo xtask build stm32g474` makes it"
    )]
    File {
        /// The image.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The image is not for this chip.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The image carries no log table.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The mirror's description has a number out of range.
    #[error(transparent)]
    Mirror(#[from] virtual_mirror::ConfigError),
    /// The socket's place.
    #[error(transparent)]
    Place(#[from] StartError),
    /// Socket or FIFO.
    #[error("the board's files cannot be made: {0}")]
    Files(#[from] std::io::Error),
    /// The program failed.
    #[error("the program fails: {0}")]
    Failed(Box<Failure>),
    /// The host did not come to know the device.
    #[error("the USB host does not come to know the board: {0}")]
    NotUp(String),
}

impl From<Failure> for ServeError {
    fn from(failure: Failure) -> Self {
        Self::Failed(Box::new(failure))
    }
}

/// What the thread says while it runs.
#[derive(Debug, Default)]
struct Shared {
    simulated_us: AtomicU64,
    is_known: AtomicBool,
    ends: AtomicBool,
    said: Mutex<Said>,
}

/// Something that is done to the twin between two slices.
type Act = Box<dyn FnOnce(&mut Twin) + Send>;

#[derive(Debug, Default)]
struct Said {
    log: Vec<u8>,
    hash: String,
    timing: Timing,
    failure: Option<String>,
}

impl Shared {
    fn said(&self) -> MutexGuard<'_, Said> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A board that runs until it is dropped.
#[derive(Debug)]
pub struct ServedTwin {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    acts: Sender<Act>,
    controls: Controls,
    socket: PathBuf,
    elf: Vec<u8>,
}

impl ServedTwin {
    /// Starts a board and waits until its host knows it.
    ///
    /// # Errors
    /// Where anything it needs is missing, or the program fails; nothing is left running then.
    pub fn start(serving: &Serving) -> Result<Self, ServeError> {
        let elf = fs::read(&serving.image).map_err(|source| ServeError::File {
            path: serving.image.clone(),
            source,
        })?;
        let image = Image::from_elf(&elf)?;
        let log_at = image.object(rtt::SYMBOL);
        let mut board = Board::new(&serving.connected)?;
        board.move_to(Controls::around(serving.around));
        let twin = Twin::new(image, board)?;
        let socket = claim_socket(&serving.boards_directory, &serving.name)?;
        let controls = twin.chip.board.controls().clone();
        let link = ToolLink::listen(&socket)?;
        let (acts, to_do) = channel();
        let worker = Worker {
            twin,
            to_do,
            log_at,
            pace: Pace::by(serving.speed, link.traffic()),
            link,
            stops: Stops::beside(&socket)?,
            shared: Arc::default(),
        };
        let shared = Arc::clone(&worker.shared);
        let thread = Some(thread::spawn(move || worker.run()));
        let board = Self {
            shared,
            thread,
            acts,
            controls,
            socket,
            elf,
        };
        board.wait_until_known()?;
        Ok(board)
    }

    fn wait_until_known(&self) -> Result<(), ServeError> {
        let start = Instant::now();
        while start.elapsed() < START_TIMEOUT {
            if let Some(failure) = self.failure() {
                return Err(ServeError::NotUp(failure));
            }
            if self.is_known() && self.simulated_s() > CHECKED_S {
                return Ok(());
            }
            thread::sleep(Duration::from_millis(1));
        }
        let seconds = START_TIMEOUT.as_secs();
        Err(ServeError::NotUp(format!(
            "nothing happened for {seconds} s"
        )))
    }

    /// The socket on which the board takes requests.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// Time that has passed for the board and its mirror.
    pub fn simulated_s(&self) -> f64 {
        self.shared.simulated_us.load(Ordering::Relaxed) as f64 * 1e-6
    }

    /// The bench around it.
    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    /// Does something to the twin between two instructions, and waits until it is done; `None` where the board has
    /// ended.
    pub fn with<T: Send + 'static>(
        &self,
        act: impl FnOnce(&mut Twin) -> T + Send + 'static,
    ) -> Option<T> {
        let (send, done) = channel();
        let act = move |twin: &mut Twin| drop(send.send(act(twin)));
        self.acts.send(Box::new(act)).ok()?;
        done.recv().ok()
    }

    /// Takes the board's power away, whatever it does, and gives it back.
    pub fn cut_power(&self) {
        // A program without vectors fails at its next instruction.
        self.with(|twin| drop(twin.reset(Reset::Power)));
    }

    /// How often it was reset, the first time by power.
    pub fn resets(&self) -> usize {
        self.with(|twin| twin.resets().len()).unwrap_or_default()
    }

    /// Whether a host knows the device, so that tools reach it.
    pub fn is_known(&self) -> bool {
        self.shared.is_known.load(Ordering::Relaxed)
    }

    /// Why the board ended, if it did.
    pub fn failure(&self) -> Option<String> {
        self.shared.said().failure.clone()
    }

    /// A hash of all that went out of the chip's timer and came in by its converters.
    pub fn trace_hash(&self) -> String {
        self.shared.said().hash.clone()
    }

    /// How interrupt `number` was handled so far.
    pub fn interrupt(&self, number: u32) -> Handling {
        self.shared.said().timing.interrupt(number)
    }

    /// How much of its stack the firmware has used since its last reset; `None` where the board has ended, or the image does not
    /// say where the stack is.
    pub fn stack(&self) -> Option<Stack> {
        let place = Stack::place(&self.elf)?;
        let offset = |address: u64| usize::try_from(address.checked_sub(SRAM.into())?).ok();
        let place = offset(place.start)?..offset(place.end)?;
        self.with(|twin| twin.chip.memory.ram().get(place).map(Stack::painted))?
    }

    /// The firmware's log so far.
    ///
    /// # Errors
    /// Where the image carries no log table.
    pub fn log(&self) -> Result<Vec<String>, LogError> {
        let table = LogTable::from_elf(&self.elf)?;
        let mut lines = Vec::new();
        let frames = self.shared.said().log.clone();
        // Memory can always be read.
        let _ = table.decode(&*frames, |line| lines.push(line));
        Ok(lines)
    }
}

impl Drop for ServedTwin {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = fs::remove_file(&self.socket);
    }
}

/// The thread's part.
struct Worker {
    twin: Twin,
    to_do: Receiver<Act>,
    log_at: Option<u32>,
    link: ToolLink,
    stops: Stops,
    pace: Pace,
    shared: Arc<Shared>,
}

impl Worker {
    fn run(mut self) {
        self.serve();
        if let Some(folder) = std::env::var_os(coverage::FOLDER) {
            let mut covered = Coverage::default();
            covered.add(&self.twin);
            // A folder that is not there has nothing in it, which who asked for it will see.
            let _ = covered.save_in(Path::new(&folder));
        }
    }

    fn serve(&mut self) {
        while !self.shared.ends.load(Ordering::Relaxed) {
            self.to_do.try_iter().for_each(|act| act(&mut self.twin));
            if let Err(failure) = self.twin.run_for(SLICE_S) {
                self.report();
                self.shared.said().failure = Some(failure.to_string());
                return;
            }
            self.exchange();
            self.report();
            (0..TICKS).for_each(|_| self.pace.tick());
        }
    }

    /// Carries frames between tool and device. Without a tool nobody asks the device for any. A tool loses a device that is
    /// reset or unplugged, and waits for one that is not there.
    fn exchange(&mut self) {
        let host = &mut self.twin.chip.usb_host;
        if host.device().is_none() {
            self.link.hang_up();
            return;
        }
        let has_tool = self.link.has_tool();
        host.listen(has_tool && self.link.has_room());
        while let Some(frame) = host.receive() {
            self.link.send(&frame);
        }
        for frame in self.link.exchange() {
            host.send(&frame);
        }
        self.stops.exchange(host);
    }

    fn report(&mut self) {
        let shared = &self.shared;
        let microseconds = (self.twin.seconds() * 1e6) as u64;
        shared.simulated_us.store(microseconds, Ordering::Relaxed);
        let is_known = self.twin.chip.usb_host.device().is_some();
        shared.is_known.store(is_known, Ordering::Relaxed);
        let mut said = shared.said();
        if let Some(at) = self.log_at {
            said.log
                .extend(rtt::take(self.twin.chip.memory.ram_mut(), at));
        }
        said.hash = self.twin.chip.trace.hash();
        said.timing.clone_from(&self.twin.timing);
        if let Some(failure) = self.twin.chip.usb_host.failure() {
            said.failure = Some(failure.to_owned());
        }
    }
}
