//! Everything that can break on an emulated board, broken at rest, while driving and during an
//! upload; one line of a table each. It fails where a fault is not detected, takes the mirror more than a
//! millisecond of drive or beyond 250 K, or leaves a board that cannot be used again.

mod cases;
mod requests;

use std::path::Path;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use calibration::tabulate;
use emulated_board::{EmulatedBoard, Observed, PlantFault};
use hil::{Bench, RawLink};
use mirror_model::Model;
use mirror_protocol::{
    CalibrationEndpoint, CalibrationUse, CalibrationUseEndpoint, ClearEndpoint, Drives, Kept,
    LEASE_FOREVER_MS, SetDriveEndpoint, StatusEndpoint,
};
use protection::Fault;
use virtual_mirror::MirrorConfig;

use crate::cases::{Case, Situation, Trouble, cases};
use crate::requests::{cause, connect, play, settle, tripped_or_restarted, upload};

/// Aluminium yields and creeps above.
const HOTTEST_K: f64 = 250.0;
const RESTART: Duration = Duration::from_millis(300);
/// A waveform begins, or a fault shows, within so many requests.
const MANY: u32 = 20_000;
/// Disturbances of the link in one case.
const DISTURBED: u32 = 20;

struct Row {
    detected: Option<Fault>,
    observed: Observed,
    after: String,
    lost: String,
}

fn main() -> ExitCode {
    println!(
        "\nfault                  when         detected              ticks to zero  hottest K  afterwards        lost"
    );
    let mut failed = Vec::new();
    let cases = cases();
    let (mut detected, mut slowest) = (0, 0);
    for case in &cases {
        let row = run(case);
        println!(
            "{:<22} {:<12} {:<21} {:>13} {:>10.1}  {:<17} {}",
            case.trouble,
            format!("{:?}", case.situation),
            row.detected.map_or("-", Fault::name),
            row.observed.driven_ticks,
            row.observed.hottest_k,
            row.after,
            row.lost,
        );
        if !is_right(case, &row) {
            failed.push(format!("{} {:?}", case.trouble, case.situation));
        }
        detected += u32::from(row.detected.is_some());
        if case.most_driven_ticks == cases::AT_ONCE {
            slowest = slowest.max(row.observed.driven_ticks);
        }
    }
    println!(
        "\n{} faults injected, {detected} detected and named, the others borne; {} as they should be; \
         what shows at once comes to zero drive within {slowest} ticks",
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

fn is_right(case: &Case, row: &Row) -> bool {
    let named = match row.detected {
        Some(fault) => case.expected.contains(&fault),
        None => case.expected.is_empty(),
    };
    let in_time = row.observed.driven_ticks <= case.most_driven_ticks;
    // A stored bit that falls over is a calibration lost, which is told.
    let lost = match case.trouble {
        Trouble::StoredBit => "the damaged one",
        _ => "nothing",
    };
    named
        && in_time
        && row.observed.hottest_k < HOTTEST_K
        && row.after == "drives again"
        && row.lost == lost
}

fn run(case: &Case) -> Row {
    let directory = tempfile::tempdir().expect("a directory");
    let flash = directory.path().join("flash");
    let mut bench = Bench::with_flash(MirrorConfig::bench(), Some(&flash));
    let socket = bench.board().to_owned();
    let mut link = connect(&socket);
    let board = bench.emulated_board().expect("emulated");
    let bytes = tabulate(&Model::load("reconciled").expect("a preset"))
        .expect("a calibration")
        .calibration
        .to_bytes();
    let use_it = |link: &mut RawLink| {
        upload(link, 0, &bytes);
        link.ask::<CalibrationUseEndpoint>(&CalibrationUse::ForGood)
            .expect("an answer")
    };
    use_it(&mut link).expect("understood").expect("it is good");
    let known = link.ask::<CalibrationEndpoint>(&()).expect("an answer");

    let half = bytes.len() / 2;
    if case.situation == Situation::AtRest {
        happen(case.trouble, board, &mut link, &flash);
        if matches!(case.trouble, Trouble::Breaks(_)) && !case.trouble.restarts() {
            let _ = play(&mut link);
        }
    } else {
        play(&mut link).expect("a sound board plays");
        settle(&mut link);
        if case.situation == Situation::Uploading {
            upload(&mut link, 0, &bytes[..half]);
        }
        happen(case.trouble, board, &mut link, &flash);
        if case.situation == Situation::Uploading {
            upload(&mut link, half, &bytes[half..]);
        }
    }
    let status = match case.trouble {
        Trouble::Link(_) => None,
        _ => (0..MANY).find_map(|_| tripped_or_restarted(&mut link)),
    };
    let detected = match &status {
        Some(status) => cause(status),
        None => borne(case, &mut link),
    };
    let observed = match case.trouble {
        // Nothing comes to zero there, and nothing must.
        Trouble::Link(_) => Observed {
            driven_ticks: 0,
            ..board.observed()
        },
        _ => board.observed(),
    };

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
    let is_told = matches!(&kept, Ok(Ok(info)) if info.kept == Kept::FactoryAsStoredIsBad);
    let whole = use_it(&mut link);
    let lost = match (kept == known, whole) {
        (true, Ok(Ok(_))) => "nothing".to_owned(),
        (false, Ok(Ok(_))) if is_told => "the damaged one".to_owned(),
        (false, _) => "the calibration".to_owned(),
        (true, refused) => format!("uploads: {refused:?}"),
    };
    Row {
        detected,
        observed,
        after,
        lost,
    }
}

/// What a board names that is to have gone on as it was; one that was driving and drives no more has lost its drive
/// without a name, which is not to be.
fn borne(case: &Case, link: &mut RawLink) -> Option<Fault> {
    let status = link.ask::<StatusEndpoint>(&()).expect("an answer");
    let status = status.expect("understood").expect("greeted");
    if case.situation != Situation::AtRest {
        assert!(status.telemetry.drive_v[0] > 0.5, "it drives: {status:?}");
    }
    cause(&status)
}

/// What is asked of a board that restarts would be lost, so it gets a moment. (If it needs longer, a
/// request is lost and asked again.)
fn happen(trouble: Trouble, board: &EmulatedBoard, link: &mut RawLink, flash: &Path) {
    match trouble {
        Trouble::Breaks(fault) => board.inject(Some(fault)),
        Trouble::ResetAfter(ticks) => board.inject_after(PlantFault::Reset, ticks),
        Trouble::StoredBit => {
            let mut stored = std::fs::read(flash).expect("a file");
            stored[100] ^= 1;
            std::fs::write(flash, stored).expect("the file");
            board.inject(Some(PlantFault::Reset));
        }
        Trouble::Link(disturbance) => {
            board.inject(None);
            let mut seed = 7;
            for _ in 0..DISTURBED {
                disturbance.send(link, &mut seed);
            }
        }
    }
    if trouble.restarts() {
        thread::sleep(RESTART);
    }
}
