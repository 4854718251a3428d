//! Bytes on an emulated board's link, good ones and bad ones.

use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;

use host_tool::board::framing::{Decoder, encode};
use mirror_protocol::{Hello, HelloEndpoint, Identity, WireError};
use postcard_rpc::Endpoint;
use serde::Serialize;
use serde::de::DeserializeOwned;
use silicon_twin::tool;

use crate::bench::PATIENCE;

/// A link without the tool's care.
pub struct RawLink {
    socket: UnixStream,
    decoder: Decoder,
    sequence: u16,
}

impl RawLink {
    /// Connects to the board behind `socket`.
    ///
    /// # Errors
    /// Where nobody listens.
    pub fn connect(socket: &Path) -> io::Result<Self> {
        let socket = UnixStream::connect(socket)?;
        socket.set_read_timeout(Some(PATIENCE))?;
        Ok(Self {
            socket,
            decoder: Decoder::default(),
            sequence: 0,
        })
    }

    /// Leaves out sequence numbers, so that no answer to what was sent so far, however mutated, is taken for one to what
    /// comes.
    pub fn skip_sequences(&mut self) {
        self.sequence ^= 0x5a00;
    }

    /// Sends bytes as they are.
    ///
    /// # Errors
    /// Where the link is lost.
    pub fn send_bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.socket.write_all(bytes)
    }

    /// A request as it stands on the link.
    pub fn request<E: Endpoint>(&mut self, message: &E::Request) -> Vec<u8>
    where
        E::Request: Serialize,
    {
        self.sequence = self.sequence.wrapping_add(1);
        encode(&tool::frame::<E>(self.sequence, message))
    }

    /// Sends a request and waits for its answer: the response, or that it was not understood.
    ///
    /// # Errors
    /// Where the link is lost, or no answer comes.
    pub fn ask<E: Endpoint>(
        &mut self,
        message: &E::Request,
    ) -> io::Result<Result<E::Response, WireError>>
    where
        E::Request: Serialize,
        E::Response: DeserializeOwned,
    {
        let request = self.request::<E>(message);
        self.send_bytes(&request)?;
        loop {
            let frame = self.receive()?;
            if let Some(answer) = tool::answer::<E>(&frame, self.sequence) {
                return answer.map_err(io::Error::other);
            }
        }
    }

    /// Greets the board in some protocol version.
    ///
    /// # Errors
    /// Where the link is lost, or no answer comes.
    pub fn greet(&mut self, protocol_version: u16) -> io::Result<Result<Identity, WireError>> {
        self.ask::<HelloEndpoint>(&Hello { protocol_version })
    }

    fn receive(&mut self) -> io::Result<Vec<u8>> {
        let mut bytes = [0; 512];
        loop {
            if let Some(frame) = self.decoder.next_frame() {
                return Ok(frame);
            }
            match self.socket.read(&mut bytes)? {
                0 => return Err(io::ErrorKind::UnexpectedEof.into()),
                got => self.decoder.buffer().extend(&bytes[..got]),
            }
        }
    }
}
