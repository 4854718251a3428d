//! The stop of a board on USB: a request on endpoint 0, for which no interface is claimed.

use std::io;

use mirror_protocol::usb::STOP_REQUEST;
use nusb::transfer::{ControlIn, ControlOut, ControlType, Recipient};

use super::find::is_driver_board;

/// Turns all channels off, and waits until a control tick has done it.
pub(super) async fn by_usb(serial: &str) -> io::Result<()> {
    let (control_type, recipient) = (ControlType::Vendor, Recipient::Device);
    let (request, value, index) = (STOP_REQUEST, 0, 0);
    let is_it = |device: &nusb::DeviceInfo| {
        is_driver_board(device) && device.serial_number() == Some(serial)
    };
    let device = nusb::list_devices()?.find(is_it);
    let device = device.ok_or(io::ErrorKind::NotFound)?.open()?;
    let stop = ControlOut {
        control_type,
        recipient,
        request,
        value,
        index,
        data: &[],
    };
    device.control_out(stop).await.into_result()?;
    let is_done = || ControlIn {
        control_type,
        recipient,
        request,
        value,
        index,
        length: 1,
    };
    while device.control_in(is_done()).await.into_result()? != [1] {}
    Ok(())
}
