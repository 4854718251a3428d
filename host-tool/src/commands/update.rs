//! `update`: new firmware for a board.

use std::fmt;
use std::fs;
use std::path::Path;
use std::time::Duration;

use indicatif::ProgressBar;
use nusb::DeviceInfo;
use serde::Serialize;
use tokio::time::sleep;

use crate::board::{Board, choose, find};
use crate::error::ToolError;
use crate::report;
use crate::update::dfuse;
use crate::update::image::Image;
use crate::update::target::{self, InBootloader, Target};
use crate::update::{UsbBootloader, bootloaders};

/// How long a board may take to show up in its bootloader.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(10);

#[derive(Serialize)]
struct Updated {
    bytes: usize,
}

pub(super) async fn run(file: &Path, board: Option<&str>, json: bool) -> Result<(), ToolError> {
    let elf = fs::read(file).map_err(|source| ToolError::Read {
        path: file.to_owned(),
        source,
    })?;
    let image = Image::from_elf(&elf).map_err(|error| ToolError::Image {
        path: file.to_owned(),
        error,
    })?;
    let found = bootloader_of(board).await?;
    let mut bootloader = UsbBootloader::open(&found).map_err(|error| ToolError::Open {
        board: "in its bootloader".to_owned(),
        reason: error.to_string(),
    })?;
    let bar = match json {
        true => ProgressBar::hidden(),
        false => ProgressBar::new(image.bytes().len() as u64),
    };
    dfuse::update(&mut bootloader, &image, |written| {
        bar.set_position(written as u64)
    })?;
    bar.finish_and_clear();
    let bytes = image.bytes().len();
    report::print(&Updated { bytes }, json);
    Ok(())
}

/// The bootloader of the chosen board, which is sent there if it runs its firmware.
async fn bootloader_of(board: Option<&str>) -> Result<DeviceInfo, ToolError> {
    let board = board.filter(|name| !name.contains('/'));
    let running: Vec<String> = find().into_iter().map(|board| board.name).collect();
    let mut devices = bootloaders();
    match target::choose(board, &running, &known(&devices))? {
        Target::InBootloader(place) => Ok(devices.swap_remove(place)),
        Target::Running(name) => enter_bootloader(&name).await,
    }
}

fn known(devices: &[DeviceInfo]) -> Vec<InBootloader> {
    let serial = |device: &DeviceInfo| device.serial_number().map(str::to_owned);
    let devices = devices.iter();
    devices
        .map(|device| InBootloader {
            serial: serial(device),
        })
        .collect()
}

/// Sends a board to its bootloader, and waits for it there: for this board, whatever else is in its bootloader.
async fn enter_bootloader(name: &str) -> Result<DeviceInfo, ToolError> {
    Board::open(&choose(Some(name))?)
        .await?
        .enter_bootloader()
        .await?;
    let pause = Duration::from_millis(100);
    for _ in 0..LEAVE_TIMEOUT.as_millis() / pause.as_millis() {
        let mut devices = bootloaders();
        if let Some(Target::InBootloader(place)) = target::place_of(name, &known(&devices)) {
            return Ok(devices.swap_remove(place));
        }
        sleep(pause).await;
    }
    Err(ToolError::NoBootloader)
}

impl fmt::Display for Updated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} bytes written, read back and started", self.bytes)
    }
}
