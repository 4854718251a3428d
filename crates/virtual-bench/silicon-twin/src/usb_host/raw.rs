//! Transactions one by one, as no good host would make them.

use crate::chip::usb::Usb;

/// What a host that keeps no rule does on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Raw {
    /// Resets the bus, and goes on as if it had not.
    Reset,
    /// Lets the bus be idle, so that the device is suspended.
    Idle,
    /// A SETUP packet to an address.
    Setup(u8, [u8; 8]),
    /// A packet to an endpoint of an address, as data 0 or data 1.
    Out(u8, u8, Vec<u8>, bool),
    /// Asks an endpoint of an address for a packet.
    In(u8, u8),
}

/// Carries one out; how many bytes took the bus.
pub(super) fn carry(usb: &mut Usb, raw: &Raw) -> usize {
    // Whatever the device answers, this host does not care.
    match raw {
        Raw::Reset => usb.bus_reset(),
        Raw::Idle => usb.idle(),
        Raw::Setup(address, packet) => {
            let _ = usb.setup(*address, *packet);
        }
        Raw::Out(address, endpoint, packet, toggle) => {
            let _ = usb.send(*address, *endpoint, packet, *toggle);
            return packet.len();
        }
        Raw::In(address, endpoint) => {
            let fetched = usb.fetch(*address, *endpoint);
            return fetched.map_or(0, |(packet, _)| packet.len());
        }
    }
    8
}
