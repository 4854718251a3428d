//! Which boards are there.

use std::fs;
use std::path::{Path, PathBuf};

use board_sockets::{boards_directory, check_folder, is_listening};
use mirror_protocol::usb::{PRODUCT, PRODUCT_ID, VENDOR_ID};
use nusb::DeviceInfo;
use serde::Serialize;

use crate::error::ToolError;
use crate::names::nearest;

/// A board that is there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Found {
    /// What to call it: a serial number, or an emulated board's name.
    pub name: String,
    /// Where it is.
    #[serde(flatten)]
    pub place: Place,
}

/// How a board is reached.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "link", rename_all = "lowercase")]
pub enum Place {
    /// On USB, with its serial number.
    Usb {
        /// Serial number, the microcontroller's unique id.
        serial: String,
    },
    /// An emulated board's socket.
    Socket {
        /// Its path.
        path: PathBuf,
    },
}

impl Found {
    /// Whether it is on USB.
    pub fn is_usb(&self) -> bool {
        matches!(self.place, Place::Usb { .. })
    }
}

/// Every board that can be reached from here, USB first.
pub fn find() -> Vec<Found> {
    let mut found = find_usb();
    found.extend(find_sockets(&boards_directory()));
    found
}

/// The board called `name`, or the only one there is.
///
/// # Errors
/// Where there is none, or more than one to choose from; where emulated boards are in a folder that is not
/// trusted, and none of the others is meant.
pub fn choose(name: Option<&str>) -> Result<Found, ToolError> {
    if let Some(path) = name.filter(|name| name.contains('/')) {
        return Ok(Found {
            name: path.to_owned(),
            place: Place::Socket { path: path.into() },
        });
    }
    let mut found = find();
    let names: Vec<String> = found.iter().map(|board| board.name.clone()).collect();
    if let Some(name) = name {
        return found
            .into_iter()
            .find(|board| board.name == name)
            .ok_or_else(|| {
                let found = if names.is_empty() {
                    "none".to_owned()
                } else {
                    names.join(", ")
                };
                missing(ToolError::NoSuchBoard {
                    nearest: nearest(name, &names),
                    name: name.to_owned(),
                    found,
                })
            });
    }
    match (found.pop(), names.len()) {
        (None, _) => Err(none_found()),
        (Some(only), 1) => Ok(only),
        _ => Err(ToolError::SeveralBoards {
            found: names.join(", "),
        }),
    }
}

/// That there is no board at all, or why those in the folder of emulated ones do not count.
pub(crate) fn none_found() -> ToolError {
    missing(ToolError::NoBoard)
}

/// `error`, unless boards were passed over for where they are.
fn missing(error: ToolError) -> ToolError {
    let folder = boards_directory();
    match check_folder(&folder) {
        Err(untrusted) if folder.exists() => untrusted.into(),
        _ => error,
    }
}

fn find_usb() -> Vec<Found> {
    // A machine without USB has no USB boards.
    let Ok(devices) = nusb::list_devices() else {
        return Vec::new();
    };
    devices
        .filter(is_driver_board)
        .filter_map(|device| {
            let serial = device.serial_number()?.to_owned();
            Some(Found {
                name: serial.clone(),
                place: Place::Usb { serial },
            })
        })
        .collect()
}

/// Whether a USB device is a driver board.
pub(super) fn is_driver_board(device: &DeviceInfo) -> bool {
    (device.vendor_id(), device.product_id()) == (VENDOR_ID, PRODUCT_ID)
        && device
            .product_string()
            .is_none_or(|product| product == PRODUCT)
}

/// Sockets that somebody listens on; those that were left behind are passed over, and all of them where other
/// users could have put them there.
fn find_sockets(directory: &Path) -> Vec<Found> {
    let (Ok(()), Ok(entries)) = (check_folder(directory), fs::read_dir(directory)) else {
        return Vec::new();
    };
    let mut found: Vec<Found> = entries
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "sock"))
        .filter(|path| is_listening(path))
        .filter_map(|path| {
            let name = path.file_stem()?.to_string_lossy().into_owned();
            Some(Found {
                name,
                place: Place::Socket { path },
            })
        })
        .collect();
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found
}
