//! The link to an emulated board: frames over its socket.

use std::io;
use std::path::Path;
use std::time::Duration;

use board_sockets::is_ours;
use postcard_rpc::host_client::{WireRx, WireTx};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::UnixStream;
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};
use tokio::time::sleep;

use super::framing::{Decoder, encode};

/// The sending half.
pub(super) struct SocketTx(OwnedWriteHalf);

/// The receiving half, with what has arrived of the next frame.
pub(super) struct SocketRx {
    socket: OwnedReadHalf,
    decoder: Decoder,
}

/// From one attempt to connect to the next.
const RETRY: Duration = Duration::from_millis(20);

/// Connects to the board behind `path`, and waits for as long as it is taken.
pub(super) async fn connect(path: &Path) -> io::Result<(SocketTx, SocketRx)> {
    let socket = wait_for_room(path).await?;
    refuse_stranger(socket.peer_cred()?.uid())?;
    let (reader, mut writer) = socket.into_split();
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

/// The emulator takes one connection at a time, and its queue is short: tools that were there before,
/// and have long ended, fill it until the one that is connected leaves.
async fn wait_for_room(path: &Path) -> io::Result<UnixStream> {
    loop {
        match UnixStream::connect(path).await {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => sleep(RETRY).await,
            other => return other,
        }
    }
}

/// A socket that was looked at can have been exchanged since: the user who listens is who counts.
fn refuse_stranger(user: u32) -> io::Result<()> {
    match is_ours(user) {
        true => Ok(()),
        false => Err(io::Error::other(format!(
            "another user, number {user}, listens there"
        ))),
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::net::UnixListener;

    #[tokio::test]
    async fn a_board_of_another_user_is_not_greeted() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.sock");
        let _listener = UnixListener::bind(&path).expect("a socket");
        let socket = UnixStream::connect(&path).await.expect("it listens");
        let listening = socket.peer_cred().expect("Linux tells").uid();
        refuse_stranger(listening).expect("ours");
        let refused = refuse_stranger(listening + 1).expect_err("somebody else's");
        assert!(refused.to_string().contains("another user"), "{refused}");
    }

    #[tokio::test]
    async fn a_full_queue_is_waited_for() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.sock");
        let listener = UnixListener::bind(&path).expect("a socket");
        while UnixStream::connect(&path).await.is_ok() {}
        let mut waiting = tokio::spawn(async move { wait_for_room(&path).await.is_ok() });
        let early = tokio::time::timeout(5 * RETRY, &mut waiting).await;
        assert!(early.is_err(), "it cannot be connected yet");
        listener.accept().await.expect("an earlier one");
        assert!(waiting.await.expect("it ends"));
    }
}
