//! Bootloaders on USB.

use std::time::Duration;

use mirror_protocol::usb::{BOOTLOADER_PRODUCT_ID, BOOTLOADER_VENDOR_ID};
use nusb::transfer::{Control, ControlType, Recipient};
use nusb::{DeviceInfo, Interface};

use super::dfuse::{Bootloader, Gone};

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
    /// What the system says.
    pub fn open(device: &DeviceInfo) -> Result<Self, std::io::Error> {
        let interface = device.open()?.claim_interface(INTERFACE)?;
        interface.set_alt_setting(0)?;
        Ok(Self(interface))
    }
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
