//! The host link: the device of the driver board on a virtual bus.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use postcard_rpc::server::impls::embassy_usb_v0_5::EUsbWireTx;
use virtual_usb::DeviceSide;

use crate::usb;

/// Sends frames to the host.
pub type LinkTx = EUsbWireTx<CriticalSectionRawMutex, DeviceSide>;

/// Buffers of the device.
pub type Storage = usb::Storage<CriticalSectionRawMutex, DeviceSide>;

/// The device, and what receives and sends frames once it runs.
pub type Opened = usb::Opened<CriticalSectionRawMutex, DeviceSide>;
