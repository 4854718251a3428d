//! The emulated board's link: how long a request takes, and what noise, partial frames and floods do.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use hil::{Bench, DISTURBANCES, RawLink};
use mirror_protocol::{
    Drives, LEASE_FOREVER_MS, PROTOCOL_VERSION, SetDriveEndpoint, StatusEndpoint,
};
use virtual_mirror::MirrorConfig;

const REQUESTS: u32 = 500;
/// Disturbances of each kind, and where a long run asks for what is long.
const TIMES: u32 = 25;
const TIMES_IN_FULL: u32 = 100;

fn main() -> ExitCode {
    let bench = Bench::emulated(MirrorConfig::bench());
    let mut link = RawLink::connect(Path::new(bench.board())).expect("the board listens");
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();

    let start = Instant::now();
    for _ in 0..REQUESTS {
        let _ = status(&mut link);
    }
    let trip_s = start.elapsed().as_secs_f64() / f64::from(REQUESTS);
    println!(
        "\nround trip on the emulated link {:.0} us, {:.0} requests a second",
        trip_s * 1e6,
        1.0 / trip_s
    );

    let drives = Drives {
        drive_v: [1.5; 4],
        lease_ms: LEASE_FOREVER_MS,
    };
    let driven = link.ask::<SetDriveEndpoint>(&drives).unwrap().unwrap();
    driven.expect("a sound board drives");
    println!("disturbance          times  next request answered  drive kept");
    let times = if long_runs::are_asked_for() {
        TIMES_IN_FULL
    } else {
        TIMES
    };
    let mut seed = 5;
    let mut ended_well = true;
    for disturbance in DISTURBANCES {
        let (mut answered, mut kept) = (0, 0);
        for _ in 0..times {
            disturbance.send(&mut link, &mut seed);
            let drive_v = status(&mut link);
            answered += u32::from(drive_v.is_some());
            kept += u32::from(drive_v.is_some_and(|drive| (drive - 1.5).abs() < 1e-6));
        }
        println!(
            "{:<20} {times:>5} {answered:>22} {kept:>11}",
            disturbance.name
        );
        ended_well &= answered == times && kept == times;
    }
    if ended_well {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// The drive of the first channel, if the board answers with its status.
fn status(link: &mut RawLink) -> Option<f32> {
    let status = link.ask::<StatusEndpoint>(&()).ok()?.ok()?.ok()?;
    Some(status.telemetry.drive_v[0])
}
