//! Everything that can break on an emulated board, broken at rest, while driving and during an upload; one line of a
//! table each. It fails where a fault is not detected or not in the fault log afterwards, takes the mirror more than a millisecond of drive or beyond 225 K, or
//! leaves a board that cannot be used again. Every seventh is tried, and every one where
//! A long run asks for what is long.

mod cases;
mod requests;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread;

use calibration::tabulate;
use emulated_board::{Observed, PlantFault};
use hil::{Bench, RawLink};
use mirror_model::Model;
use mirror_protocol::{
    CalibrationEndpoint, CalibrationInfo, CalibrationRefusal, CalibrationUse,
    CalibrationUseEndpoint, ClearEndpoint, Drives, Kept, LEASE_FOREVER_MS, SetDriveEndpoint,
    StatusEndpoint, WireError,
};
use protection::Fault;
use virtual_mirror::MirrorConfig;

use crate::cases::{Case, Situation, Trouble, cases};
use crate::requests::{
    Calibrations, cause, connect, is_logged, play, play_fast, settle, tripped_or_restarted, upload,
};

const CLEARED_AFTER_S: f64 = 0.01;
/// A waveform begins, or a fault shows, within so many requests.
const MANY: u32 = 20_000;
/// Disturbances of the link in one case.
const DISTURBED: u32 = 20;
/// A number without a common factor with the three situations, so that the short form has all of them.
const SHORT_STEP: usize = 13;
/// The same for the twin, which takes ten times as long.
const SHORT_STEP_ON_TWIN: usize = 44;

struct Row {
    detected: Option<Fault>,
    /// Whether the fault log names it.
    is_logged: bool,
    observed: Observed,
    after: String,
    lost: String,
}

fn main() -> ExitCode {
    println!(
        "\nfault                      when       detected             logged  ticks to zero  hottest K  afterwards    lost"
    );
    let step = match (long_runs::are_asked_for(), hil::is_on_twin()) {
        (true, _) => 1,
        (false, false) => SHORT_STEP,
        (false, true) => SHORT_STEP_ON_TWIN,
    };
    let mut all = cases();
    if hil::is_on_twin() {
        all = all.into_iter().map(Case::on_twin).collect();
    }
    let cases: Vec<&Case> = all.iter().step_by(step).collect();
    let (send, rows) = channel();
    let mut failed = Vec::new();
    let (mut detected, mut slowest, mut hottest_k) = (0, 0, 0.0_f64);
    let next = AtomicUsize::new(0);
    thread::scope(|scope| {
        let (next, cases) = (&next, &cases);
        let workers = thread::available_parallelism().map_or(1, usize::from);
        for _ in 0..workers {
            let send = send.clone();
            scope.spawn(move || work(cases, next, &send));
        }
        drop(send);
        for (index, row) in rows {
            let case = cases[index];
            let Some(row) = row else {
                println!("{case}  the case ended in a panic");
                failed.push(case.to_string());
                continue;
            };
            print(case, &row);
            if !is_right(case, &row) {
                failed.push(case.to_string());
            }
            detected += u32::from(row.detected.is_some());
            if case.most_driven_ticks <= cases::AT_ONCE + cases::FILTER_TICKS {
                slowest = slowest.max(row.observed.driven_ticks);
            }
            hottest_k = hottest_k.max(row.observed.hottest_k);
        }
    });
    println!(
        "\n{} faults injected of {}, {detected} detected and named, the others borne; {} as they should be; what shows at \
         once comes to zero drive within {slowest} ticks; hottest {hottest_k:.0} K",
        cases.len(),
        all.len(),
        cases.len() - failed.len()
    );
    if failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        println!("not as they should be: {}", failed.join(", "));
        ExitCode::FAILURE
    }
}

/// Takes one case after the other, for as long as there are any. A row is missing where a case ended in a panic.
fn work(cases: &[&Case], next: &AtomicUsize, send: &Sender<(usize, Option<Row>)>) {
    loop {
        let index = next.fetch_add(1, Ordering::Relaxed);
        let Some(case) = cases.get(index) else {
            return;
        };
        let row = catch_unwind(AssertUnwindSafe(|| run(case))).ok();
        if send.send((index, row)).is_err() {
            return;
        }
    }
}

fn print(case: &Case, row: &Row) {
    println!(
        "{case} {:<20} {:<6} {:>14} {:>10.1}  {:<13} {}",
        row.detected.map_or("-", Fault::name),
        if row.is_logged { "yes" } else { "no" },
        row.observed.driven_ticks,
        row.observed.hottest_k,
        row.after,
        row.lost,
    );
}

fn is_right(case: &Case, row: &Row) -> bool {
    let named = match row.detected {
        Some(fault) => case.expected.contains(&fault),
        None => case.expected.is_empty(),
    };
    let in_time = row.observed.driven_ticks <= case.most_driven_ticks;
    // A stored bit that falls over is a calibration lost, which is told.
    let lost = match case.trouble {
        Trouble::StoredBit | Trouble::StoredBitOfTwo => "the damaged one",
        _ => "nothing",
    };
    named
        && row.is_logged == row.detected.is_some()
        && in_time
        && row.observed.hottest_k < case.hottest_k
        && row.after == "drives again"
        && row.lost == lost
}

fn run(case: &Case) -> Row {
    let directory = tempfile::tempdir().expect("a directory");
    let flash = directory.path().join("flash");
    let bench = Bench::on_emulator(MirrorConfig::bench(), &flash);
    let socket = bench.board().to_owned();
    let mut link = connect(&socket);
    let calibrations = Calibrations::of(
        &tabulate(&Model::load("reconciled").expect("a preset"))
            .expect("a calibration")
            .calibration,
    );
    use_it(&mut link, &calibrations)
        .expect("understood")
        .expect("it is good");
    if let Trouble::StoredBitOfTwo = case.trouble {
        use_it(&mut link, &calibrations)
            .expect("understood")
            .expect("it is good");
    }
    let known = link.ask::<CalibrationEndpoint>(&()).expect("an answer");

    let (first, second) = calibrations.good.split_at(calibrations.good.len() / 2);
    let happen = |link: &mut RawLink| happen(case.trouble, &bench, link, &calibrations);
    if case.situation == Situation::AtRest {
        // The heaters' check after an exchange is no rest: what opens in its midst reads as hot.
        settle(&mut link);
        happen(&mut link);
        if matches!(case.trouble, Trouble::Breaks(_)) && !case.trouble.restarts() {
            let _ = play(&mut link);
        }
    } else {
        play(&mut link).expect("a sound board plays");
        settle(&mut link);
        if case.situation == Situation::Uploading {
            upload(&mut link, 0, first);
        }
        happen(&mut link);
        if case.situation == Situation::Uploading {
            upload(&mut link, first.len(), second);
        }
    }
    let status = match case.trouble.is_borne() {
        true => None,
        false => (0..MANY).find_map(|_| tripped_or_restarted(&mut link)),
    };
    let detected = match &status {
        Some(status) => cause(status),
        None => borne(case, &mut link),
    };
    let is_logged = detected.is_some_and(|fault| is_logged(&mut link, fault));
    let observed = match case.trouble.is_borne() {
        // Nothing comes to zero there, and nothing must.
        true => Observed {
            driven_ticks: 0,
            ..bench.controls().observed()
        },
        false => bench.controls().observed(),
    };
    let mended_s = bench.simulated_s();

    // The fault is mended, and nobody clears it within the next 10 ms.
    bench.controls().inject(None);
    bench.wait_until_s(mended_s + CLEARED_AFTER_S);
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
    let told = [Kept::FactoryAsStoredIsBad, Kept::Outdated];
    let is_told = matches!(&kept, Ok(Ok(info)) if told.contains(&info.kept));
    let whole = use_it(&mut link, &calibrations);
    if let Trouble::WornFlash = case.trouble {
        let is_told = matches!(&whole, Ok(Ok(info)) if info.kept == Kept::No);
        assert!(is_told, "a worn flash keeps nothing: {whole:?}");
    }
    let lost = match (kept == known, whole) {
        (true, Ok(Ok(_))) => "nothing".to_owned(),
        (false, Ok(Ok(_))) if is_told => "the damaged one".to_owned(),
        (false, _) => "the calibration".to_owned(),
        (true, refused) => format!("uploads: {refused:?}"),
    };
    Row {
        detected,
        is_logged,
        observed,
        after,
        lost,
    }
}

/// Uploads the good one, and puts it to use for good.
fn use_it(
    link: &mut RawLink,
    calibrations: &Calibrations,
) -> Result<Result<CalibrationInfo, CalibrationRefusal>, WireError> {
    upload(link, 0, &calibrations.good);
    link.ask::<CalibrationUseEndpoint>(&CalibrationUse::ForGood)
        .expect("an answer")
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

/// What is asked of a board that restarts would be lost, so it is waited for until it is there again; a tool finds it anew.
fn happen(trouble: Trouble, bench: &Bench, link: &mut RawLink, calibrations: &Calibrations) {
    if trouble.restarts() {
        let (resets, within_s) = trouble.resets();
        bench.restart(resets, within_s, |bench| {
            begin(trouble, bench, link, calibrations);
        });
        if hil::is_on_twin() {
            // Its device has gone, and come back.
            *link = RawLink::connect(Path::new(bench.board())).expect("the board listens");
        }
    } else {
        begin(trouble, bench, link, calibrations);
    }
}

fn begin(trouble: Trouble, bench: &Bench, link: &mut RawLink, calibrations: &Calibrations) {
    let controls = bench.controls();
    match trouble {
        Trouble::Breaks(fault) => controls.inject(Some(fault)),
        Trouble::ResetAfter(ticks) => controls.inject_after(PlantFault::Reset, ticks),
        Trouble::StoredBit | Trouble::StoredBitOfTwo => {
            bench.damage(calibrations.newest_in(&bench.stored()) + 100);
            controls.inject(Some(PlantFault::Reset));
        }
        Trouble::Link(disturbance) => {
            controls.inject(None);
            let mut seed = 7;
            for _ in 0..DISTURBED {
                disturbance.send(link, &mut seed);
            }
        }
        Trouble::WornFlash => {
            controls.inject(None);
            bench.wear_out_flash();
        }
        Trouble::FastDrive(fast) => {
            controls.inject(Some(PlantFault::Vacuum));
            // It may be too hot already.
            let _ = play_fast(link, fast);
        }
        Trouble::Calibration(place, number, name) => {
            controls.inject(None);
            let refused = calibrations.with_number(place, number);
            upload(link, 0, &refused);
            let answer = link.ask::<CalibrationUseEndpoint>(&CalibrationUse::ForGood);
            let answer = answer.expect("an answer").expect("understood");
            assert!(answer.is_err(), "{name} was accepted: {answer:?}");
            // Half of the good one was there before.
            upload(link, 0, &calibrations.good[..calibrations.good.len() / 2]);
        }
    }
}
