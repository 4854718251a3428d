//! How fast the silicon twin is, and what it spends the time on.

use std::fs;

use anyhow::{Context, Result, anyhow};
use emulated_board::Connected;
use mirror_protocol::{LEASE_FOREVER_MS, Position, SetPositionEndpoint, StatusEndpoint};
use silicon_twin::board::Board;
use silicon_twin::profile::Activity;
use silicon_twin::tool::{AskError, Tool};
use silicon_twin::{Image, Twin};
use virtual_mirror::MirrorConfig;
use xtask::images;

/// How much of the board's time is looked at: some thousand looks (s).
const SIMULATED_S: f64 = 5.0;
/// From one request to the next: a tool that asks for the status all the time asks about as often (s).
const PAUSE_S: f64 = 5e-3;

/// Runs the flashed image at 120 um, asked for its status again and again, and prints the profile.
pub(crate) fn run() -> Result<()> {
    let image = Image::from_elf(&fs::read(images::build(images::Board::Stm32g474)?)?)?;
    let mirror = Connected::Mirror(Box::new(MirrorConfig::bench()));
    let mut tool = Tool::new(Twin::new(image, Board::new(&mirror)?)?);
    tool.connect()?;
    tool.twin.run_for(0.3)?;
    let position = Position {
        z_um: 120.0,
        lease_ms: LEASE_FOREVER_MS,
    };
    let moved = tool.ask::<SetPositionEndpoint>(&position)?;
    moved.map_err(|refusal| anyhow!("the board refuses: {refusal:?}"))?;

    let start_s = tool.twin.seconds();
    let asleep = tool.twin.timing.asleep;
    let watched = tool.twin.watched();
    let (worked, parts) = watched.profile(|| {
        work(&mut tool, start_s + SIMULATED_S)?;
        processor_s()
    });
    let took_s = worked?;
    let simulated_s = tool.twin.seconds() - start_s;
    let slept_s = (tool.twin.timing.asleep - asleep) as f64 / tool.twin.chip.clock.hz();
    println!("| what | part of the time |");
    println!("|---|---|");
    for (activity, part) in Activity::ALL.into_iter().zip(parts) {
        println!("| {} | {:.0} % |", name(activity), 100.0 * part);
    }
    println!(
        "\n{:.2} simulated seconds in a second of one processor; the chip's sleeps for {:.0} % of them.",
        simulated_s / took_s,
        100.0 * slept_s / simulated_s
    );
    Ok(())
}

fn work(tool: &mut Tool, end_s: f64) -> Result<(), AskError> {
    while tool.twin.seconds() < end_s {
        // What it says is not looked at.
        let _ = tool.ask::<StatusEndpoint>(&())?;
        tool.twin.run_for(PAUSE_S)?;
    }
    Ok(())
}

/// Processor time of this thread (s): the first number in nanoseconds (Linux, Documentation/scheduler/sched-stats).
fn processor_s() -> Result<f64> {
    let said = fs::read_to_string("/proc/thread-self/schedstat")?;
    let first = said.split_whitespace().next().context("an empty file")?;
    Ok(first.parse::<f64>()? * 1e-9)
}

fn name(activity: Activity) -> &'static str {
    match activity {
        Activity::Interpreter => "instructions",
        Activity::Registers => "registers of peripherals",
        Activity::Events => "which event is next; timers",
        Activity::Conversions => "conversions",
        Activity::Filters => "output filters and supply",
        Activity::Mirror => "virtual mirror",
        Activity::Usb => "USB host",
    }
}
