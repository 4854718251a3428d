//! A driver board without an emulator: its firmware, compiled for this machine, in front of the same plant as other emulated
//! boards and behind the same socket and FIFOs.
//!
//! What it runs is the application of the driver board, its USB device included, from the same sources. What it has not is the
//! processor: no image, no stack, no interrupts, nothing that resets it. In return it is several times as fast as a board in
//! QEMU, and needs nothing that is not in this program.

mod kept_flash;
mod usb_host;

use std::path::{Path, PathBuf};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Waker};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use emulated_board::{
    Connected, Controls, FlashClaim, Pace, Plant, Progress, Speed, StartError, StopFifos,
    Surroundings, ToolLink, claim_socket,
};
use firmware_on_host::power_up;

use crate::kept_flash::{FLASH_BYTES, KeptFlash};
use crate::usb_host::{HostTime, UsbHost};

/// By then a board has checked its heaters, twice with a pause of a quarter of a second.
const CHECKED_S: f64 = 0.26;
/// How long a board may take by the wall's clock until its host knows it: it takes a tenth of a second, and machines have
/// stood still for 20.
const START_TIMEOUT: Duration = Duration::from_secs(60);
const LOOK: Duration = Duration::from_millis(1);

/// What to run.
#[derive(Clone, Debug)]
pub struct Serving {
    /// What is on the board.
    pub connected: Connected,
    /// What is around the mirror as the board starts.
    pub around: Surroundings,
    /// Where the board's socket is placed.
    pub boards_directory: PathBuf,
    /// The board's name among those of that directory.
    pub name: String,
    /// The file that is its flash, made where it is missing; without one its flash is erased.
    pub flash: Option<PathBuf>,
    /// How fast its clock goes.
    pub speed: Speed,
}

/// Why a board does not start.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The mirror's description has a number out of range.
    #[error(transparent)]
    Mirror(#[from] virtual_mirror::ConfigError),
    /// The socket's place.
    #[error(transparent)]
    Place(#[from] StartError),
    /// Socket, FIFO or thread.
    #[error("the board's files cannot be made: {0}")]
    Files(#[from] std::io::Error),
    /// The host did not come to know the device.
    #[error("the board did not come up: {0}")]
    NotUp(&'static str),
}

/// What the thread says while it runs.
#[derive(Debug, Default)]
struct Shared {
    progress: Progress,
    is_known: AtomicBool,
    ends: AtomicBool,
}

/// A board that runs until it is dropped.
#[derive(Debug)]
pub struct BoardOnHost {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    controls: Controls,
    socket: PathBuf,
    /// Given back when the thread has ended.
    _flash: Option<FlashClaim>,
}

impl BoardOnHost {
    /// Starts a board and waits until its heaters are checked.
    ///
    /// # Errors
    /// Where a number of the mirror is out of range, or its socket cannot be placed; nothing is left running then.
    pub fn start(serving: &Serving) -> Result<Self, ServeError> {
        let flash = serving.flash.as_deref();
        let flash = flash.map(|file| FlashClaim::take(file, FLASH_BYTES));
        let flash = flash.transpose()?;
        let plant = Plant::new(&serving.connected, serving.around)?;
        let socket = claim_socket(&serving.boards_directory, &serving.name)?;
        let controls = plant.controls();
        let link = ToolLink::listen(&socket)?;
        let shared = Arc::<Shared>::default();
        let bench = Bench {
            plant,
            pace: Pace::by(serving.speed, link.traffic()),
            link,
            stops: StopFifos::beside(&socket)?,
            kept: KeptFlash::open(serving.flash.as_deref())?,
            shared: Arc::clone(&shared),
        };
        let thread = thread::Builder::new()
            .name("board".to_owned())
            .spawn(move || bench.run())?;
        let board = Self {
            shared,
            thread: Some(thread),
            controls,
            socket,
            _flash: flash,
        };
        board.wait_until_checked()?;
        Ok(board)
    }

    fn wait_until_checked(&self) -> Result<(), ServeError> {
        let start = Instant::now();
        while start.elapsed() < START_TIMEOUT {
            if self.has_ended() {
                return Err(ServeError::NotUp("it ended"));
            }
            if self.shared.is_known.load(Ordering::Relaxed) && self.simulated_s() > CHECKED_S {
                return Ok(());
            }
            thread::sleep(LOOK);
        }
        Err(ServeError::NotUp("nothing happened for a minute"))
    }

    /// The socket on which the board takes requests.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// Time that has passed for the board and its mirror.
    pub fn simulated_s(&self) -> f64 {
        self.shared.progress.simulated_s()
    }

    /// The bench around it.
    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    /// Whether its firmware has ended, which a defect in it, or a disturbance of its processor, leads to.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for BoardOnHost {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = std::fs::remove_file(&self.socket);
    }
}

/// What the thread works on.
struct Bench {
    plant: Plant,
    pace: Pace,
    link: ToolLink,
    stops: StopFifos,
    kept: KeptFlash,
    shared: Arc<Shared>,
}

impl Bench {
    /// Board and host in turns, a control tick each time, until the board is dropped.
    fn run(self) {
        let Self {
            mut plant,
            mut pace,
            link,
            stops,
            mut kept,
            shared,
        } = self;
        let asked = Arc::clone(&shared);
        let exchange = move |pins| plant.exchange(&pins, &mut pace, &asked.progress);
        let (firmware, bus) = power_up(&kept.flash, Box::new(exchange));
        let mut firmware = pin!(firmware);
        let time = HostTime::default();
        let mut host = pin!(UsbHost { bus, link, stops }.run(&shared.is_known, &time));
        // Both look again at whatever they wait for each time they are polled.
        let mut context = Context::from_waker(Waker::noop());
        while !shared.ends.load(Ordering::Relaxed) {
            match time.stands() {
                true => thread::sleep(LOOK),
                false => drop(firmware.as_mut().poll(&mut context)),
            }
            let _ = host.as_mut().poll(&mut context);
            if let Err(error) = kept.keep() {
                eprintln!("the board's flash cannot be kept: {error}");
                return;
            }
        }
    }
}
