//! How late the control loop is by what else is going on, and what makes it so.

use mirror_protocol::{CalibrationUse, CalibrationUseEndpoint, Stream, StreamEndpoint};
use silicon_twin::timing::Latest;
use silicon_twin::tool::Tool;

use crate::common;

/// A tick is 100 us; 30 % of it are to be left.
const LATEST_US: f64 = 70.0;
/// After another calibration has been taken over, with all channels off, the protection computes it, two channels a tick.
const LATEST_AFTER_EXCHANGE_US: f64 = 75.0;
/// What masks interrupts keeps the conversions' end waiting: twice and a half what embassy's timer needs, a twentieth of a tick.
const MASKED_US: f64 = 5.0;

fn us(cycles: u64) -> f64 {
    cycles as f64 / common::CYCLES_PER_US as f64
}

/// How the name of the load begins that exchanges the calibration.
const EXCHANGES: &str = "a calibration kept";

/// What goes on beside the control loop, and its name.
type Load = (&'static str, fn(&mut Tool));

const LOADS: &[Load] = &[
    ("nothing is driven", |tool| {
        tool.twin.run_for(0.1).expect("it runs");
    }),
    ("all channels driven", |tool| {
        common::drive(tool, 2.5);
        tool.twin.run_for(0.1).expect("it runs");
    }),
    ("driven, and a status asked for again and again", |tool| {
        for _ in 0..100 {
            common::status(tool);
        }
    }),
    ("driven, and a sample of every tick streamed", |tool| {
        let stream = Stream {
            count: 1000,
            period_ticks: 1,
            ..Stream::default()
        };
        let begun = tool.ask::<StreamEndpoint>(&stream).expect("an answer");
        begun.expect("it streams");
        tool.twin.run_for(0.1).expect("it runs");
    }),
    ("a calibration uploaded", |tool| {
        common::upload(tool, 1);
    }),
    (
        "a calibration kept: pages erased, double words programmed",
        |tool| {
            let used = tool.ask::<CalibrationUseEndpoint>(&CalibrationUse::ForGood);
            used.expect("an answer").expect("it is put to use");
        },
    ),
];

#[test]
fn a_tick_has_time_to_spare_whatever_goes_on() {
    let mut tool = common::greeted();
    println!(
        "| beside the control loop, us | its longest run | drives written after its update | end after it | \
         conversions' interrupt late by | interrupts masked | in |"
    );
    for (name, load) in LOADS {
        tool.twin.timing.count_anew();
        load(&mut tool);
        let Latest {
            latency,
            written,
            end,
            masked,
            masked_at,
            interrupted_by,
        } = tool.twin.timing.latest();
        println!(
            "| {name} | {:.1} | {:.1} | {:.1} | {:.2} | {:.2} | {} |",
            us(tool.twin.timing.control_loop().longest),
            us(written),
            us(end),
            us(latency),
            us(masked),
            tool.twin.image().function(masked_at)
        );
        assert_eq!(interrupted_by, None, "{name}");
        let latest_us = match name.starts_with(EXCHANGES) {
            true => LATEST_AFTER_EXCHANGE_US,
            false => LATEST_US,
        };
        assert!(us(written) < latest_us, "{name}: {} us", us(written));
        assert!(us(masked) < MASKED_US, "{name}: {} us", us(masked));
        assert!(us(latency) < MASKED_US, "{name}: {} us", us(latency));
    }
    let health = common::status(&mut tool).health;
    assert_eq!((health.missed_ticks, health.late_ticks), (0, 0));
}
