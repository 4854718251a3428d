//! A board and the tool.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use board_on_host::BoardOnHost;
use emulated_board::{Connected, EmulatedBoard, Emulation, Speed, Surroundings, private_directory};
use measurement::MeasurementFile;
use silicon_twin::flashed_image;
use silicon_twin::served::{ServedTwin, Serving};
use tempfile::TempDir;
use virtual_mirror::MirrorConfig;

use crate::emulator::Emulator;

/// The one real board is used by one check at a time.
static REAL_BOARD: Mutex<()> = Mutex::new(());

/// What has not happened by then on a board will not happen: thirty times what the slowest of the checks waits for on an
/// idle machine, the 3 s after which a board gives up a host that is silent.
pub(crate) const PATIENCE: Duration = Duration::from_secs(90);

/// The resistors on an emulated board.
const RESISTORS_OHM: f64 = 499.0;

/// What emulated boards run on: QEMU where it is not set; where it is `g474`, silicon twins are the boards of [`Bench::new`],
/// and where it is `host`, those of which no check wants more than a board on this machine can run on this machine.
const EMULATOR: &str = "MIRROR_EMULATOR";

/// Whether `MIRROR_EMULATOR` asks for silicon twins.
pub fn is_on_twin() -> bool {
    is_on("g474")
}

fn is_on(emulator: &str) -> bool {
    std::env::var_os(EMULATOR).is_some_and(|name| name == emulator)
}

/// A board and the tool in front of it.
pub struct Bench {
    board: String,
    emulator: Option<Emulator>,
    directory: TempDir,
    _turn: Option<MutexGuard<'static, ()>>,
}

/// What the tool said, and how it ended.
#[derive(Debug)]
pub struct Said {
    /// Exit code.
    pub code: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl Said {
    /// What went wrong, on one line: the tool breaks its lines to the terminal's width.
    pub fn sentence(&self) -> String {
        let words: Vec<&str> = self.err.split_whitespace().collect();
        words.join(" ").replace("│ ", "")
    }
}

impl Bench {
    /// The board that `MIRROR_BOARD` names, or a new emulated one, by the emulator that `MIRROR_EMULATOR` names.
    ///
    /// # Panics
    /// Where an emulated board does not start.
    pub fn new() -> Self {
        match std::env::var("MIRROR_BOARD") {
            Ok(board) => Self {
                board,
                emulator: None,
                directory: private_directory().expect("a directory"),
                _turn: Some(REAL_BOARD.lock().unwrap_or_else(PoisonError::into_inner)),
            },
            Err(_) if is_on_twin() => Self::on_twin(MirrorConfig::bench()),
            Err(_) => Self::emulated(MirrorConfig::bench()),
        }
    }

    /// A new silicon twin with this mirror on it, and the image that is flashed in it.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn on_twin(mirror: MirrorConfig) -> Self {
        Self::twin_with(Connected::Mirror(Box::new(mirror)))
    }

    /// A new silicon twin with such a resistor on each channel.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn twin_on_resistors(ohm: f64) -> Self {
        Self::twin_with(Connected::Resistors([ohm; 4]))
    }

    fn twin_with(connected: Connected) -> Self {
        let directory = private_directory().expect("a directory");
        let serving = Serving {
            image: flashed_image(),
            connected,
            around: Surroundings::default(),
            boards_directory: directory.path().to_owned(),
            name: "twin".to_owned(),
            speed: Speed::Fastest,
        };
        let twin = ServedTwin::start(&serving).unwrap_or_else(|error| panic!("{error}"));
        Self::of(Emulator::Twin(twin), directory)
    }

    fn of(emulator: Emulator, directory: TempDir) -> Self {
        Self {
            board: emulator.socket().to_string_lossy().into_owned(),
            emulator: Some(emulator),
            directory,
            _turn: None,
        }
    }

    /// A new board by the emulator that `MIRROR_EMULATOR` names, with this mirror on it. QEMU keeps its flash in the file
    /// `flash`.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn on_emulator(mirror: MirrorConfig, flash: &Path) -> Self {
        match is_on_twin() {
            true => Self::on_twin(mirror),
            false => Self::with_flash(mirror, Some(flash)),
        }
    }

    /// A new emulated board with this mirror on it, in QEMU or on this machine.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn emulated(mirror: MirrorConfig) -> Self {
        match is_on("host") {
            true => Self::on_host(mirror),
            false => Self::with_flash(mirror, None),
        }
    }

    /// A new board on this machine, with this mirror on it: its time goes on before a tool that stands still, as a real board's does.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn on_host(mirror: MirrorConfig) -> Self {
        Self::on_host_with(Connected::Mirror(Box::new(mirror)), None)
    }

    fn on_host_with(connected: Connected, flash: Option<PathBuf>) -> Self {
        let directory = private_directory().expect("a directory");
        let serving = board_on_host::Serving {
            connected,
            around: Surroundings::default(),
            boards_directory: directory.path().to_owned(),
            name: "emulated".to_owned(),
            flash,
            speed: Speed::Fastest,
        };
        let board = BoardOnHost::start(&serving).unwrap_or_else(|error| panic!("{error}"));
        Self::of(Emulator::Host(board), directory)
    }

    /// The same, its flash in the file `flash`, which outlives it.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn with_flash(mirror: MirrorConfig, flash: Option<&Path>) -> Self {
        Self::changed(|emulation| {
            emulation.connected = Connected::Mirror(Box::new(mirror));
            emulation.flash = flash.map(Path::to_owned);
        })
    }

    /// The board that `MIRROR_BOARD` names, if `MIRROR_RESISTORS` says which resistors (ohm) are on it in the
    /// place of the mirror; or a new emulated one with resistors, its flash in the file `flash`. With it comes their
    /// value.
    ///
    /// # Panics
    /// Where an emulated board does not start, or `MIRROR_RESISTORS` is no number.
    pub fn on_resistors(flash: &Path) -> Option<(Self, f64)> {
        if std::env::var_os("MIRROR_BOARD").is_none() {
            let connected = Connected::Resistors([RESISTORS_OHM; 4]);
            let flash = Some(flash.to_owned());
            let bench = match is_on("host") {
                true => Self::on_host_with(connected, flash),
                false => Self::changed(|emulation| {
                    emulation.connected = connected;
                    emulation.flash = flash;
                }),
            };
            return Some((bench, RESISTORS_OHM));
        }
        let ohm = std::env::var("MIRROR_RESISTORS").ok()?;
        let ohm = ohm.parse().expect("MIRROR_RESISTORS is a number of ohms");
        Some((Self::new(), ohm))
    }

    /// A new emulated board with the bench mirror on it, in what `change` has changed.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn changed(change: impl FnOnce(&mut Emulation)) -> Self {
        let directory = private_directory().expect("a directory");
        let mut emulation = Emulation {
            image: target_directory().join("thumbv7em-none-eabihf/firmware/mps2"),
            connected: Connected::Mirror(Box::new(MirrorConfig::bench())),
            around: Surroundings::default(),
            boards_directory: directory.path().to_owned(),
            name: "emulated".to_owned(),
            flash: None,
            speed: Speed::Fastest,
            has_monitor: false,
        };
        change(&mut emulation);
        let emulated = EmulatedBoard::start(&emulation).unwrap_or_else(|error| {
            panic!("{error}; is the image built? `cargo xtask build mps2`")
        });
        Self::of(Emulator::Qemu(emulated, emulation.flash), directory)
    }

    /// The board's name for the tool.
    pub fn board(&self) -> &str {
        &self.board
    }

    /// Whether it is one of this bench's own, emulated ones.
    pub fn is_emulated(&self) -> bool {
        self.emulator.is_some()
    }

    /// A directory of this bench's own.
    pub fn directory(&self) -> &Path {
        self.directory.path()
    }

    /// The silicon twin; `None` for another board.
    pub fn twin(&self) -> Option<&ServedTwin> {
        match &self.emulator {
            Some(Emulator::Twin(twin)) => Some(twin),
            _ => None,
        }
    }

    /// The board in QEMU; `None` for another one.
    pub fn emulated_board(&mut self) -> Option<&mut EmulatedBoard> {
        match &mut self.emulator {
            Some(Emulator::Qemu(board, _)) => Some(board),
            _ => None,
        }
    }

    /// Ends the board in QEMU, as one that is unplugged.
    pub fn kill_board(&mut self) {
        let board = self.emulated_board().expect("emulated");
        board.kill().expect("it dies");
    }

    pub(crate) fn emulator(&self) -> &Emulator {
        self.emulator.as_ref().expect("emulated")
    }

    /// Exchanges between the board and its plant so far.
    ///
    /// # Panics
    /// Where it is no board in QEMU.
    pub fn exchanges(&self) -> u64 {
        match self.emulator() {
            Emulator::Qemu(board, _) => board.exchanges(),
            Emulator::Host(_) | Emulator::Twin(_) => panic!("nobody counts them"),
        }
    }

    /// Runs the tool as a user types it.
    ///
    /// # Panics
    /// Where the tool is not built.
    pub fn tool(&self, words: &[&str]) -> Said {
        finish(self.start_tool(words))
    }

    /// Starts the tool and leaves it running.
    ///
    /// # Panics
    /// Where the tool is not built.
    pub fn start_tool(&self, words: &[&str]) -> Child {
        self.start(words, Stdio::null())
    }

    /// The same, for a conversation.
    ///
    /// # Panics
    /// Where the tool is not built.
    pub fn talk_to_tool(&self, words: &[&str]) -> Child {
        self.start(words, Stdio::piped())
    }

    /// The tool as a user types it, not yet started.
    pub fn command(&self, words: &[&str]) -> Command {
        let mut tool = Command::new(target_directory().join("debug/host-tool"));
        tool.args(words)
            .env("MIRROR_BOARD", &self.board)
            .env("MIRROR_BOARDS", self.directory())
            .env("NO_COLOR", "1")
            .current_dir(self.directory());
        tool
    }

    fn start(&self, words: &[&str], input: Stdio) -> Child {
        self.command(words)
            .stdin(input)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the tool is not built: `cargo build -p host-tool`")
    }

    /// A measurement file that the tool has written into [`Self::directory`].
    ///
    /// # Panics
    /// Where there is none, or it cannot be read.
    pub fn measured(&self, name: &str) -> MeasurementFile {
        let text = std::fs::read_to_string(self.directory().join(name)).expect("a file");
        MeasurementFile::parse(name, &text).expect("it is read again")
    }

    /// Whether the board says that it drives nothing.
    ///
    /// # Panics
    /// Where it does not answer.
    pub fn is_off(&self) -> bool {
        self.json(&["status"])["drive_v"] == serde_json::json!([0.0, 0.0, 0.0, 0.0])
    }

    /// Asks for the board's status until it is as wanted; returns it. Asking paces itself.
    ///
    /// # Panics
    /// Where that does not happen.
    pub fn wait_for_status(
        &self,
        what: &str,
        is_wanted: impl Fn(&serde_json::Value) -> bool,
    ) -> serde_json::Value {
        let start = Instant::now();
        loop {
            let status = self.json(&["status"]);
            if is_wanted(&status) {
                return status;
            }
            assert!(start.elapsed() < PATIENCE, "not {what}: {status}");
        }
    }

    /// Runs the tool for its JSON.
    ///
    /// # Panics
    /// Where it fails, or prints something else.
    pub fn json(&self, words: &[&str]) -> serde_json::Value {
        let said = self.tool(&[words, &["--json"]].concat());
        assert_eq!(said.code, 0, "{words:?}: {}", said.err);
        serde_json::from_str(&said.out).expect("JSON")
    }
}

impl Default for Bench {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Bench {
    /// A real board is left with its channels off, whatever a check did.
    fn drop(&mut self) {
        if !self.is_emulated() {
            let _ = self.start_tool(&["off"]).wait();
        }
    }
}

/// Waits for the tool to end.
///
/// # Panics
/// Where it was killed.
fn finish(tool: Child) -> Said {
    let output = tool.wait_with_output().expect("it ends");
    Said {
        code: output.status.code().expect("it was not killed"),
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        err: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

impl From<Child> for Said {
    fn from(tool: Child) -> Self {
        finish(tool)
    }
}

fn target_directory() -> PathBuf {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| workspace.join("target"), PathBuf::from)
}
