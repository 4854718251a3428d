//! The host tool against an emulated board.

use std::fs;
use std::io::{self, BufRead, Write};
use std::path::{Path, PathBuf};
use std::process::{self, ExitCode};
use std::time::Instant;

use anyhow::{Context, Result};
use board_sockets::boards_directory;
use emulated_board::{Connected, EmulatedBoard, Emulation, Speed, private_directory};
use virtual_mirror::MirrorConfig;

use xtask::images::{self, Board};
use xtask::setup;
use xtask::tool;

/// What a shell says of a process that Ctrl-C ended: 128 and the signal's number.
const INTERRUPTED: i32 = 130;

/// An emulated board, and what to do with it.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The mirror on the board, a TOML file; without it the project's own.
    #[arg(long)]
    mirror: Option<PathBuf>,
    /// The board's name among those that run.
    #[arg(long, default_value = "emulated")]
    name: String,
    /// How fast its clock goes: `max`, or so many times as fast as the wall's, 1 to 1000. Without it, as fast as it
    /// can while a host tool is connected, and with the wall's otherwise.
    #[arg(long, value_name = "N|max")]
    speed: Option<Speed>,
    /// Print the firmware's log at the end.
    #[arg(long)]
    log: bool,
    /// What to say to the host tool, for example `set-z 120um`.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    command: Vec<String>,
}

/// Runs one command, or reads commands until the input ends.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    // A board for one command is nobody else's business.
    let private = private_directory()?;
    let directory = match arguments.command.is_empty() {
        true => boards_directory(),
        false => private.path().to_owned(),
    };
    let mut board = start(arguments, directory)?;
    tidy_up_when_interrupted([board.socket(), board.directory(), private.path()])?;
    let started = Instant::now();
    let before = board.simulated_s();
    let code = if arguments.command.is_empty() {
        converse(&mut board)?
    } else {
        host_tool(&board, &arguments.command)?
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

fn start(arguments: &Arguments, boards_directory: PathBuf) -> Result<EmulatedBoard> {
    setup::qemu()?;
    let image = images::build(Board::Mps2)?;
    let mirror = match &arguments.mirror {
        Some(path) => MirrorConfig::from_file(path)?,
        None => MirrorConfig::bench(),
    };
    let emulation = Emulation {
        image,
        connected: Connected::Mirror(Box::new(mirror)),
        boards_directory,
        name: arguments.name.clone(),
        flash: None,
        speed: arguments.speed.unwrap_or_default(),
        has_monitor: false,
    };
    Ok(EmulatedBoard::start(&emulation)?)
}

/// Ctrl-C ends this process where it stands. The emulator ends by itself, as its plant is gone; the
/// files are removed here.
fn tidy_up_when_interrupted(leftovers: [&Path; 3]) -> Result<()> {
    let leftovers = leftovers.map(Path::to_owned);
    ctrlc::set_handler(move || {
        for path in &leftovers {
            // A file or a directory, and perhaps gone already.
            let _ = fs::remove_file(path);
            let _ = fs::remove_dir_all(path);
        }
        process::exit(INTERRUPTED);
    })?;
    Ok(())
}

/// Runs the host tool against `board`.
fn host_tool(board: &EmulatedBoard, words: &[String]) -> Result<ExitCode> {
    let status = tool::command()
        .args(words)
        .env("MIRROR_BOARD", board.socket())
        .status()
        .context("the host tool does not run")?;
    Ok(ExitCode::from(status.code().map_or(1, |code| code as u8)))
}

fn print_log(board: &EmulatedBoard) {
    for line in board.log() {
        eprintln!("firmware: {line}");
    }
}

/// Takes commands from a person until they are done.
fn converse(board: &mut EmulatedBoard) -> Result<ExitCode> {
    println!("The board is up as {}.", board.socket().display());
    println!("Type what you would say to host-tool, for example `set-z 120um`; `quit` ends it.");
    println!("Any host-tool in another terminal finds the board too.");
    println!(
        "`spot X Y` moves the position sensor's spot on the plate, `stage UM` the mirror under it, in micrometres;"
    );
    println!("`oven CELSIUS` brings the mirror to another temperature.");
    let mut lines = io::stdin().lock().lines();
    loop {
        print!("host-tool> ");
        io::stdout().flush()?;
        let Some(line) = lines.next().transpose()? else {
            break;
        };
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        match words.first().map(String::as_str) {
            None => {}
            Some("quit" | "exit") => break,
            Some("spot") => match numbers(&words[1..]) {
                Some(at_um) => board.move_spot(at_um),
                None => println!("`spot X Y`: two numbers of micrometres from the plate's centre"),
            },
            Some("stage") => match numbers(&words[1..]) {
                Some([um]) => board.move_stage(um),
                None => println!("`stage UM`: a number of micrometres, towards the substrate"),
            },
            Some("oven") => match numbers(&words[1..]) {
                Some([celsius]) => board.set_oven(celsius),
                None => println!("`oven CELSIUS`: a number of degrees"),
            },
            // What went wrong has been said; the next command may go better.
            Some(_) => drop(host_tool(board, &words)?),
        }
        if let Some(status) = board.exit_status()? {
            print_log(board);
            anyhow::bail!("the emulated board ended ({status})");
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// So many numbers.
fn numbers<const N: usize>(words: &[String]) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok()
}
