//! The link to an emulated board: frames over its socket.

use std::io;
use std::path::Path;

use postcard_rpc::host_client::{WireRx, WireTx};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::UnixStream;
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};

use super::framing::{Decoder, encode};

/// The sending half.
pub(super) struct SocketTx(OwnedWriteHalf);

/// The receiving half, with what has arrived of the next frame.
pub(super) struct SocketRx {
    socket: OwnedReadHalf,
    decoder: Decoder,
}

/// Connects to the board behind `path`.
pub(super) async fn connect(path: &Path) -> io::Result<(SocketTx, SocketRx)> {
    let (reader, mut writer) = UnixStream::connect(path).await?.into_split();
    // Ends whatever an earlier tool left unfinished, so that the next frame starts afresh.
    writer.write_all(&[0]).await?;
    Ok((
        SocketTx(writer),
        SocketRx {
            socket: reader,
            decoder: Decoder::default(),
        },
    ))
}

impl WireTx for SocketTx {
    type Error = io::Error;

    async fn send(&mut self, frame: Vec<u8>) -> io::Result<()> {
        self.0.write_all(&encode(&frame)).await
    }
}

impl WireRx for SocketRx {
    type Error = io::Error;

    async fn receive(&mut self) -> io::Result<Vec<u8>> {
        loop {
            if let Some(frame) = self.decoder.next_frame() {
                return Ok(frame);
            }
            if self.socket.read_buf(self.decoder.buffer()).await? == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
        }
    }
}
