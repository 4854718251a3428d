//! Stops: each that a tool asks for by a FIFO becomes the vendor request on endpoint 0, and is told once the device says
//! that a control tick has carried it out (docs, the protocol).

use std::io;
use std::path::Path;

use emulated_board::StopFifos;

use crate::usb_host::{Request, UsbHost};

/// A vendor request to the device, in either direction (USB 2.0, table 9-2); its number is the protocol's.
const TO_DEVICE: u8 = 0x40;
const TO_HOST: u8 = 0xc0;
const STOP: u8 = 0x53;

/// The FIFOs, and the stops that wait to be confirmed.
#[derive(Debug)]
pub(super) struct Stops {
    fifos: StopFifos,
    waiting: Vec<u8>,
}

fn request(kind: u8, length: u16) -> Request {
    Request {
        kind,
        request: STOP,
        value: 0,
        length,
    }
}

impl Stops {
    /// Makes the FIFOs beside a socket.
    pub(super) fn beside(socket: &Path) -> io::Result<Self> {
        Ok(Self {
            fifos: StopFifos::beside(socket)?,
            waiting: Vec::new(),
        })
    }

    /// Hands new stops to the device, asks for those that wait, and tells those that are done.
    pub(super) fn exchange(&mut self, host: &mut UsbHost) {
        let marks = self.fifos.take();
        if !marks.is_empty() {
            if self.waiting.is_empty() {
                host.request(request(TO_DEVICE, 0));
                host.request(request(TO_HOST, 1));
            }
            self.waiting.extend(marks);
        }
        while let Some((answered, data)) = host.answer() {
            if answered != request(TO_HOST, 1) {
                continue;
            }
            match data.as_deref() {
                Some([0]) => host.request(request(TO_HOST, 1)),
                Some(_) => self.fifos.tell(&std::mem::take(&mut self.waiting)),
                None => self.waiting.clear(),
            }
        }
    }
}
