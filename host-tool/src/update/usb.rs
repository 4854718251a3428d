//! Bootloaders on USB.

use std::io;
use std::time::Duration;

use mirror_protocol::usb::{BOOTLOADER_PRODUCT_ID, BOOTLOADER_VENDOR_ID};
use nusb::descriptors::language_id::US_ENGLISH;
use nusb::transfer::{Control, ControlType, Recipient};
use nusb::{Device, DeviceInfo, Interface};

use super::dfuse::{Bootloader, Gone};
use super::target::has_flash_of_the_board;

const TIMEOUT: Duration = Duration::from_secs(3);

/// The flash is the first alternate setting of the only interface (AN2606).
const INTERFACE: u8 = 0;

/// The microcontrollers that are in their bootloader.
pub fn bootloaders() -> Vec<DeviceInfo> {
    let is_bootloader = |device: &DeviceInfo| {
        (device.vendor_id(), device.product_id()) == (BOOTLOADER_VENDOR_ID, BOOTLOADER_PRODUCT_ID)
    };
    // A machine without USB has none.
    nusb::list_devices().map_or(Vec::new(), |devices| {
        devices.filter(is_bootloader).collect()
    })
}

/// An open bootloader.
pub struct UsbBootloader(Interface);

impl UsbBootloader {
    /// Opens one of [`bootloaders`].
    ///
    /// # Errors
    /// What the system says, or that it is another microcontroller than the board's.
    pub fn open(device: &DeviceInfo) -> Result<Self, io::Error> {
        let device = device.open()?;
        let interface = device.claim_interface(INTERFACE)?;
        let layout = layout(&device, &interface).unwrap_or_default();
        if !has_flash_of_the_board(&layout) {
            return Err(io::Error::other(format!(
                "it is another microcontroller than the board's: its flash is `{layout}`"
            )));
        }
        interface.set_alt_setting(0)?;
        Ok(Self(interface))
    }
}

/// What the bootloader says of its flash: the name of the interface's first alternate setting.
fn layout(device: &Device, interface: &Interface) -> Option<String> {
    let name = interface.descriptors().next()?.string_index()?;
    device.get_string_descriptor(name, US_ENGLISH, TIMEOUT).ok()
}

fn control(request: u8, value: u16) -> Control {
    Control {
        control_type: ControlType::Class,
        recipient: Recipient::Interface,
        request,
        value,
        index: INTERFACE.into(),
    }
}

impl Bootloader for UsbBootloader {
    fn write(&mut self, request: u8, value: u16, data: &[u8]) -> Result<(), Gone> {
        let sent = self
            .0
            .control_out_blocking(control(request, value), data, TIMEOUT);
        sent.map(drop).map_err(|error| Gone(error.to_string()))
    }

    fn read(&mut self, request: u8, value: u16, length: usize) -> Result<Vec<u8>, Gone> {
        let mut bytes = vec![0; length];
        let received = self
            .0
            .control_in_blocking(control(request, value), &mut bytes, TIMEOUT)
            .map_err(|error| Gone(error.to_string()))?;
        bytes.truncate(received);
        Ok(bytes)
    }

    fn pause(&mut self, time: Duration) {
        std::thread::sleep(time);
    }
}
