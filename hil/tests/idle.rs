//! What an emulated board does while nobody waits for it: next to nothing, and it is the same board.

use std::path::PathBuf;
use std::process::ExitCode;

use emulated_board::{PlantFault, Speed};
use hil::{Bench, RawLink, processor_s};
use mirror_protocol::{PROTOCOL_VERSION, StatusEndpoint};

/// A board that is left alone for 20 ms at a time has 50 exchanges a second; as many again are allowed.
const FEW: f64 = 100.0;
/// One each control tick, less what a look at them is off by.
const ALL: f64 = 9_900.0;
/// By then a board has checked its heaters, and a tool has been looked for.
const SETTLED_S: f64 = 1.0;

/// What a board took of the machine, for each second of its own time.
struct Took {
    exchanges: f64,
    processor_s: f64,
}

/// It is a program of its own, since it counts the processor time of all that runs in it.
fn main() -> ExitCode {
    let lasts_s = if long_runs::are_asked_for() {
        20.0
    } else {
        2.0
    };
    let mut bench = Bench::changed(|emulation| emulation.speed = Speed::Awaited);
    bench.wait_until_s(SETTLED_S);
    let idle = measure(&mut bench, lasts_s);
    // What is broken is looked at in every tick.
    let board = bench.emulated_board().expect("emulated");
    board.controls().inject(Some(PlantFault::NoSensor));
    let awake = measure(&mut bench, lasts_s);
    let board = bench.emulated_board().expect("emulated");
    board.controls().inject(None);
    println!(
        "\nover {lasts_s} s nobody waits for: {:.0} exchanges a second and {:.1} % of a processor; {:.0} and {:.1} % where \
         every tick is exchanged",
        idle.exchanges,
        100.0 * idle.processor_s,
        awake.exchanges,
        100.0 * awake.processor_s,
    );

    // It has counted every tick, and does what it is told.
    let later_s = bench_s(&mut bench) + 0.5;
    bench.wait_until_s(later_s);
    let mut link = RawLink::connect(&PathBuf::from(bench.board())).expect("the board listens");
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    let status = link.ask::<StatusEndpoint>(&()).unwrap().unwrap();
    let status = status.expect("greeted");
    let up_s = f64::from(status.telemetry.tick) * 1e-4;
    let off_s = (bench_s(&mut bench) - up_s).abs();
    println!("its clock and its plant's are {off_s:.4} s apart");
    drop(link);
    bench.json(&["set-z", "50um", "--settle", "10ms"]);

    let is_right = idle.exchanges < FEW
        && awake.exchanges > ALL
        && status.health.missed_ticks == 0
        // The answer takes its time, while the plant goes on.
        && off_s < 1.0;
    match is_right {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

fn bench_s(bench: &mut Bench) -> f64 {
    bench.simulated_s()
}

fn measure(bench: &mut Bench, lasts_s: f64) -> Took {
    let look = |bench: &mut Bench| {
        let board = bench.emulated_board().expect("emulated");
        (board.simulated_s(), board.exchanges() as f64, processor_s())
    };
    let before = look(bench);
    bench.wait_until_s(before.0 + lasts_s);
    let after = look(bench);
    let passed_s = after.0 - before.0;
    Took {
        exchanges: (after.1 - before.1) / passed_s,
        processor_s: (after.2 - before.2) / passed_s,
    }
}
