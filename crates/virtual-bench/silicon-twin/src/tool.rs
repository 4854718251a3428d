//! A tool in the same process: it asks the board in the firmware's own protocol, over the firmware's own USB driver, and only
//! the board's time passes.

use mirror_protocol::{Hello, HelloEndpoint, Identity, PROTOCOL_VERSION, WireError};
use postcard_rpc::header::{VarHeader, VarKey, VarSeq};
use postcard_rpc::standard_icd::ERROR_KEY;
use postcard_rpc::{Endpoint, Key};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Failure, Twin};

/// A board answers within so many seconds of its time, or not at all: it erases a page in 22 ms, and two or three of them
/// where a log or a store is full.
const PATIENCE_S: f64 = 0.3;
/// A host knows a device by then: debounce, two resets and some requests, after a start that erases a page.
const KNOWN_S: f64 = 1.0;

/// A board, and what asks it.
#[derive(Clone, Debug)]
pub struct Tool {
    /// The board.
    pub twin: Twin,
    sequence: u16,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum AskError {
    /// The program failed.
    #[error("the program fails: {0}")]
    Failed(Box<Failure>),
    /// The host does not know the device.
    #[error("the host does not know the device: {0}")]
    Unknown(String),
    /// Nothing came for so many seconds of the board's time.
    #[error("no answer in {0} s of the board's time")]
    Silence(f64),
    /// What came is no answer to this request.
    #[error("the answer cannot be read: {0}")]
    Unreadable(postcard::Error),
    /// The board did not understand the request.
    #[error("the board does not understand the request: {0:?}")]
    NotUnderstood(WireError),
}

impl From<Failure> for AskError {
    fn from(failure: Failure) -> Self {
        Self::Failed(Box::new(failure))
    }
}

impl Tool {
    /// In front of `twin`.
    pub fn new(mut twin: Twin) -> Self {
        twin.chip.usb_host.listen(true);
        Self { twin, sequence: 0 }
    }

    /// Lets time pass until the host knows the device, and greets it.
    ///
    /// # Errors
    /// Where the program fails, or the host does not come to know the device, or it does not answer.
    pub fn connect(&mut self) -> Result<Identity, AskError> {
        let end_s = self.twin.seconds() + KNOWN_S;
        self.twin.run_until(|twin| {
            let host = &twin.chip.usb_host;
            host.device().is_some() || host.failure().is_some() || twin.seconds() > end_s
        })?;
        let host = &mut self.twin.chip.usb_host;
        if host.device().is_none() {
            let why = host.failure().unwrap_or("it is not there");
            return Err(AskError::Unknown(why.to_owned()));
        }
        host.listen(true);
        self.ask::<HelloEndpoint>(&Hello {
            protocol_version: PROTOCOL_VERSION,
        })
    }

    /// Sends a request, without waiting for its answer.
    pub fn send<E: Endpoint>(&mut self, request: &E::Request)
    where
        E::Request: Serialize,
    {
        self.sequence = self.sequence.wrapping_add(1);
        let frame = frame::<E>(self.sequence, request);
        self.twin.chip.usb_host.send(&frame);
    }

    /// Sends a request and lets time pass until it is answered.
    ///
    /// # Errors
    /// Where the program fails, or does not answer.
    pub fn ask<E: Endpoint>(&mut self, request: &E::Request) -> Result<E::Response, AskError>
    where
        E::Request: Serialize,
        E::Response: DeserializeOwned,
    {
        self.send::<E>(request);
        let end_s = self.twin.seconds() + PATIENCE_S;
        while self.twin.seconds() < end_s {
            self.twin
                .run_until(|twin| twin.chip.usb_host.has_received() || twin.seconds() > end_s)?;
            while let Some(frame) = self.twin.chip.usb_host.receive() {
                if let Some(answer) = answer::<E>(&frame, self.sequence) {
                    return answer
                        .map_err(AskError::Unreadable)?
                        .map_err(AskError::NotUnderstood);
                }
            }
        }
        Err(AskError::Silence(PATIENCE_S))
    }
}

/// A request as it stands on the link.
///
/// # Panics
/// Where a message cannot be serialised, which none is.
pub fn frame<E: Endpoint>(sequence: u16, request: &E::Request) -> Vec<u8>
where
    E::Request: Serialize,
{
    let header = VarHeader {
        key: VarKey::Key8(E::REQ_KEY),
        seq_no: VarSeq::Seq2(sequence),
    };
    let mut frame = header.write_to_vec();
    frame.extend(postcard::to_stdvec(request).expect("messages serialise"));
    frame
}

/// What a frame answers to the request of this number: the response, or that it was not understood. `None` where it answers
/// something else.
pub fn answer<E: Endpoint>(
    frame: &[u8],
    sequence: u16,
) -> Option<postcard::Result<Result<E::Response, WireError>>>
where
    E::Response: DeserializeOwned,
{
    let (header, body) = VarHeader::take_from_slice(frame)?;
    if header.seq_no != VarSeq::Seq2(sequence) {
        return None;
    }
    if is(header.key, E::RESP_KEY) {
        Some(postcard::from_bytes(body).map(Ok))
    } else if is(header.key, ERROR_KEY) {
        Some(postcard::from_bytes(body).map(Err))
    } else {
        None
    }
}

/// Whether the board's shortened key stands for `key`.
fn is(short: VarKey, key: Key) -> bool {
    let mut long = VarKey::Key8(key);
    long.shrink_to(short.kind());
    long == short
}
