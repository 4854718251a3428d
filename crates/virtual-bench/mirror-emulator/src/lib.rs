//! An emulated board for a person: one command of the host tool against it, or a terminal to type them in.

mod around;
mod terminal;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{self, Command, ExitCode};
use std::time::Instant;

use anyhow::{Result, anyhow, ensure};
use board_on_host::BoardOnHost;
use board_sockets::boards_directory;
use emulated_board::{
    Connected, Controls, EmulatedBoard, Emulation, Speed, Surroundings, private_directory,
};
use quantities::{TemperatureRise, in_unit};
use silicon_twin::served::{ServedTwin, Serving};
use virtual_mirror::MirrorConfig;

use crate::around::Around;
use crate::terminal::Terminal;

/// What a shell says of a process that Ctrl-C ended: 128 and the signal's number.
const INTERRUPTED: i32 = 130;

/// What went wrong and why, in a line: a cause that what stands before it says already is not said again.
pub fn told(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |told, cause| {
        let cause = cause.to_string();
        match told.is_empty() {
            true => cause,
            false if told.contains(&cause) => told,
            false => format!("{told}: {cause}"),
        }
    })
}

/// An emulated board, and what to do with it.
#[derive(clap::Args)]
pub struct Arguments {
    /// Which board: `mps2`, the firmware on another chip in QEMU; `host`, the firmware compiled for this machine, which needs
    /// no QEMU and is several times as fast; or `g474`, the flashed image on the silicon twin.
    #[arg(long, default_value = "mps2")]
    pub board: Emulator,
    /// The mirror on the board, a TOML file; without it the project's own.
    #[arg(long)]
    mirror: Option<PathBuf>,
    /// The board's name among those that run; without it `emulated`, or `silicon-twin`.
    #[arg(long)]
    name: Option<String>,
    /// How fast its clock goes: `max`, or so many times as fast as the wall's, 1 to 1000. Without it, as fast as it
    /// can while a host tool waits for it, and with the wall's otherwise.
    #[arg(long, value_name = "N|max")]
    speed: Option<Speed>,
    /// How much warmer the mirror's room is than where it was calibrated: `10` or `10K`.
    #[arg(long, value_name = "KELVIN", value_parser = kelvin, allow_hyphen_values = true)]
    room: Option<f64>,
    /// Keep the board's flash in this file, made where it is missing: its calibration and its fault log outlive it. The silicon
    /// twin keeps none.
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// Print the firmware's log at the end.
    #[arg(long)]
    log: bool,
    /// What to say to the host tool, for example `set-z 120um`.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    command: Vec<String>,
}

/// What runs the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Emulator {
    /// MPS2-AN386 in QEMU.
    Mps2,
    /// This machine.
    Host,
    /// The driver board's chip at register level.
    G474,
}

/// A board that runs.
enum Running {
    Mps2(EmulatedBoard),
    Host(BoardOnHost),
    G474(ServedTwin),
}

impl Running {
    fn socket(&self) -> &Path {
        match self {
            Self::Mps2(board) => board.socket(),
            Self::Host(board) => board.socket(),
            Self::G474(twin) => twin.socket(),
        }
    }

    fn simulated_s(&self) -> f64 {
        match self {
            Self::Mps2(board) => board.simulated_s(),
            Self::Host(board) => board.simulated_s(),
            Self::G474(twin) => twin.simulated_s(),
        }
    }

    /// Files that go with it: of the emulator's process, where there is one.
    fn files(&self) -> &Path {
        match self {
            Self::Mps2(board) => board.directory(),
            Self::Host(board) => board.socket(),
            Self::G474(twin) => twin.socket(),
        }
    }

    /// Why it ended, if it did.
    fn end(&mut self) -> Result<Option<String>> {
        Ok(match self {
            Self::Mps2(board) => board.exit_status()?.map(|status| status.to_string()),
            Self::Host(board) => board.has_ended().then(|| "see above".to_owned()),
            Self::G474(twin) => twin.failure(),
        })
    }

    fn log(&self) -> Vec<String> {
        match self {
            Self::Mps2(board) => board.log(),
            // Its log goes nowhere.
            Self::Host(_) => Vec::new(),
            Self::G474(twin) => twin.log().unwrap_or_default(),
        }
    }

    fn controls(&self) -> &Controls {
        match self {
            Self::Mps2(board) => board.controls(),
            Self::Host(board) => board.controls(),
            Self::G474(twin) => twin.controls(),
        }
    }
}

/// Starts a board, its image where it needs one by that one's name, and has `host_tool`, a program, carry out one command on
/// it, or those that are typed until the input ends.
///
/// # Errors
/// Where the board does not start, or ends by itself.
pub fn run(
    arguments: &Arguments,
    image: impl FnOnce(&str) -> Result<PathBuf>,
    host_tool: &Path,
) -> Result<ExitCode> {
    // A board for one command is nobody else's business.
    let private = private_directory()?;
    let directory = match arguments.command.is_empty() {
        true => boards_directory(),
        false => private.path().to_owned(),
    };
    let mut board = start(arguments, image, directory)?;
    tidy_up_when_interrupted([board.socket(), board.files(), private.path()])?;
    let started = Instant::now();
    let before = board.simulated_s();
    let code = if arguments.command.is_empty() {
        converse(&mut board, host_tool)?
    } else {
        carry_out(&arguments.command, host_tool, &board)?
    };
    let (simulated, wall) = (
        board.simulated_s() - before,
        started.elapsed().as_secs_f64(),
    );
    eprintln!(
        "Emulated {simulated:.2} s of control ticks in {wall:.2} s: {:.1} times real time.",
        simulated / wall
    );
    if arguments.log {
        print_log(&board);
    }
    Ok(code)
}

fn start(
    arguments: &Arguments,
    image: impl FnOnce(&str) -> Result<PathBuf>,
    boards_directory: PathBuf,
) -> Result<Running> {
    ensure!(
        arguments.flash.is_none() || arguments.board != Emulator::G474,
        "the silicon twin keeps its flash in no file; leave --flash out, or take `--board host` or `--board mps2`"
    );
    let mirror = match &arguments.mirror {
        Some(path) => MirrorConfig::from_file(path)?,
        None => MirrorConfig::bench(),
    };
    let around = Surroundings {
        oven_c: arguments.room.map(|rise_k| mirror.ambient_c + rise_k),
        ..Surroundings::default()
    };
    let connected = Connected::Mirror(Box::new(mirror));
    let name = arguments.name.clone().unwrap_or_else(|| {
        let name = match arguments.board {
            Emulator::Mps2 | Emulator::Host => "emulated",
            Emulator::G474 => "silicon-twin",
        };
        name.to_owned()
    });
    let speed = arguments.speed.unwrap_or_default();
    Ok(match arguments.board {
        Emulator::Mps2 => Running::Mps2(EmulatedBoard::start(&Emulation {
            image: image("mps2")?,
            connected,
            around,
            boards_directory,
            name,
            flash: arguments.flash.clone(),
            speed,
            has_monitor: false,
        })?),
        Emulator::Host => Running::Host(BoardOnHost::start(&board_on_host::Serving {
            connected,
            around,
            boards_directory,
            name,
            flash: arguments.flash.clone(),
            speed,
        })?),
        Emulator::G474 => Running::G474(ServedTwin::start(&Serving {
            image: image("stm32g474")?,
            connected,
            around,
            boards_directory,
            name,
            speed,
        })?),
    })
}

/// How far from that of the calibration a room may be (K): from -40 to 85 degC, the industrial range, around a laboratory's 22.
const FARTHEST_K: f64 = 63.0;

/// So many kelvins, with or without their unit.
fn kelvin(text: &str) -> Result<f64, String> {
    let TemperatureRise { k } = in_unit(text, "K").map_err(|error| error.to_string())?;
    let is_a_room = k.abs() <= FARTHEST_K;
    is_a_room.then_some(k).ok_or_else(|| {
        format!("no board is used in such a room: at most {FARTHEST_K} K warmer or colder")
    })
}

/// Ctrl-C ends this process where it stands. The emulator ends by itself, as its plant is gone; the
/// files are removed here.
fn tidy_up_when_interrupted(leftovers: [&Path; 3]) -> Result<()> {
    let leftovers = leftovers.map(Path::to_owned);
    ctrlc::set_handler(move || {
        if terminal::is_interrupt_for_command() {
            return;
        }
        for path in &leftovers {
            // A file or a directory, and perhaps gone already.
            let _ = fs::remove_file(path);
            let _ = fs::remove_dir_all(path);
        }
        process::exit(INTERRUPTED);
    })?;
    Ok(())
}

/// Has the host tool carry out a command on `board`.
fn carry_out(words: &[String], host_tool: &Path, board: &Running) -> Result<ExitCode> {
    let status = Command::new(host_tool)
        .args(words)
        .env("MIRROR_BOARD", board.socket())
        .status()
        .map_err(|error| {
            anyhow!(
                "{} does not run, {error}: unpack the package whole, or install it anew",
                host_tool.display()
            )
        })?;
    Ok(ExitCode::from(status.code().map_or(1, |code| code as u8)))
}

fn print_log(board: &Running) {
    for line in board.log() {
        eprintln!("firmware: {line}");
    }
}

/// Takes commands from a person until they are done.
fn converse(board: &mut Running, host_tool: &Path) -> Result<ExitCode> {
    println!("The board is up as {}.", board.socket().display());
    println!("Type what you would say to host-tool, for example `set-z 120um`; `quit` ends it.");
    println!("Any host-tool in another terminal finds the board too.");
    if !matches!(board, Running::G474(_)) {
        println!(
            "`spot X Y` moves the position sensor's spot on the plate, `stage UM` the mirror under it, in micrometres;"
        );
    }
    println!(
        "`oven CELSIUS` brings the mirror to another room, `air FACTOR` lets the air take more of its heat."
    );
    let mut terminal = Terminal::open()?;
    while let Some(words) = terminal.read()? {
        match (words.first().map(String::as_str), Around::asked(&words)) {
            (None, _) => {}
            (Some("quit" | "exit"), _) => break,
            (_, Some(Ok(around))) => {
                around.bring(board.controls());
                println!("{around}");
            }
            (_, Some(Err(how))) => println!("{how}"),
            // What went wrong has been said; the next command may go better.
            _ => drop(terminal.meanwhile(|| carry_out(&words, host_tool, board))?),
        }
        if let Some(reason) = board.end()? {
            print_log(board);
            anyhow::bail!("the emulated board ended ({reason})");
        }
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use emulated_board::StartError;

    use super::*;

    #[test]
    fn what_keeps_no_flash_says_so() {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: Arguments,
        }
        let words = ["emulate", "--board", "g474", "--flash", "board.flash"];
        let Line { arguments } = clap::Parser::parse_from(words);
        let refused = start(
            &arguments,
            |_| unreachable!("nothing is started"),
            "/".into(),
        );
        let said = refused.err().expect("it keeps none").to_string();
        assert!(said.contains("--board host"), "{said}");
    }

    #[test]
    fn a_cause_is_told_once() {
        let cause = || std::io::Error::from_raw_os_error(2);
        let error = anyhow::Error::from(StartError::Files(cause()));
        assert_eq!(told(&error), error.to_string());
        let error = anyhow::Error::from(cause()).context("the tool does not run");
        assert_eq!(
            told(&error),
            "the tool does not run: No such file or directory (os error 2)"
        );
    }

    #[test]
    fn a_room_is_so_many_kelvins_that_a_board_may_be_in() {
        for (text, expected) in [("10", 10.0), ("-12K", -12.0), ("9.5 K", 9.5), ("63", 63.0)] {
            assert_eq!(kelvin(text), Ok(expected));
        }
        for text in ["warm", "nan", "inf", "-400K", "63.1", "10degC", ""] {
            assert!(kelvin(text).is_err(), "{text}");
        }
    }
}
