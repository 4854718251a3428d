//! A client's socket: lines in, answers out, and its end, which is seen whatever is going on.

use std::pin::pin;
use std::time::Duration;

use socket2::{SockRef, TcpKeepalive};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::net::tcp::OwnedReadHalf;
use tokio::task::yield_now;

use crate::scpi::{Error, Input, Kind, MOST_LINE_BYTES};
use crate::serve::device::Client;
use crate::serve::session::Session;

/// Before another attempt at what failed for want of something that the machine has too little of.
pub(super) const PAUSE: Duration = Duration::from_millis(100);
/// A client from which nothing came for so long is asked whether it is there, and taken for gone after as many questions.
const SILENCE: Duration = Duration::from_secs(4);
const QUESTION: Duration = Duration::from_secs(2);
const QUESTIONS: u32 = 3;
/// What is read at a time.
const PIECE_BYTES: usize = 4096;

/// Carries out what a client says, until it goes. What it drives is off then.
pub(super) async fn converse(stream: TcpStream, mut session: Session) {
    // An answer is one short packet, which is not to wait for more to come.
    let _ = stream.set_nodelay(true);
    let _ = ask_after_silence(&stream);
    let (mut reader, mut writer) = stream.into_split();
    let mut input = Input::default();
    let (client, speaking_to) = (session.client(), session.speaking_to());
    let drives = || {
        let device = speaking_to.borrow();
        device
            .as_ref()
            .is_some_and(|device| device.is_driven_by(&client))
    };
    let mut is_gone = false;
    while !(is_gone && drives()) {
        let Some(line) = input.next_line() else {
            match is_gone {
                true => break,
                false => is_gone = !read_once(&mut reader, &mut input, &client).await,
            }
            continue;
        };
        let mut answering = pin!(async {
            let answer = session.answer(&line).await;
            writer.write_all(&answer).await.is_ok()
        });
        let is_answered = loop {
            tokio::select! {
                is_answered = &mut answering => break is_answered,
                is_there = read_once(&mut reader, &mut input, &client), if !is_gone => {
                    is_gone = !is_there;
                    // One that drove is dead for all that is known here; one that only asked gets its answers.
                    if is_gone && drives() {
                        break false;
                    }
                }
            }
        };
        if !is_answered {
            break;
        }
        yield_now().await;
    }
    session.end().await;
}

/// Has the system end a connection whose other end does not answer any more: a cable that was pulled says nothing.
///
/// # Errors
/// Where the system cannot.
fn ask_after_silence(stream: &TcpStream) -> std::io::Result<()> {
    let socket = SockRef::from(stream);
    let keepalive = TcpKeepalive::new().with_time(SILENCE);
    let keepalive = keepalive.with_interval(QUESTION).with_retries(QUESTIONS);
    socket.set_tcp_keepalive(&keepalive)?;
    // While an answer is under way nothing is asked; it is to arrive in the same time.
    #[cfg(target_os = "linux")]
    socket.set_tcp_user_timeout(Some(SILENCE + QUESTION * QUESTIONS))?;
    Ok(())
}

/// Reads what has come. `false` where the client has gone.
async fn read_once(reader: &mut OwnedReadHalf, input: &mut Input, client: &Client) -> bool {
    let mut piece = [0; PIECE_BYTES];
    let Ok(count @ 1..) = reader.read(&mut piece).await else {
        return false;
    };
    if input.push(&piece[..count]).is_err() {
        let said =
            format!("a line has at most {MOST_LINE_BYTES} bytes, and four such lines may wait");
        client
            .status()
            .push(Error::new(Kind::InputBufferOverrun, said));
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::net::TcpListener;

    #[tokio::test]
    async fn the_system_asks_after_a_client_that_is_silent() {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let address = listener.local_addr().expect("an address");
        let _client = TcpStream::connect(address).await.expect("it listens");
        let (stream, _) = listener.accept().await.expect("a client");
        ask_after_silence(&stream).expect("possible");
        let socket = SockRef::from(&stream);
        assert!(socket.keepalive().expect("known"));
        assert_eq!(socket.tcp_keepalive_time().expect("known"), SILENCE);
        assert_eq!(socket.tcp_keepalive_retries().expect("known"), QUESTIONS);
    }
}
