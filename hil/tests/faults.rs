//! Everything that can break on an emulated board, broken at rest, while driving and during an
//! upload; one line of a table each. It fails where a fault is not detected, takes the mirror more than a
//! millisecond of drive or beyond 250 K, or leaves a board that cannot be used again.

use std::path::Path;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use calibration::tabulate;
use emulated_board::{EmulatedBoard, Observed, PlantFault};
use hil::{Bench, RawLink};
use mirror_model::Model;
use mirror_protocol::{
    CalibrationChunk, CalibrationEndpoint, CalibrationUseEndpoint, CalibrationWriteEndpoint,
    ChannelState, Chunk, ClearEndpoint, Drives, LEASE_FOREVER_MS, PROTOCOL_VERSION, Play,
    PlayEndpoint, Quantity, Refusal, SetDriveEndpoint, Shape, Status, StatusEndpoint, Stream,
    Waveform,
};
use protection::Fault;
use virtual_mirror::MirrorConfig;

/// The protection needs three ticks, and eight to tell that a sense is frozen.
const MOST_DRIVEN_TICKS: u64 = 10;
/// Aluminium yields and creeps above.
const HOTTEST_K: f64 = 250.0;
const RESTART: Duration = Duration::from_millis(300);
/// A waveform begins, or a fault shows, within so many requests.
const MANY: u32 = 20_000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Situation {
    AtRest,
    Driving,
    Uploading,
}

struct Case {
    fault: PlantFault,
    situation: Situation,
    expected: &'static [Fault],
}

struct Row {
    detected: Option<Fault>,
    observed: Observed,
    after: String,
    lost: String,
}

fn main() -> ExitCode {
    println!(
        "\nfault                 when         detected              ticks to zero  hottest K  afterwards        lost"
    );
    let mut failed = Vec::new();
    let cases = cases();
    for case in &cases {
        let row = run(case);
        println!(
            "{:<21} {:<12} {:<21} {:>13} {:>10.1}  {:<17} {}",
            format!("{:?}", case.fault),
            format!("{:?}", case.situation),
            row.detected.map_or("-", Fault::name),
            row.observed.driven_ticks,
            row.observed.hottest_k,
            row.after,
            row.lost,
        );
        let hottest_allowed = row.observed.hottest_k < HOTTEST_K;
        // Heat takes its time to show; what it does to the mirror is the measure there.
        let in_time = case.fault == PlantFault::Vacuum
            || row.observed.driven_ticks <= MOST_DRIVEN_TICKS + heated_by_motion(case);
        let detected = match row.detected {
            Some(fault) => case.expected.contains(&fault),
            None => case.expected.is_empty(),
        };
        if !(detected && hottest_allowed && in_time)
            || row.after != "drives again"
            || row.lost != "nothing"
        {
            failed.push(format!("{:?} {:?}", case.fault, case.situation));
        }
    }
    println!(
        "\n{} faults injected, {} as they should be",
        cases.len(),
        cases.len() - failed.len()
    );
    if failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        println!("not as they should be: {}", failed.join(", "));
        ExitCode::FAILURE
    }
}

/// A frozen sense shows once the drive has moved by 20 mV, which the waveform takes up to 15 ms for at
/// its turning points.
fn heated_by_motion(case: &Case) -> u64 {
    if matches!(case.fault, PlantFault::FrozenSense(_)) {
        150
    } else {
        0
    }
}

fn cases() -> Vec<Case> {
    use Fault as F;
    let faults: [(PlantFault, &[Fault]); 11] = [
        (PlantFault::OpenHeater(1), &[F::OpenHeater]),
        (PlantFault::ShortCircuit(2), &[F::ShortCircuit]),
        (
            PlantFault::LowResistance(0),
            &[F::ImplausibleSense, F::OverCurrent, F::ShortCircuit],
        ),
        (PlantFault::Vacuum, &[F::OverTemperature]),
        (
            PlantFault::FrozenSense(3),
            &[
                F::FrozenSense,
                F::OpenHeater,
                F::ImplausibleSense,
                F::OverTemperature,
            ],
        ),
        (PlantFault::WeakSupply, &[F::SupplyOutOfRange]),
        (PlantFault::MissedTicks, &[F::TickOverrun]),
        (PlantFault::Panic, &[F::FirmwarePanic]),
        (PlantFault::HardFault, &[F::HardFault]),
        (PlantFault::Hang, &[F::WatchdogReset]),
        (PlantFault::Reset, &[]),
    ];
    let situations = [Situation::AtRest, Situation::Driving, Situation::Uploading];
    let mut cases = Vec::new();
    for (fault, expected) in faults {
        for situation in situations {
            cases.push(Case {
                fault,
                situation,
                expected,
            });
        }
    }
    cases
}

fn run(case: &Case) -> Row {
    let mut bench = Bench::emulated(MirrorConfig::bench());
    let socket = bench.board().to_owned();
    let mut link = connect(&socket);
    let known = link.ask::<CalibrationEndpoint>(&()).expect("an answer");
    let board = bench.emulated_board().expect("emulated");
    let bytes = tabulate(&Model::load("reconciled").expect("a preset"))
        .expect("a calibration")
        .calibration
        .to_bytes();
    let half = bytes.len() / 2;
    match case.situation {
        Situation::AtRest => {
            break_it(board, case.fault);
            if !restarts(case.fault) {
                let _ = play(&mut link);
            }
        }
        Situation::Driving => {
            play(&mut link).expect("a sound board plays");
            settle(&mut link);
            break_it(board, case.fault);
        }
        Situation::Uploading => {
            play(&mut link).expect("a sound board plays");
            settle(&mut link);
            upload(&mut link, 0, &bytes[..half]);
            break_it(board, case.fault);
            upload(&mut link, half, &bytes[half..]);
        }
    }
    let status = (0..MANY).find_map(|_| tripped_or_restarted(&mut link));
    let detected = status.as_ref().and_then(cause);
    let observed = board.observed();

    // The fault is mended.
    board.inject(None);
    let cleared = link.ask::<ClearEndpoint>(&()).expect("an answer");
    let drives = Drives {
        drive_v: [1.0; 4],
        lease_ms: LEASE_FOREVER_MS,
    };
    let again = link.ask::<SetDriveEndpoint>(&drives).expect("an answer");
    let after = match (cleared, again) {
        (Ok(Ok(_)), Ok(Ok(_))) => "drives again".to_owned(),
        (_, other) => format!("{other:?}"),
    };
    let kept = link.ask::<CalibrationEndpoint>(&()).expect("an answer");
    let whole = {
        upload(&mut link, 0, &bytes);
        link.ask::<CalibrationUseEndpoint>(&()).expect("an answer")
    };
    let lost = match (kept == known, whole) {
        (true, Ok(Ok(_))) => "nothing",
        (false, _) => "the calibration",
        _ => "uploads",
    };
    Row {
        detected,
        observed,
        after,
        lost: lost.to_owned(),
    }
}

/// Whether the processor is reset by it.
fn restarts(fault: PlantFault) -> bool {
    matches!(
        fault,
        PlantFault::Panic | PlantFault::HardFault | PlantFault::Hang | PlantFault::Reset
    )
}

/// What is asked of a board that restarts would be lost, so it gets a moment. (If it needs longer, a
/// request is lost and asked again.)
fn break_it(board: &EmulatedBoard, fault: PlantFault) {
    board.inject(Some(fault));
    if restarts(fault) {
        thread::sleep(RESTART);
    }
}

fn connect(socket: &str) -> RawLink {
    let mut link = RawLink::connect(Path::new(socket)).expect("the board listens");
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    link
}

/// Drives a sine of 1 to 3 V, 5 Hz.
fn play(link: &mut RawLink) -> Result<(), Refusal> {
    let play = Play {
        waveform: Waveform {
            quantity: Quantity::Drive {
                active: [true; 4],
                others_v: 0.0,
            },
            shape: Shape::Sine { frequency_hz: 5.0 },
            offset: 2.0,
            amplitude: 1.0,
            cycles: u32::MAX,
            ends_off: true,
        },
        stream: Stream {
            period_ticks: 1,
            ..Stream::default()
        },
        lease_ms: LEASE_FOREVER_MS,
    };
    link.ask::<PlayEndpoint>(&play)
        .expect("an answer")
        .expect("understood")
        .map(drop)
}

/// Lets 0.2 s of the board's time pass.
fn settle(link: &mut RawLink) {
    let tick = |link: &mut RawLink| {
        let status = link.ask::<StatusEndpoint>(&()).expect("an answer");
        status.expect("understood").expect("granted").telemetry.tick
    };
    let start = tick(link);
    while tick(link).wrapping_sub(start) < 2000 {}
}

/// Writes pieces of a calibration; a board that has restarted in between takes them or not.
fn upload(link: &mut RawLink, from: usize, bytes: &[u8]) {
    for (i, piece) in bytes.chunks(192).enumerate() {
        let chunk = CalibrationChunk {
            offset: (from + 192 * i) as u16,
            bytes: Chunk::from_slice(piece).expect("a piece fits"),
        };
        let _ = link.ask::<CalibrationWriteEndpoint>(&chunk);
    }
}

/// The status once something has happened: a trip, or a restart, after which the board is greeted anew.
fn tripped_or_restarted(link: &mut RawLink) -> Option<Status> {
    match link.ask::<StatusEndpoint>(&()).ok()?.ok()? {
        Err(Refusal::NoHello) => {
            link.greet(PROTOCOL_VERSION).ok()?.ok()?;
            link.ask::<StatusEndpoint>(&()).ok()?.ok()?.ok()
        }
        Err(_) => None,
        Ok(status) => cause(&status).is_some().then_some(status),
    }
}

fn cause(status: &Status) -> Option<Fault> {
    status
        .telemetry
        .states
        .iter()
        .find_map(|state| match state {
            ChannelState::Tripped(code) => Fault::from_code(*code),
            _ => None,
        })
}
