//! A USB full-speed bus in memory: what `embassy-usb` asks of a device controller on one side, a host
//! on the other.
//!
//! The device side does what the controller of the STM32G4 does: an endpoint holds one packet at a
//! time and is busy (NAK) until it is fetched, a bus reset disables every endpoint and drops what it
//! holds, a suspended bus carries nothing, and a setup packet ends whatever control transfer was under
//! way. Nothing waits for a clock: every future looks again each time it is polled.

mod bus;
mod device;
mod host;

pub use bus::MAX_PACKET_BYTES;
pub use device::{DeviceBus, DeviceControl, DeviceEndpoint, DeviceSide};
pub use host::{ControlRequest, HostSide, UsbFailure};

use bus::Wire;

/// A bus with nothing on it yet.
pub fn bus() -> (DeviceSide, HostSide) {
    let wire = Wire::default();
    (DeviceSide::new(wire.clone()), HostSide::new(wire))
}
