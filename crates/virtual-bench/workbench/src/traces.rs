//! What an oscilloscope shows at the driver board's actuators, drawn from the silicon twin for the page on bringing a board up.

use std::fs;

use anyhow::{Context, Result, anyhow};
use charts::{Look, Panel, Series, sheet};
use emulated_board::{Connected, PlantFault};
use mirror_protocol::{Drives, LEASE_FOREVER_MS, Position, SetDriveEndpoint, SetPositionEndpoint};
use silicon_twin::board::Board;
use silicon_twin::tool::Tool;
use silicon_twin::{Image, Twin};
use virtual_mirror::MirrorConfig;
use xtask::cargo::workspace;
use xtask::images;

const FOLDER: &str = "docs/pictures";
/// A period of the PWM (s).
const PERIOD_S: f64 = 25e-6;

/// The voltage at each actuator, by milliseconds.
type Trace = [Vec<(f64, f64)>; 4];

/// Draws the three pictures of the page.
pub(crate) fn draw() -> Result<()> {
    let image = images::build(images::Board::Stm32g474)?;
    let image = Image::from_elf(&fs::read(image)?)?;
    let mirror = Connected::Mirror(Box::new(MirrorConfig::bench()));
    let mut tool = Tool::new(Twin::new(image, Board::new(&mirror)?)?);

    let start = scope(&mut tool, 0.35, 8)?;
    picture("start", "power comes: each heater is checked twice", &start)?;

    tool.connect()?;
    let position = Position {
        z_um: 120.0,
        lease_ms: LEASE_FOREVER_MS,
    };
    tool.send::<SetPositionEndpoint>(&position);
    let moved = scope(&mut tool, 0.03, 1)?;
    picture("move", "set-z 120um", &moved)?;

    let drives = Drives {
        drive_v: [2.0, 2.2, 2.4, 2.6],
        lease_ms: LEASE_FOREVER_MS,
    };
    let driven = tool.ask::<SetDriveEndpoint>(&drives)?;
    driven.map_err(|refusal| anyhow!("the board refuses: {refusal:?}"))?;
    tool.twin.run_for(0.05)?;
    let mut trip = scope(&mut tool, 0.001, 1)?;
    tool.twin
        .chip
        .board
        .controls()
        .inject(Some(PlantFault::OpenHeater(1)));
    let after = scope(&mut tool, 0.003, 1)?;
    for (channel, after) in trip.iter_mut().zip(after) {
        channel.extend(after.into_iter().map(|(ms, v)| (ms + 1.0, v)));
    }
    picture("trip", "the second heater breaks after 1 ms", &trip)
}

/// Looks at the actuators for so long, at every so-many-th period of the PWM.
fn scope(tool: &mut Tool, seconds: f64, every: u32) -> Result<Trace> {
    let mut trace = Trace::default();
    let start_s = tool.twin.seconds();
    while tool.twin.seconds() < start_s + seconds {
        let at_ms = (tool.twin.seconds() - start_s) * 1e3;
        let drive_v = tool.twin.chip.board.heated_v();
        for (channel, volt) in trace.iter_mut().zip(drive_v) {
            channel.push((at_ms, volt));
        }
        tool.twin.run_for(PERIOD_S * f64::from(every))?;
    }
    Ok(trace)
}

fn picture(name: &str, title: &str, trace: &Trace) -> Result<()> {
    let path = workspace()
        .join(FOLDER)
        .join(format!("bring-up-{name}.svg"));
    fs::create_dir_all(path.parent().context("a folder")?)?;
    let lines = trace.iter().enumerate().map(|(channel, points)| Series {
        name: format!("channel {}", channel + 1),
        look: Look::Line(channel),
        points: points.clone(),
    });
    let panel = Panel {
        title: title.into(),
        x: "time (ms)".into(),
        y: "actuator (V)".into(),
        series: lines.collect(),
    };
    fs::write(&path, sheet(&[vec![panel]]))?;
    println!("{}", path.display());
    Ok(())
}
