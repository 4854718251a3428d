//! The emulated board's link: how long a request takes, and what noise, partial frames and floods do.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use hil::{Bench, RawLink};
use mirror_protocol::{
    Drives, LEASE_FOREVER_MS, PROTOCOL_VERSION, SetDriveEndpoint, StatusEndpoint,
};
use virtual_mirror::MirrorConfig;

const REQUESTS: u32 = 2000;
/// Disturbances of each kind.
const DISTURBANCES: u32 = 100;

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
    let mut seed = 5;
    let mut ended_well = true;
    for (name, disturb) in KINDS {
        let (mut answered, mut kept) = (0, 0);
        for _ in 0..DISTURBANCES {
            let bytes = disturb(&mut link, &mut seed);
            link.send_bytes(&bytes).expect("the link is there");
            link.send_bytes(&[0]).expect("the link is there");
            let drive_v = status(&mut link);
            answered += u32::from(drive_v.is_some());
            kept += u32::from(drive_v.is_some_and(|drive| (drive - 1.5).abs() < 1e-3));
        }
        println!("{name:<20} {DISTURBANCES:>5} {answered:>22} {kept:>11}");
        ended_well &= answered == DISTURBANCES && kept == DISTURBANCES;
    }
    if ended_well {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

type Disturb = fn(&mut RawLink, &mut u32) -> Vec<u8>;

const KINDS: [(&str, Disturb); 4] = [
    ("noise", |_, seed| random(seed, 200)),
    ("partial frame", |link, seed| {
        let mut frame = link.request::<StatusEndpoint>(&());
        frame.truncate(1 + *seed as usize % (frame.len() - 1));
        random(seed, 1);
        frame
    }),
    ("one bit wrong", |link, seed| {
        let mut frame = link.request::<StatusEndpoint>(&());
        let end = frame.len() - 1;
        let place = random(seed, 2);
        frame[usize::from(place[0]) % end] ^= 1 << (place[1] % 8);
        frame
    }),
    ("flood of 50 frames", |link, _| {
        (0..50)
            .flat_map(|_| link.request::<StatusEndpoint>(&()))
            .collect()
    }),
];

fn random(seed: &mut u32, bytes: usize) -> Vec<u8> {
    let mut byte = || {
        *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (*seed >> 24) as u8
    };
    (0..bytes).map(|_| byte()).collect()
}

/// The drive of the first channel, if the board answers with its status.
fn status(link: &mut RawLink) -> Option<f32> {
    let status = link.ask::<StatusEndpoint>(&()).ok()?.ok()?.ok()?;
    Some(status.telemetry.drive_v[0])
}
