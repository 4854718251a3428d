//! What the virtual mirror did when its physics was last changed on purpose, trace by trace: a change of the code that
//! is not meant to change the physics must leave every trace as it is.
//!
//! `golden/traces.csv` holds a line a trace: a hash of every bit of it, and a few numbers for people. After a change of the
//! physics that is meant, `MIRROR_GOLDEN=write cargo test -p virtual-mirror --test golden` writes the file anew, and
//! the difference is part of the review.

use std::fmt::Write as _;

use virtual_mirror::{Effect, Family, MirrorConfig, Sensor, State, VirtualMirror};

const GOLDEN: &str = include_str!("golden/traces.csv");
const HEADER: &str = "trace,fnv1a64,z_um,seen_z_um,tilt_x_deg,current_1_a,hottest_k\n";

/// FNV-1a, 64 bits (G. Fowler, L. C. Noll, P. Vo; RFC 9923).
struct Fnv(u64);

impl Fnv {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn write(&mut self, number: f64) {
        for byte in number.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// A drive with everything that a mirror can be asked for: ticks, jumps between unequal actuators, ramps up and down, long
/// dwells, another room, a stage, drives beyond the rails and NaN.
fn trace(config: &MirrorConfig) -> (u64, State) {
    let mut mirror = VirtualMirror::new(config).expect("valid mirror");
    let mut sensor = Sensor::new(config);
    let mut hash = Fnv::new();
    let mut look = |mirror: &VirtualMirror| {
        let state = mirror.state();
        let reading = sensor.read(&state, 1e-3);
        let seen = [
            mirror.time_s(),
            state.z_um,
            state.seen_z_um,
            state.tilt_x_deg,
            state.tilt_y_deg,
            state.hottest_k,
            state.ambient_c,
            reading.z_um,
            reading.tilt_x_deg,
            reading.tilt_y_deg,
        ];
        let seen = seen.into_iter().chain(state.current_a);
        let seen = seen.chain(state.heater_mean_k).chain(reading.current_a);
        seen.for_each(|number| hash.write(number));
        state
    };
    for tick in 0..200_u32 {
        let volts = f64::from(tick % 40) * 0.09;
        mirror.step([volts, 0.8 * volts, 0.5, -volts], 1e-4);
        look(&mirror);
    }
    for (drive, seconds) in [
        ([3.5; 4], 0.05),
        ([3.5, 0.2, 0.2, 0.2], 1.0),
        ([2.0, f64::NAN, 11.0, -11.0], 0.001),
        ([3.4; 4], 90.0),
        ([0.0; 4], 0.02),
    ] {
        mirror.advance(drive, seconds);
        look(&mirror);
    }
    for (volts, seconds) in [(3.0, 0.3), (1.0, 2.0), (2.0, 0.004), (2.0, 0.004)] {
        mirror.advance_ramp([volts, volts, 0.9 * volts, volts], seconds);
        look(&mirror);
    }
    mirror.set_ambient(17.0);
    look(&mirror);
    mirror.advance([1.5; 4], 5.0);
    mirror.set_stage(25.0);
    for _ in 0..20 {
        mirror.step([1.5; 4], 1e-4);
        look(&mirror);
    }
    mirror.set_ambient(0.0);
    mirror.advance([2.5, 2.4, 2.3, 2.2], 30.0);
    let last = look(&mirror);
    (hash.0, last)
}

fn mirrors() -> Vec<(String, MirrorConfig)> {
    let mut mirrors = vec![
        ("bench".to_owned(), MirrorConfig::bench()),
        ("paper".to_owned(), MirrorConfig::paper()),
    ];
    let mut all = MirrorConfig::paper();
    for &effect in Effect::ALL {
        let config = MirrorConfig::bench().with_effect(effect, 1.5);
        mirrors.push((effect.id().to_owned(), config));
        all = all.with_effect(effect, 0.7);
    }
    mirrors.push(("all effects".to_owned(), all));
    for family in Family::ALL {
        mirrors.push((format!("family {family:?}"), MirrorConfig::draw(family, 5)));
    }
    mirrors
}

fn traces() -> String {
    let mut table = HEADER.to_owned();
    for (name, config) in mirrors() {
        let (hash, last) = trace(&config);
        let State {
            z_um,
            seen_z_um,
            tilt_x_deg,
            hottest_k,
            ..
        } = last;
        let current_1_a = last.current_a[0];
        writeln!(
            table,
            "{name},{hash:016x},{z_um:.12e},{seen_z_um:.12e},{tilt_x_deg:.12e},{current_1_a:.12e},{hottest_k:.12e}"
        )
        .expect("a string takes all");
    }
    table
}

/// Numbers of one line: the name, the hash, and what people read.
fn parse(line: &str) -> (&str, &str, Vec<f64>) {
    let mut fields = line.split(',');
    let mut text = || fields.next().expect("name and hash");
    let (name, hash) = (text(), text());
    let numbers = fields.map(|number| number.parse().expect("a number"));
    (name, hash, numbers.collect())
}

#[test]
fn every_trace_is_what_it_was() {
    let found = traces();
    if std::env::var_os("MIRROR_GOLDEN").is_some_and(|what| what == "write") {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/traces.csv");
        std::fs::write(path, &found).expect("the golden file can be written");
        return;
    }
    assert_eq!(found.lines().count(), GOLDEN.lines().count());
    for (found, golden) in found.lines().zip(GOLDEN.lines()).skip(1) {
        let ((name, hash, numbers), (_, golden_hash, golden_numbers)) =
            (parse(found), parse(golden));
        for (number, golden) in numbers.iter().zip(&golden_numbers) {
            // Rounding that another C library's exp and sin add is of 1e-15 a call; a step more or less that the error
            // control takes for it is within the nanometre that `physics.rs` allows, 1e-5 of a displacement.
            approx::assert_relative_eq!(*number, *golden, max_relative = 1e-5, epsilon = 1e-9);
        }
        // To the bit where the numbers come from.
        if cfg!(all(
            target_arch = "x86_64",
            target_os = "linux",
            target_env = "gnu"
        )) {
            assert_eq!(hash, golden_hash, "{name}: the trace is another one");
        }
    }
}
