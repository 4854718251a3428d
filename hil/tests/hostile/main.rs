//! Clients that mean harm, or are broken, on an emulated board's socket, beside ordinary commands on the same connection,
//! on new ones, by the tool, and by the second way to stop. It prints how many there were of each, what failed, and the
//! slowest answer; it fails where a command has failed or took longer than a second.
//!
//! On a busy machine board and plant wait for a processor at every tick, for as long as others have it. There ticks are
//! counted instead, from the request to its answer, at what each takes on an idle machine; the wall's time is printed, and
//! counts only where nothing else wanted a processor.
//!
//! Some seconds long; ten minutes where a long run asks for what is long.

mod attacks;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use hil::{Bench, RawLink};
use host_tool::board::{Found, Place, stop};
use mirror_protocol::{
    ClearEndpoint, Drives, OffEndpoint, PROTOCOL_VERSION, SetDriveEndpoint, StatusEndpoint,
    WireError,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use virtual_mirror::MirrorConfig;

use crate::attacks::ATTACKS;

const LASTS: Duration = Duration::from_secs(6);
const LASTS_IN_FULL: Duration = Duration::from_secs(600);
/// What an emulated tick takes on an idle machine: it goes three times as fast as the wall's clock there
/// (`docs/figures/board.md`).
const TICK_TAKES: Duration = Duration::from_micros(33);
const SLOWEST: Duration = Duration::from_secs(1);
const SEED: u64 = 20_261_122;
/// From one stop to the next.
const STOP_EVERY: Duration = Duration::from_millis(200);
/// A board that lets nobody in for so long never will.
const HANGS: Duration = Duration::from_secs(60);
/// The tool is started after so many disturbances.
const TOOL_EVERY: u64 = 20;

/// What came of it so far.
#[derive(Default)]
struct Tally {
    disturbances: u64,
    commands: u64,
    failures: Vec<String>,
    /// By the wall, and by the board's ticks.
    slowest: (Duration, String),
    slowest_by_ticks: (Duration, String),
    /// The most processes that wanted a processor, for each that there is.
    load: f64,
}

impl Tally {
    /// Notes a command, what came before it, how long it took, and whether it was answered as it should be.
    fn command(&mut self, what: String, begun: &Begun<'_>, answered: Result<(), String>) {
        let took = begun.wall.elapsed();
        let by_ticks = begun.by_ticks();
        self.commands += 1;
        self.load = self.load.max(load());
        if let Err(why) = answered {
            self.failures.push(format!("{what}: {why}"));
        }
        if by_ticks > self.slowest_by_ticks.0 {
            self.slowest_by_ticks = (by_ticks, what.clone());
        }
        if took > self.slowest.0 {
            self.slowest = (took, what);
        }
    }
}

/// When a command was begun.
struct Begun<'a> {
    bench: &'a Bench,
    wall: Instant,
    exchanges: u64,
}

impl<'a> Begun<'a> {
    fn now(bench: &'a Bench) -> Self {
        Self {
            bench,
            wall: Instant::now(),
            exchanges: bench.exchanges(),
        }
    }

    /// How long an idle machine takes for as many ticks as there were since.
    fn by_ticks(&self) -> Duration {
        let ticks = self.bench.exchanges() - self.exchanges;
        TICK_TAKES.mul_f64(ticks as f64)
    }
}

/// Processes that want a processor in the mean of the last minute, for each processor.
fn load() -> f64 {
    let told = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let wanted: f64 = told
        .split(' ')
        .next()
        .and_then(|word| word.parse().ok())
        .unwrap_or(0.0);
    let processors = thread::available_parallelism().map_or(1, usize::from);
    wanted / processors as f64
}

fn main() -> ExitCode {
    let lasts = if long_runs::are_asked_for() {
        LASTS_IN_FULL
    } else {
        LASTS
    };
    let bench = Bench::emulated(MirrorConfig::bench());
    let tally = Mutex::new(Tally::default());
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| stop_again_and_again(&bench, &tally, &is_over));
        scope.spawn(|| give_up(&tally, &is_over));
        attack(&bench, &tally, lasts);
        is_over.store(true, Ordering::Relaxed);
    });
    let tally = tally.into_inner().expect("no panic");
    println!(
        "\n{} s: {} disturbances beside {} commands, {} failures; slowest answer {:.2} s ({}), by the board's ticks {:.2} s ({}); \
         load {:.1}",
        lasts.as_secs(),
        tally.disturbances,
        tally.commands,
        tally.failures.len(),
        tally.slowest.0.as_secs_f64(),
        tally.slowest.1,
        tally.slowest_by_ticks.0.as_secs_f64(),
        tally.slowest_by_ticks.1,
        tally.load,
    );
    for failure in tally.failures.iter().take(20) {
        println!("failed: {failure}");
    }
    let is_quick =
        tally.slowest_by_ticks.0 < SLOWEST && (tally.load > 1.0 || tally.slowest.0 < SLOWEST);
    if tally.failures.is_empty() && is_quick {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Ends the run where it hangs: connecting to a board that lets nobody in takes for ever.
fn give_up(tally: &Mutex<Tally>, is_over: &AtomicBool) {
    let (mut before, mut since) = (0, Instant::now());
    while !is_over.load(Ordering::Relaxed) {
        let now = tally.lock().expect("no panic").disturbances;
        if now != before {
            (before, since) = (now, Instant::now());
        }
        if since.elapsed() > HANGS {
            println!("the board lets nobody in any more, after {now} disturbances");
            std::process::exit(1);
        }
        thread::sleep(STOP_EVERY);
    }
}

/// One attack after the other, with commands after each.
fn attack(bench: &Bench, tally: &Mutex<Tally>, lasts: Duration) {
    let socket = PathBuf::from(bench.board());
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let start = Instant::now();
    for index in 0.. {
        if start.elapsed() > lasts {
            return;
        }
        let attack = &ATTACKS[index as usize % ATTACKS.len()];
        let note = |what: &str, begun: &Begun<'_>, answered| {
            let what = format!("{what} after {}, number {index}", attack.name);
            tally
                .lock()
                .expect("no panic")
                .command(what, begun, answered);
        };
        if let Some(mut link) = (attack.act)(&socket, &mut rng) {
            // Whatever it has begun is ended, as every tool does.
            let _ = link.send_bytes(&[0]);
            link.skip_sequences();
            commands(bench, &mut link, &mut rng, note);
        }
        tally.lock().expect("no panic").disturbances += 1;
        let begin = Begun::now(bench);
        match RawLink::connect(&socket) {
            Ok(mut link) => {
                let _ = link.send_bytes(&[0]);
                note("a new connection", &begin, greet(&mut link));
                commands(bench, &mut link, &mut rng, note);
            }
            Err(error) => note("a new connection", &begin, Err(error.to_string())),
        }
        if index % TOOL_EVERY == TOOL_EVERY - 1 {
            let begin = Begun::now(bench);
            let said = bench.tool(&["status", "--history", "--json"]);
            let answered = (said.code == 0).then_some(()).ok_or(said.err);
            note("the tool", &begin, answered);
        }
    }
}

/// Greets the board, and asks for three things.
fn commands(
    bench: &Bench,
    link: &mut RawLink,
    rng: &mut ChaCha8Rng,
    note: impl Fn(&str, &Begun<'_>, Result<(), String>),
) {
    let start = Begun::now(bench);
    note("a greeting", &start, greet(link));
    for _ in 0..3 {
        let drives = Drives {
            drive_v: [rng.random_range(0.0..2.0); 4],
            lease_ms: 50,
        };
        let start = Begun::now(bench);
        let (what, answered) = match rng.random_range(0..4) {
            0 => ("status", understood(link.ask::<StatusEndpoint>(&()))),
            1 => ("off", understood(link.ask::<OffEndpoint>(&()))),
            2 => ("clear", understood(link.ask::<ClearEndpoint>(&()))),
            _ => (
                "set-drive",
                understood(link.ask::<SetDriveEndpoint>(&drives)),
            ),
        };
        note(what, &start, answered);
    }
}

fn greet(link: &mut RawLink) -> Result<(), String> {
    understood(link.greet(PROTOCOL_VERSION))
}

/// An answer, or a refusal with its reason; the board may be stopped or have tripped by then.
fn understood<T>(answer: std::io::Result<Result<T, WireError>>) -> Result<(), String> {
    match answer {
        Ok(Ok(_)) => Ok(()),
        Ok(Err(error)) => Err(format!("not understood, {error:?}")),
        Err(error) => Err(error.to_string()),
    }
}

/// Stops the board again and again, whoever has it.
fn stop_again_and_again(bench: &Bench, tally: &Mutex<Tally>, is_over: &AtomicBool) {
    let found = Found {
        name: bench.board().to_owned(),
        place: Place::Socket {
            path: Path::new(bench.board()).to_owned(),
        },
    };
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime");
    while !is_over.load(Ordering::Relaxed) {
        let start = Begun::now(bench);
        let answered = match runtime.block_on(stop(&found)) {
            Ok(true) => Ok(()),
            Ok(false) => Err("there is no way to stop it".to_owned()),
            Err(error) => Err(error.to_string()),
        };
        let what = "a stop".to_owned();
        tally
            .lock()
            .expect("no panic")
            .command(what, &start, answered);
        thread::sleep(STOP_EVERY);
    }
}
