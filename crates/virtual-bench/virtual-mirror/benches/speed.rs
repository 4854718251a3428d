//! Prints how long a 10 kHz tick takes, and a session of 300 s.

use std::time::Instant;

use virtual_mirror::{Experiment, MirrorConfig, Plan, Session, VirtualMirror};

const TICKS: u32 = 200_000;

fn tick_ns(drive: impl Fn(u32) -> f64) -> f64 {
    let mut mirror =
        VirtualMirror::new(&MirrorConfig::bench()).expect("the default mirror is valid");
    let start = Instant::now();
    for tick in 0..TICKS {
        mirror.step([drive(tick); 4], 100e-6);
    }
    start.elapsed().as_nanos() as f64 / f64::from(TICKS)
}

fn main() {
    let step = |tick: u32| {
        if (tick / 1000).is_multiple_of(2) {
            0.0
        } else {
            3.5
        }
    };
    let sine = |tick: u32| 1.0 + 0.5 * (f64::from(tick) * 1e-4 * 628.0).sin();
    println!(
        "tick, drive held:               {:6.0} ns",
        tick_ns(|_| 2.0)
    );
    println!("tick, 0 to 3.5 V every 100 ms:  {:6.0} ns", tick_ns(step));
    println!("tick, 100 Hz sine:              {:6.0} ns", tick_ns(sine));

    let mut mirror =
        VirtualMirror::new(&MirrorConfig::bench()).expect("the default mirror is valid");
    let start = Instant::now();
    for second in 0..300 {
        mirror.advance([f64::from(second % 36) * 0.1; 4], 1.0);
    }
    println!(
        "300 s in steps of 1 s:          {:6.1} ms",
        start.elapsed().as_secs_f64() * 1e3
    );

    let start = Instant::now();
    let volts = |second: u32| [f64::from(second % 36) * 0.1; 4];
    let held = Experiment::held("held", 0.0, (0..300).map(|second| (volts(second), 1.0)));
    let plan = Plan {
        experiments: vec![held],
    };
    let session = Session::record(&MirrorConfig::bench(), &plan).expect("valid");
    let rows: usize = session.recordings.iter().map(|r| r.rows.len()).sum();
    println!(
        "a session of {rows} rows:          {:6.1} ms",
        start.elapsed().as_secs_f64() * 1e3
    );
}
