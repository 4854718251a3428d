//! `update`: new firmware for a board.

use std::fmt;
use std::path::Path;
use std::time::Duration;

use nusb::DeviceInfo;
use serde::Serialize;
use tokio::time::sleep;

use crate::board::{Board, choose, find};
use crate::error::ToolError;
use crate::report;
use crate::update::dfuse;
use crate::update::package::{Package, numbers};
use crate::update::target::{self, InBootloader, Target};
use crate::update::{UsbBootloader, bootloaders};
use crate::verbosity::say;
use crate::working::bar;

/// How long a board may take to show up in its bootloader.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(10);

#[derive(Serialize)]
struct Updated {
    version: String,
    build: String,
    bytes: usize,
}

pub(super) async fn run(file: &Path, board: Option<&str>, json: bool) -> Result<(), ToolError> {
    let bytes = input_file::read(file, input_file::MOST_MADE)?;
    let package = Package::from_bytes(&bytes).map_err(|error| ToolError::Image {
        path: file.to_owned(),
        error,
    })?;
    let image = &package.image;
    let found = bootloader_of(board, &package, json).await?;
    let mut bootloader = UsbBootloader::open(&found).map_err(|error| ToolError::Open {
        board: "in its bootloader".to_owned(),
        reason: error.to_string(),
    })?;
    let bar = bar(image.bytes().len() as u64, json);
    dfuse::update(&mut bootloader, image, |written| {
        bar.set_position(written as u64)
    })?;
    bar.finish_and_clear();
    let updated = Updated {
        version: package.version.clone(),
        build: package.build.clone(),
        bytes: image.bytes().len(),
    };
    report::print(&updated, json);
    Ok(())
}

/// The bootloader of the chosen board, which is sent there if it runs its firmware.
async fn bootloader_of(
    board: Option<&str>,
    package: &Package,
    json: bool,
) -> Result<DeviceInfo, ToolError> {
    let board = board.filter(|name| !name.contains('/'));
    let running: Vec<String> = find().into_iter().map(|board| board.name).collect();
    let mut devices = bootloaders();
    match target::choose(board, &running, &known(&devices))? {
        Target::InBootloader(place) => Ok(devices.swap_remove(place)),
        Target::Running(name) => enter_bootloader(&name, package, json).await,
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
async fn enter_bootloader(
    name: &str,
    package: &Package,
    json: bool,
) -> Result<DeviceInfo, ToolError> {
    let board = Board::open(&choose(Some(name))?).await?;
    let running = &board.identity().firmware_version;
    if !json && is_older(&package.version, running) {
        say(format_args!(
            "the board runs firmware {running}; {} is older",
            package.version
        ));
    }
    board.enter_bootloader().await?;
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

/// Whether a version is below another, number by number; what is no version is not.
fn is_older(version: &str, than: &str) -> bool {
    let numbers = numbers(version).zip(numbers(than));
    numbers.is_some_and(|(version, than)| version < than)
}

impl fmt::Display for Updated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "firmware {} ({}): {} bytes written, read back and started",
            self.version, self.build, self.bytes
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_compared_number_by_number() {
        assert!(is_older("0.9.0", "0.10.0") && is_older("0.1.0", "1.0.0"));
        assert!(!is_older("0.10.0", "0.9.0") && !is_older("0.1.0", "0.1.0"));
        assert!(is_older("0.1.0-rc.1", "0.2.0") && !is_older("999.0.0", "0.1.0"));
        assert!(!is_older("not a version", "0.1.0") && !is_older("0.1.0", ""));
    }
}
