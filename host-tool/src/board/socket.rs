//! Frames over an emulated board's socket: COBS between zero bytes.

use std::io;
use std::path::Path;

use postcard_rpc::host_client::{WireRx, WireTx};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::UnixStream;
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};

/// Longest frame that is waited for; longer ones are noise.
const MAX_FRAME_BYTES: usize = 4096;

/// The sending half.
pub(super) struct SocketTx(OwnedWriteHalf);

/// The receiving half, with what has arrived of the next frame.
pub(super) struct SocketRx {
    socket: OwnedReadHalf,
    arrived: Vec<u8>,
}

/// Connects to the board behind `path`.
pub(super) async fn connect(path: &Path) -> io::Result<(SocketTx, SocketRx)> {
    let (reader, mut writer) = UnixStream::connect(path).await?.into_split();
    // Ends whatever an earlier tool left unfinished, so that the next frame starts afresh.
    writer.write_all(&[0]).await?;
    Ok((SocketTx(writer), SocketRx { socket: reader, arrived: Vec::new() }))
}

impl WireTx for SocketTx {
    type Error = io::Error;

    async fn send(&mut self, frame: Vec<u8>) -> io::Result<()> {
        let mut bytes = cobs::encode_vec(&frame);
        bytes.push(0);
        self.0.write_all(&bytes).await
    }
}

impl WireRx for SocketRx {
    type Error = io::Error;

    async fn receive(&mut self) -> io::Result<Vec<u8>> {
        loop {
            while let Some(end) = self.arrived.iter().position(|byte| *byte == 0) {
                let rest = self.arrived.split_off(end + 1);
                let frame = std::mem::replace(&mut self.arrived, rest);
                // A frame that does not decode was disturbed; the board will be asked again.
                if let Ok(frame) = cobs::decode_vec(&frame[..end])
                    && !frame.is_empty()
                {
                    return Ok(frame);
                }
            }
            if self.arrived.len() > MAX_FRAME_BYTES {
                self.arrived.clear();
            }
            if self.socket.read_buf(&mut self.arrived).await? == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
        }
    }
}
