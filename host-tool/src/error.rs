//! What can go wrong, in words: what happened, and what to do next.

mod beyond_board;
mod doubt;
mod input;
mod no_resistor;
mod not_improved;
mod output;
mod play;
mod refusal;
mod sensor;

use std::io;
use std::path::PathBuf;

use calibration_procedure::{Doubt, Drift, SensorError, TravelError};
use control_core::calibration::Label;
use mirror_protocol::{PROTOCOL_VERSION, Refusal};
use quantities::{Hold, Span};

pub use self::beyond_board::BeyondBoard;
use self::doubt::{doubt_advice, drift_advice};
pub use self::input::UnusableInput;
pub use self::no_resistor::NoResistor;
pub use self::not_improved::NotImproved;
pub use self::output::{CalibrationText, OutputError};
use self::refusal::{fault_advice, refusal_advice, refusal_words, update_advice};
pub use self::sensor::SensorFault;
use self::sensor::sensor_advice;
use crate::names::fault_name;
use crate::update::package::PackageError;
use crate::update::target::Undecided;

/// A failure of the tool.
#[derive(Debug, thiserror::Error, miette::Diagnostic, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[expect(missing_docs, reason = "each message says what its fields are")]
pub enum ToolError {
    #[error("a hold of {hold} is longer than this bench allows, {longest}")]
    #[diagnostic(help(
        "ask for a shorter --hold; whoever runs the bench sets the longest by MIRROR_LONGEST_HOLD"
    ))]
    HoldTooLong { hold: Hold, longest: Hold },

    #[error(
        "settling for {settle} and then holding for {hold} drives the board for longer than this bench allows, {longest}"
    )]
    #[diagnostic(help(
        "ask for a shorter --settle; whoever runs the bench sets the longest by MIRROR_LONGEST_HOLD"
    ))]
    DrivenTooLong {
        settle: Span,
        hold: Span,
        longest: Hold,
    },

    #[error("this scan drives the mirror for {lasts}, longer than this bench allows, {longest}")]
    #[diagnostic(help(
        "ask for a shorter one, by fewer --cycles for instance; whoever runs the bench sets the longest by MIRROR_LONGEST_HOLD"
    ))]
    ScanTooLong { lasts: Span, longest: Hold },

    #[error("the board was turned off by `host-tool off` meanwhile, and drives nothing")]
    #[diagnostic(help("ask again, if the mirror is to move after all"))]
    TurnedOff,

    #[error(
        "the board had ramped to zero before the mirror was read: it was to be held for {hold}"
    )]
    #[diagnostic(help("ask for a longer hold: --hold {}s", longer_s(*hold)))]
    HeldTooShortly { hold: Hold },

    #[error("no board was found")]
    #[diagnostic(help(
        "connect a driver board by USB, or try everything without one: \
         `cargo xtask emulate` keeps an emulated board up. `host-tool doctor` tells why one is not found"
    ))]
    NoBoard,

    #[error("{} is not written to the board: {error}", path.display())]
    #[diagnostic(help("nothing was changed; build it with `cargo xtask build stm32g474`"))]
    Image { path: PathBuf, error: PackageError },

    #[error("the board left for its bootloader and did not show up there")]
    #[diagnostic(help(
        "unplug it, set the BOOT0 jumper, plug it in again, and update again; `host-tool doctor` shows \
         whether it is there"
    ))]
    NoBootloader,

    #[error("{0}; nothing was changed")]
    #[diagnostic(help(
        "name the board with --board NAME, by its own serial number or its bootloader's, or unplug all the others; \
         `host-tool doctor` shows what is there"
    ))]
    Undecided(#[from] Undecided),

    #[error("the update stopped: {0}")]
    #[diagnostic(help(
        "the board is in its bootloader and its outputs are off: update again. If it lost its power \
         in between, set the BOOT0 jumper, plug it in, update, and take the jumper out"
    ))]
    Update(#[from] crate::update::dfuse::UpdateError),

    #[error("no board is ready to be used")]
    #[diagnostic(help("do what is said above, and ask again"))]
    NoBoardReady,

    #[error("there is no board `{name}`; found: {found}{}", did_you_mean(nearest.as_deref()))]
    #[diagnostic(help("name one of them, or leave out --board and MIRROR_BOARD"))]
    NoSuchBoard {
        name: String,
        found: String,
        nearest: Option<String>,
    },

    #[error("there are several boards: {found}")]
    #[diagnostic(help("choose one with --board NAME, or set MIRROR_BOARD"))]
    SeveralBoards { found: String },

    #[error("the board {board} cannot be opened: {reason}")]
    #[diagnostic(help(
        "is it still there, is another program using it, and may you access it? `host-tool doctor` \
         tells"
    ))]
    Open { board: String, reason: String },

    #[error("an emulated board is not used: {0}")]
    #[diagnostic(help(
        "other users could answer in its place, or command it. Start it again in a folder that nobody else \
         writes to (`chmod 700` makes it so; MIRROR_BOARDS names another), and as the user who uses it"
    ))]
    Untrusted(#[from] board_sockets::Untrusted),

    #[error("the board {board} is in use by {owner}")]
    #[diagnostic(help(
        "wait until that has ended, or end it with Ctrl-C where it runs; `host-tool off` turns the channels off \
          whoever has the board"
    ))]
    InUse { board: String, owner: String },

    #[error(
        "the board {board} was turned off by `host-tool off` while this waited for it; it is left alone"
    )]
    #[diagnostic(help("ask again, if it is to be done after all"))]
    StoppedMeanwhile { board: String },

    #[error("the connection to the board was lost while asking it to {request}")]
    #[diagnostic(help(
        "it was unplugged, reset, or its emulator ended; `host-tool list` shows what is there now"
    ))]
    LinkLost { request: &'static str },

    #[error("the board did not answer in {seconds} s when asked to {request}")]
    #[diagnostic(help(
        "is another program connected to it? If not, unplug it and plug it in again, or restart \
         its emulator"
    ))]
    NoAnswer { request: &'static str, seconds: f64 },

    #[error("the board did not understand the request to {request} ({detail})")]
    #[diagnostic(help(
        "the link is disturbed, or the firmware is not this tool's; try again once"
    ))]
    NotUnderstood {
        request: &'static str,
        detail: String,
    },

    #[error("the board speaks protocol version {board}, this tool version {PROTOCOL_VERSION}")]
    #[diagnostic(help("{}", update_advice(*board)))]
    ProtocolVersion { board: u16 },

    #[error("channel {channel} has turned the board off: {}", fault_name(*fault))]
    #[diagnostic(help("{}", fault_advice(*fault)))]
    Tripped { channel: usize, fault: u8 },

    #[error("clearing has not helped: channel {channel} has turned the board off again, {}", fault_name(*fault))]
    #[diagnostic(help(
        "what caused it is there still: `host-tool explain {}` tells cause and remedy. Clear it once more after that",
        fault_name(*fault)
    ))]
    TrippedAgain { channel: usize, fault: u8 },

    #[error("the board refused to {request}: {}", refusal_words(*refusal))]
    #[diagnostic(help("{}", refusal_advice(*refusal)))]
    Refused {
        request: &'static str,
        refusal: Refusal,
    },

    #[error("the board keeps its calibration: the one it was sent cannot be used, {reason}")]
    #[diagnostic(help("calibrate the mirror again with this version of the tool"))]
    CalibrationRefused { reason: String },

    #[error("the board stopped counting control ticks")]
    #[diagnostic(help("reset the board, or restart its emulator"))]
    ControlStopped,

    #[error("the input ended before the scan was complete; channels are off")]
    #[diagnostic(help(
        "answer every question with Enter, or give as many lines on the standard input"
    ))]
    InputEnded,

    #[error("`{address}` cannot be listened on: {source}")]
    #[diagnostic(help("{}", listen_help(source.kind())))]
    Listen { address: String, source: io::Error },

    #[error("interrupted; the recording holds what came, and the board goes on with what it does")]
    #[diagnostic(help("`host-tool off` turns its channels off"))]
    RecordingInterrupted,

    #[error("interrupted; channels are off")]
    #[diagnostic(help(
        "what was measured so far is kept, and the board has the calibration that it had"
    ))]
    Interrupted,

    #[error("interrupted; channels are off")]
    #[diagnostic(help(
        "nothing of it is kept, and the board has the calibration that it had{next}"
    ))]
    InterruptedUnkept { next: &'static str },

    #[error("interrupted before it was done; no file is written")]
    #[diagnostic(help(
        "the same command begins anew; null ensembles that it drew are kept for the next time"
    ))]
    WorkInterrupted,

    #[error("--json and `-o -` both want the standard output")]
    #[diagnostic(help(
        "leave one of them out; without --json, what was recorded is told on standard error"
    ))]
    OutputTwice,

    #[error("the live view needs a terminal")]
    #[diagnostic(help(
        "`host-tool status` shows the board once, and `host-tool record` keeps what it measures in a file"
    ))]
    NoTerminal,

    #[error("the terminal cannot be used any more: {0}")]
    #[diagnostic(help("channels that this view drove are off, or ramp to zero within 0.2 s"))]
    Terminal(io::Error),

    #[error("samples cannot be sent to `{address}`: {source}")]
    #[diagnostic(help("write an address and a port: --plotjuggler 127.0.0.1:9870"))]
    Address { address: String, source: io::Error },

    #[error("ended by {signal}; {outputs}")]
    #[diagnostic(help("`host-tool monitor` begins again"))]
    EndedBySignal {
        signal: &'static str,
        number: u8,
        outputs: &'static str,
    },

    #[error("interrupted; the board is driven on: {hold}")]
    #[diagnostic(help("`host-tool off` turns its channels off"))]
    StillDriven { hold: String },

    #[error(
        "interrupted before the board answered; where it took the command, it is driven: {hold}"
    )]
    #[diagnostic(help("`host-tool off` turns its channels off"))]
    PerhapsDriven { hold: String },

    #[error("{reason}; the board could not be told to go back to the calibration that it had")]
    #[diagnostic(help(
        "turn the board off and on, or begin `host-tool calibrate` again: either brings it back"
    ))]
    TrialLeft { reason: String },

    #[error(transparent)]
    #[diagnostic(help("nothing was changed; the readings of the first room are kept"))]
    Ambient(#[from] calibration::AmbientError),

    #[error(transparent)]
    #[diagnostic(help(
        "nothing was changed. Spots that were read are kept: remove the file of one that was read at another place than it says, and ask again"
    ))]
    Pose(#[from] calibration::PoseError),

    #[error(transparent)]
    #[diagnostic(help(
        "nothing was changed. Look whether the table has micrometres and degrees, counted from this mirror's rest about axes that the board has, \
         and was read after `host-tool room off`, for a room that the board compensates meanwhile moves the plate, and ask again"
    ))]
    PosesOfTable(calibration::PoseError),

    #[error("'{name}' is no name for a calibration, which holds one of up to {max} bytes without control characters", max = Label::CAPACITY)]
    #[diagnostic(help("choose another name with --device"))]
    Name { name: String },

    #[error("{what} ended in a defect of this tool")]
    #[diagnostic(help("please report it with what was printed above"))]
    Defect { what: &'static str },

    #[error(transparent)]
    #[diagnostic(help(
        "compare the identified model with the measurements: `host-tool identify`, `host-tool compare`"
    ))]
    Tabulate(#[from] calibration::TabulateError),

    #[error(transparent)]
    #[diagnostic(help(
        "in this order: is the sensor looking at the mirror, and does the mirror move? Is the sensor late, as one is that averages? Name with \
         --sensor-lag by how much, and calibrate again. Did room or air change meanwhile? Calibrate again where both stay as they are"
    ))]
    Refine(#[from] calibration::RefineError),

    #[error(transparent)]
    #[diagnostic(help("is the sensor looking at the mirror, and does the mirror move?"))]
    Correction(#[from] calibration::CorrectionError),

    #[error(transparent)]
    #[diagnostic(help("{}", sensor_advice(_0)))]
    SensorReadings(#[from] SensorError),

    #[error(transparent)]
    #[diagnostic(help(
        "have it count upwards and in micrometres, with its spot on the plate and its range from below the mirror's rest to beyond its highest \
         drive, and calibrate again. The board has the calibration of before"
    ))]
    SensorTravel(#[from] TravelError),

    #[error("{0}; the board has the calibration of before")]
    #[diagnostic(help("{}", drift_advice(_0)))]
    Drift(#[from] Drift),

    #[error("{0}; the board has the one before")]
    #[diagnostic(help("{}", doubt_advice(_0)))]
    Doubt(#[from] Doubt),

    #[error("{received} of {expected} samples arrived")]
    #[diagnostic(help("the samples that arrived were kept; a longer --period eases the link"))]
    SamplesLost { received: usize, expected: usize },

    #[error(transparent)]
    #[diagnostic(transparent)]
    Measurement(#[from] measurement::InputError),

    #[error(transparent)]
    #[diagnostic(transparent)]
    Calibration(#[from] calibration::CalibrationFileError),

    #[error(transparent)]
    #[diagnostic(transparent)]
    Model(#[from] mirror_model::ModelFileError),

    #[error(transparent)]
    #[diagnostic(transparent)]
    Formula(#[from] mirror_model::effect::FormulaError),

    #[error("{}: {reason}", file.display())]
    #[diagnostic(forward(reason))]
    Import {
        file: PathBuf,
        reason: measurement::import::ImportError,
    },

    #[error(transparent)]
    #[diagnostic(transparent)]
    Edit(#[from] diagnosis::EditError),

    #[error(transparent)]
    #[diagnostic(help(
        "its parameters do not go with these measurements; start from another model"
    ))]
    Runaway(#[from] mirror_model::Runaway),

    #[error("there is no fault, limit, effect or word of a diagnosis `{name}`{}", did_you_mean(nearest.as_deref()))]
    #[diagnostic(help("`host-tool explain` shows those there are"))]
    NoSuchFault {
        name: String,
        nearest: Option<String>,
    },

    #[error("there is no model `{name}`{}", did_you_mean(nearest.as_deref()))]
    #[diagnostic(help("use a preset ({presets}) or the path of a model file"))]
    NoSuchModel {
        name: String,
        nearest: Option<String>,
        presets: String,
    },

    #[error("there is no effect `{id}`{}", did_you_mean(nearest.as_deref()))]
    #[diagnostic(help(
        "`host-tool effect list` shows those there are; a file of your own ends in .toml"
    ))]
    NoSuchEffect { id: String, nearest: Option<String> },

    #[error(transparent)]
    #[diagnostic(transparent)]
    File(#[from] input_file::ReadError),

    #[error("{} says other than this run: {count} of what it holds came out otherwise", path.display())]
    #[diagnostic(help(
        "{}",
        if version == env!("CARGO_PKG_VERSION") {
            "the page was changed after it was written, or this tool was; write it anew with `host-tool report`".to_owned()
        } else {
            format!("it was written by version {version} of this tool; replay it with that one")
        }
    ))]
    ReplayDiffers {
        path: PathBuf,
        count: usize,
        version: String,
    },

    #[error("the tool's own runtime does not start: {0}")]
    #[diagnostic(help("is the system out of memory or file handles?"))]
    Runtime(io::Error),

    #[error(transparent)]
    #[diagnostic(transparent)]
    BeyondBoard(#[from] BeyondBoard),

    #[error(transparent)]
    #[diagnostic(transparent)]
    UnusableInput(#[from] UnusableInput),

    #[error(transparent)]
    #[diagnostic(transparent)]
    Output(#[from] OutputError),

    #[error(transparent)]
    #[diagnostic(transparent)]
    NoResistor(#[from] NoResistor),

    #[error(transparent)]
    #[diagnostic(transparent)]
    NotImproved(#[from] NotImproved),

    #[error(transparent)]
    #[diagnostic(transparent)]
    SensorFault(#[from] SensorFault),
}

fn listen_help(kind: io::ErrorKind) -> &'static str {
    match kind {
        io::ErrorKind::AddrInUse => {
            "is another `host-tool serve` or another program on that port? Choose one with --listen 127.0.0.1:PORT; \
             port 0 is any that is free"
        }
        io::ErrorKind::AddrNotAvailable => {
            "this machine has no such address: 127.0.0.1 is reached by itself alone, and 0.0.0.0 is all that it has"
        }
        io::ErrorKind::PermissionDenied => {
            "ports below 1024 are the system's on most machines; choose one above"
        }
        _ => "write an address of this machine and a port: --listen 127.0.0.1:5025",
    }
}

/// A hold that is longer, and long for a busy machine (s).
fn longer_s(hold: Hold) -> f64 {
    const LONG_S: f64 = 10.0;
    match hold {
        Hold::For(hold) => LONG_S.max(2.0 * hold.s),
        Hold::Forever => LONG_S,
    }
}

fn did_you_mean(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

impl ToolError {
    /// The exit code of what a signal ended is this and the signal's number, as shells have it.
    const BY_SIGNAL: u8 = 128;
    /// The exit code of what Ctrl-C ended.
    const BY_INTERRUPT: u8 = Self::BY_SIGNAL + 2;

    /// What scripts know it by.
    pub fn code(&self) -> &'static str {
        match self {
            Self::BeyondBoard(error) => error.into(),
            Self::UnusableInput(error) => error.into(),
            Self::Output(error) => error.into(),
            Self::NoResistor(error) => error.into(),
            Self::NotImproved(error) => error.into(),
            Self::SensorFault(error) => error.into(),
            other => other.into(),
        }
    }

    /// Whether the board is not there, or not in a state to be asked anything: it may be there again later.
    pub(crate) fn is_of_missing_board(&self) -> bool {
        matches!(
            self,
            Self::NoBoard
                | Self::NoSuchBoard { .. }
                | Self::SeveralBoards { .. }
                | Self::Open { .. }
                | Self::Untrusted(_)
                | Self::LinkLost { .. }
                | Self::NoAnswer { .. }
                | Self::ControlStopped
                | Self::ProtocolVersion { .. }
        )
    }

    /// What the tool ends with.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Interrupted
            | Self::InterruptedUnkept { .. }
            | Self::RecordingInterrupted
            | Self::WorkInterrupted
            | Self::StillDriven { .. }
            | Self::PerhapsDriven { .. } => Self::BY_INTERRUPT,
            Self::EndedBySignal { number, .. } => Self::BY_SIGNAL + number,
            _ => 1,
        }
    }
}
