//! A control transfer, a transaction at a time (USB 2.0, section 8.5.3).

use std::fmt;

use crate::chip::usb::{Answer, Usb};

/// A request on endpoint 0 (USB 2.0, section 9.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// bmRequestType.
    pub kind: u8,
    /// bRequest.
    pub request: u8,
    /// wValue.
    pub value: u16,
    /// wLength: bytes that are read. What writes carries no data here.
    pub length: u16,
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "request {} of type {:#04x}", self.request, self.kind)
    }
}

impl Request {
    fn packet(self) -> [u8; 8] {
        let ([v0, v1], [l0, l1]) = (self.value.to_le_bytes(), self.length.to_le_bytes());
        [self.kind, self.request, v0, v1, 0, 0, l0, l1]
    }

    fn reads(self) -> bool {
        self.kind & 0x80 != 0 && self.length > 0
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Setup,
    Data,
    Status,
}

/// A transfer that is under way.
#[derive(Clone, Debug)]
pub(super) struct Transfer {
    pub(super) request: Request,
    stage: Stage,
    data: Vec<u8>,
    silences: u32,
}

/// What a transaction brought.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// It goes on.
    Continues,
    /// The device was not ready.
    Waits,
    /// It is done; what was read.
    Done(Vec<u8>),
    /// It failed, for this reason.
    Failed(&'static str),
}

/// A host gives up after so many tokens without an answer (USB 2.0, section 8.6.2).
const SILENCES: u32 = 3;

impl Transfer {
    pub(super) fn new(request: Request) -> Self {
        Self {
            request,
            stage: Stage::Setup,
            data: Vec::new(),
            silences: 0,
        }
    }

    /// One transaction; `packet_bytes` is what endpoint 0 takes at most.
    pub(super) fn step(&mut self, usb: &mut Usb, address: u8, packet_bytes: usize) -> Progress {
        match self.stage {
            Stage::Setup => {
                let answer = usb.setup(address, self.request.packet());
                let next = match self.request.reads() {
                    true => Stage::Data,
                    false => Stage::Status,
                };
                self.follow(answer, next)
            }
            Stage::Data => match usb.fetch(address, 0) {
                Ok((packet, _)) => {
                    let is_last = packet.len() < packet_bytes;
                    self.data.extend(packet);
                    if is_last || self.data.len() >= usize::from(self.request.length) {
                        self.stage = Stage::Status;
                    }
                    Progress::Continues
                }
                Err(answer) => self.follow(answer, Stage::Data),
            },
            Stage::Status if self.request.reads() => match usb.send(address, 0, &[], true) {
                Answer::Ack => Progress::Done(std::mem::take(&mut self.data)),
                answer => self.follow(answer, Stage::Status),
            },
            Stage::Status => match usb.fetch(address, 0) {
                Ok((packet, true)) if packet.is_empty() => Progress::Done(Vec::new()),
                Ok(_) => Progress::Failed("the status of a request is no empty packet of data 1"),
                Err(answer) => self.follow(answer, Stage::Status),
            },
        }
    }

    fn follow(&mut self, answer: Answer, next: Stage) -> Progress {
        match answer {
            Answer::Ack => {
                (self.stage, self.silences) = (next, 0);
                Progress::Continues
            }
            Answer::Nak => Progress::Waits,
            Answer::Stall => Progress::Failed("the device refuses the request"),
            Answer::Silence => {
                self.silences += 1;
                match self.silences < SILENCES {
                    true => Progress::Waits,
                    false => Progress::Failed("the device does not answer"),
                }
            }
        }
    }
}
