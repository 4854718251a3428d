//! `update`: new firmware for a board.

use std::fmt;
use std::fs;
use std::path::Path;
use std::time::Duration;

use indicatif::ProgressBar;
use nusb::DeviceInfo;
use serde::Serialize;
use tokio::time::sleep;

use crate::board::{Board, choose};
use crate::error::ToolError;
use crate::report;
use crate::update::dfuse;
use crate::update::image::Image;
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
    let found = match only(bootloaders())? {
        Some(bootloader) => bootloader,
        None => enter_bootloader(board).await?,
    };
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

/// Sends the chosen board to its bootloader, and waits for it there.
async fn enter_bootloader(board: Option<&str>) -> Result<DeviceInfo, ToolError> {
    Board::open(&choose(board)?)
        .await?
        .enter_bootloader()
        .await?;
    let pause = Duration::from_millis(100);
    for _ in 0..LEAVE_TIMEOUT.as_millis() / pause.as_millis() {
        if let Some(bootloader) = only(bootloaders())? {
            return Ok(bootloader);
        }
        sleep(pause).await;
    }
    Err(ToolError::NoBootloader)
}

/// The only one, if there is one. A bootloader does not say what board it is on.
fn only(mut found: Vec<DeviceInfo>) -> Result<Option<DeviceInfo>, ToolError> {
    match found.len() {
        0 | 1 => Ok(found.pop()),
        count => Err(ToolError::SeveralBootloaders { count }),
    }
}

impl fmt::Display for Updated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} bytes written, read back and started", self.bytes)
    }
}
