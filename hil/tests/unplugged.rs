//! The bus under the tool, on the silicon twin: a cable that is pulled in the midst of a transfer, a bus that is reset, a
//! computer that sleeps. The tool says what happened, and the board is there again for the next command.

use std::process::Child;

use hil::{Bench, Said};
use silicon_twin::Twin;
use virtual_mirror::MirrorConfig;

/// Something that takes so long that the bus can be disturbed meanwhile, and talks all the time.
const BUSY: [&str; 6] = ["record", "-o", "busy.csv", "--duration", "2s", "--period"];
/// Ticks by which a tool that drives is at work.
const AT_WORK_TICKS: u64 = 300;

fn bench() -> Bench {
    Bench::on_twin(MirrorConfig::bench())
}

/// A tool that streams samples, and has done so for some of them.
fn recording(bench: &Bench) -> Child {
    bench.json(&["set-z", "120um", "--settle", "1ms", "--hold", "10min"]);
    let frames = |bench: &Bench| of(bench, |twin| twin.chip.usb_host.frames());
    let before = frames(bench);
    let tool = bench.start_tool(&[&BUSY[..], &["1ms"]].concat());
    bench.wait("it streams nothing", |bench| {
        frames(bench) > before + AT_WORK_TICKS
    });
    tool
}

fn of<T: Send + 'static>(bench: &Bench, act: impl FnOnce(&mut Twin) -> T + Send + 'static) -> T {
    bench
        .twin()
        .expect("a twin")
        .with(act)
        .expect("the twin runs")
}

fn is_sound(bench: &Bench) {
    let status = bench.json(&["status"]);
    assert_eq!(
        (&status["missed_ticks"], &status["late_ticks"]),
        (&0.into(), &0.into()),
        "{status}"
    );
    assert_eq!(of(bench, |twin| twin.resets().len()), 1, "it was not reset");
    assert_eq!(bench.twin().expect("a twin").failure(), None);
}

/// The tool lost its board, and said so.
fn assert_lost(tool: Child) {
    let said = Said::from(tool);
    assert_ne!(said.code, 0, "{}", said.out);
    assert!(
        said.sentence().contains("connection to the board was lost"),
        "{}",
        said.err
    );
}

#[test]
fn a_cable_that_is_pulled_is_told_and_the_board_is_there_when_it_is_back() {
    let bench = bench();
    let tool = recording(&bench);
    of(&bench, |twin| twin.chip.usb_host.unplug());
    assert_lost(tool);
    of(&bench, |twin| twin.chip.usb_host.plug());
    is_sound(&bench);
}

#[test]
fn a_bus_that_is_reset_is_told_and_the_board_answers_the_next_command() {
    let bench = bench();
    let tool = recording(&bench);
    of(&bench, |twin| {
        let clock = twin.chip.clock;
        twin.chip.usb_host.start_over(&clock);
    });
    assert_lost(tool);
    is_sound(&bench);
}

#[test]
fn a_computer_that_sleeps_for_a_moment_goes_on_where_it_was() {
    let bench = bench();
    let tool = recording(&bench);
    of(&bench, |twin| {
        let clock = twin.chip.clock;
        twin.chip.usb_host.suspend(&clock);
    });
    let asleep_s = bench.simulated_s();
    // A device is suspended after 3 ms without traffic.
    bench.wait_until_s(asleep_s + 0.02);
    of(&bench, |twin| {
        let clock = twin.chip.clock;
        twin.chip.usb_host.resume(&clock);
    });
    let said = Said::from(tool);
    // Samples that found no bus are dropped, which the tool tells, or were few enough to wait.
    assert!(
        said.code == 0 || said.sentence().contains("sample"),
        "{}",
        said.err
    );
    is_sound(&bench);
}
