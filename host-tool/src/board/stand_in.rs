//! Who has a board answers in its place those who only look, on a socket beside its lock and by the board's own frames.
//! What drives is not passed on, nor is a greeting, after which the board could be driven again although it was stopped.

use std::fs;
use std::io;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use board_sockets::is_ours;
use mirror_protocol::{
    CalibrationEndpoint, CalibrationReadEndpoint, ERROR_PATH, FaultLogEndpoint, HelloEndpoint,
    Identity, SenseEndpoint, StatusEndpoint, WireError,
};
use postcard_rpc::header::{VarHeader, VarKey};
use postcard_rpc::host_client::{HostClient, HostErr};
use postcard_rpc::postcard_schema::Schema;
use postcard_rpc::{Endpoint, Key};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::Mutex;
use tokio::task::{JoinHandle, JoinSet};
use tokio::time::{sleep, timeout};

use super::answer::ANSWER_TIMEOUT;
use super::find::Found;
use super::framing::{Decoder, encode};
use super::owner::look_socket;
use super::view::View;
use crate::verbosity::detail;

/// So many look at once; the next one waits until one of them has gone.
const LOOKERS: usize = 16;
/// Who neither asks for so long nor takes an answer is sent away: a look is one request after the other.
const SILENCE: Duration = Duration::from_secs(2);
/// From one attempt to let somebody in to the next, where the system has no handles left.
const RETRY: Duration = Duration::from_millis(100);

/// Answers for as long as it is kept.
#[derive(Debug)]
pub(super) struct StandIn {
    answering: JoinHandle<()>,
    socket: PathBuf,
}

impl StandIn {
    /// Begins to answer in the place of a board that this process has locked. `None` where there can be no socket: others
    /// then learn who has the board, and no more.
    pub(super) fn begin(found: &Found, view: &View) -> Option<Self> {
        let socket = look_socket(found)?;
        let listener = listen(&socket);
        let listener = listener.inspect_err(|error| {
            detail(format_args!("nobody can look at {}: {error}", found.name));
        });
        let board = Known {
            client: view.client().clone(),
            identity: view.identity().clone(),
            turn: Mutex::new(()),
        };
        Some(Self {
            answering: tokio::spawn(let_in(listener.ok()?, Arc::new(board))),
            socket,
        })
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        self.answering.abort();
        // One that is left behind is nobody's, as after a kill.
        let _ = fs::remove_file(&self.socket);
    }
}

/// Listens where one that was killed may have left its socket; anything else that is there is left alone.
fn listen(path: &Path) -> io::Result<UnixListener> {
    if fs::symlink_metadata(path).is_ok_and(|there| there.file_type().is_socket()) {
        fs::remove_file(path)?;
    }
    let listener = UnixListener::bind(path)?;
    fs::set_permissions(path, fs::Permissions::from_mode(0o600))?;
    Ok(listener)
}

async fn let_in(listener: UnixListener, board: Arc<Known>) {
    let mut lookers = JoinSet::new();
    loop {
        while lookers.try_join_next().is_some() {}
        if lookers.len() >= LOOKERS {
            lookers.join_next().await;
        }
        match listener.accept().await {
            Ok((looker, _)) if is_own(&looker) => {
                lookers.spawn(serve(looker, board.clone()));
            }
            Ok(_) => {}
            Err(_) => sleep(RETRY).await,
        }
    }
}

fn is_own(looker: &UnixStream) -> bool {
    looker.peer_cred().is_ok_and(|peer| is_ours(peer.uid()))
}

/// Answers a looker until it goes, stalls, or sends what is no request.
async fn serve(mut looker: UnixStream, board: Arc<Known>) {
    let mut decoder = Decoder::default();
    loop {
        while let Some(request) = decoder.next_frame() {
            let Some(answer) = board.answer(&request).await else {
                return;
            };
            let answer = encode(&answer);
            let Ok(Ok(())) = timeout(SILENCE, looker.write_all(&answer)).await else {
                return;
            };
        }
        let Ok(Ok(1..)) = timeout(SILENCE, looker.read_buf(decoder.buffer())).await else {
            return;
        };
    }
}

/// What is known of the board, and how it is asked for more.
struct Known {
    client: HostClient<WireError>,
    identity: Identity,
    /// One looker asks the board at a time, so that however many there are, they hold up who has it by one request.
    turn: Mutex<()>,
}

impl Known {
    /// The answer to a frame. `None` where it is no request, or the board has gone.
    async fn answer(&self, frame: &[u8]) -> Option<Vec<u8>> {
        let (VarHeader { key, seq_no }, body) = VarHeader::take_from_slice(frame)?;
        let answered = match key {
            VarKey::Key8(key) => self.answer_to(key, body).await,
            _ => Err(HostErr::Wire(WireError::UnknownKey)),
        };
        let (key, body) = match answered {
            Ok(answer) => answer,
            Err(HostErr::Wire(error)) => {
                let body = postcard::to_stdvec(&error).ok()?;
                (Key::for_path::<WireError>(ERROR_PATH), body)
            }
            Err(_) => return None,
        };
        let key = VarKey::Key8(key);
        let mut answer = VarHeader { key, seq_no }.write_to_vec();
        answer.extend(body);
        Some(answer)
    }

    /// What may be asked; everything else is unknown here.
    async fn answer_to(&self, key: Key, body: &[u8]) -> Answer {
        match key {
            HelloEndpoint::REQ_KEY => {
                let identity = postcard::to_stdvec(&self.identity)?;
                Ok((HelloEndpoint::RESP_KEY, identity))
            }
            StatusEndpoint::REQ_KEY => self.ask::<StatusEndpoint>(body).await,
            CalibrationEndpoint::REQ_KEY => self.ask::<CalibrationEndpoint>(body).await,
            CalibrationReadEndpoint::REQ_KEY => self.ask::<CalibrationReadEndpoint>(body).await,
            SenseEndpoint::REQ_KEY => self.ask::<SenseEndpoint>(body).await,
            FaultLogEndpoint::REQ_KEY => self.ask::<FaultLogEndpoint>(body).await,
            _ => Err(HostErr::Wire(WireError::UnknownKey)),
        }
    }

    async fn ask<E>(&self, body: &[u8]) -> Answer
    where
        E: Endpoint,
        E::Request: Serialize + DeserializeOwned + Schema,
        E::Response: Serialize + DeserializeOwned + Schema,
    {
        let Ok(request) = postcard::from_bytes::<E::Request>(body) else {
            return Err(HostErr::Wire(WireError::DeserFailed));
        };
        let _turn = self.turn.lock().await;
        let answer = timeout(ANSWER_TIMEOUT, self.client.send_resp::<E>(&request)).await;
        let answer = answer.map_err(|_| HostErr::Closed)??;
        Ok((E::RESP_KEY, postcard::to_stdvec(&answer)?))
    }
}

/// The key of an answer, and its message.
type Answer = Result<(Key, Vec<u8>), HostErr<WireError>>;

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::os::unix::net;
    use std::sync::Mutex as Shared;

    use mirror_protocol::{OffEndpoint, PROTOCOL_VERSION, StatusReply, Telemetry, Text};

    use super::super::claim::Claim;
    use super::super::find::Place;
    use super::super::link::Board;
    use super::super::look::Seen;
    use super::super::owner::Owner;
    use super::super::stop_mark::StopMark;
    use super::super::tests::status;
    use super::*;
    use crate::error::ToolError;

    fn identity(protocol_version: u16) -> Identity {
        let text = |text| Text::try_from(text).expect("short");
        Identity {
            protocol_version,
            firmware_version: text("9.9.9"),
            build: text("fake"),
            board: text("fake board"),
            is_emulated: true,
            tick_hz: 10_000,
        }
    }

    /// What a fake board was asked.
    type Asked = Arc<Shared<Vec<Key>>>;

    /// Listens on `path` as a board that greets by this version, tells its status, and understands nothing else.
    fn fake(path: &Path, protocol_version: u16) -> Asked {
        let listener = listen(path).expect("a socket");
        let asked = Asked::default();
        let noted = asked.clone();
        tokio::spawn(async move {
            while let Ok((mut tool, _)) = listener.accept().await {
                let mut decoder = Decoder::default();
                while let Ok(1..) = tool.read_buf(decoder.buffer()).await {
                    while let Some(request) = decoder.next_frame() {
                        let (header, _) = VarHeader::take_from_slice(&request).expect("a request");
                        let VarKey::Key8(key) = header.key else {
                            panic!("keys are whole");
                        };
                        noted.lock().expect("nobody panics").push(key);
                        let (key, body) = match key {
                            HelloEndpoint::REQ_KEY => (
                                HelloEndpoint::RESP_KEY,
                                postcard::to_stdvec(&identity(protocol_version)),
                            ),
                            _ => (
                                StatusEndpoint::RESP_KEY,
                                postcard::to_stdvec(&StatusReply::Ok(status(Telemetry::default()))),
                            ),
                        };
                        let (key, seq_no) = (VarKey::Key8(key), header.seq_no);
                        let mut answer = VarHeader { key, seq_no }.write_to_vec();
                        answer.extend(body.expect("it serialises"));
                        tool.write_all(&encode(&answer)).await.expect("it is read");
                    }
                }
            }
        });
        asked
    }

    /// A folder of one's own, and a board whose socket is to be in it.
    fn place() -> (tempfile::TempDir, Found, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let name = "a".to_owned();
        let look = path.with_extension("look");
        let place = Place::Socket { path };
        (folder, Found { name, place }, look)
    }

    fn socket(found: &Found) -> &Path {
        match &found.place {
            Place::Socket { path } => path,
            Place::Usb { .. } => panic!("it is emulated"),
        }
    }

    #[tokio::test]
    async fn who_looks_reads_the_board_and_neither_drives_nor_greets_it() {
        let (_folder, found, _) = place();
        let asked = fake(socket(&found), PROTOCOL_VERSION);
        let board = Board::open(&found).await.expect("it answers");
        // Two at once.
        let (one, other) = tokio::join!(Board::look(&found), Board::look(&found));
        for seen in [one, other] {
            let Ok(Seen::Through(view, owner)) = seen else {
                panic!("{seen:?}");
            };
            assert_eq!(owner.process, std::process::id());
            assert_eq!(view.identity(), board.identity());
            assert_eq!(
                view.status().await.expect("it is passed on"),
                status(Telemetry::default())
            );
            let driven = view.ask::<OffEndpoint>("turn off", &()).await;
            assert!(
                matches!(driven, Err(ToolError::NotUnderstood { .. })),
                "{driven:?}"
            );
            view.introduce().await.expect("who has the board answers");
        }
        let keys = asked.lock().expect("nobody panics").clone();
        let greetings = keys.iter().filter(|key| **key == HelloEndpoint::REQ_KEY);
        assert_eq!(greetings.count(), 1, "that of who has it");
        assert!(!keys.contains(&OffEndpoint::REQ_KEY));

        drop(board);
        let seen = Board::look(&found).await;
        assert!(matches!(seen, Ok(Seen::Open(_))), "{seen:?}");
    }

    #[tokio::test]
    async fn a_link_is_closed_where_the_greeting_fails() {
        let (_folder, found, _) = place();
        // It answers who comes next once who was there has gone.
        fake(socket(&found), PROTOCOL_VERSION + 1);
        for _ in 0..2 {
            let greeted = View::greet(&found).await;
            assert!(
                matches!(greeted, Err(ToolError::ProtocolVersion { .. })),
                "{greeted:?}"
            );
        }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn who_sends_rubbish_is_sent_away_and_who_stalls_keeps_nobody_waiting() {
        let (_folder, found, look) = place();
        fake(socket(&found), PROTOCOL_VERSION);
        let _board = Board::open(&found).await.expect("it answers");
        let connect = || net::UnixStream::connect(&look).expect("it listens");
        let _silent = connect();
        // The beginning of a frame, and no end.
        let mut endless = connect();
        endless.write_all(&[1; 1_000_000]).expect("it is read");
        let mut rubbish = connect();
        // A header needs more than one byte.
        rubbish.write_all(&encode(&[7])).expect("it is read");
        assert_eq!(rubbish.read(&mut [0]).expect("closed in order"), 0);
        let seen = Board::look(&found).await;
        assert!(matches!(seen, Ok(Seen::Through(..))), "{seen:?}");
    }

    #[tokio::test]
    async fn a_socket_that_a_killed_one_left_is_replaced_and_nothing_else_is() {
        let (_folder, found, look) = place();
        fake(socket(&found), PROTOCOL_VERSION);
        drop(net::UnixListener::bind(&look).expect("a socket"));
        let board = Board::open(&found).await.expect("it answers");
        let seen = Board::look(&found).await;
        assert!(matches!(seen, Ok(Seen::Through(..))), "{seen:?}");
        drop((seen, board));
        assert!(!look.exists(), "it tidies up");

        fs::write(&look, "precious").expect("a file");
        let board = Board::open(&found).await.expect("the board is there");
        let seen = Board::look(&found).await;
        assert!(matches!(seen, Ok(Seen::InUse(_))), "{seen:?}");
        drop(board);
        assert_eq!(fs::read(&look).expect("still there"), b"precious");
    }

    #[tokio::test]
    async fn who_is_stuck_or_of_another_version_is_named() {
        let (_folder, found, look) = place();
        fake(socket(&found), PROTOCOL_VERSION);
        let mark = StopMark::read(&found);
        let _claim = Claim::take(&found, &mark).await.expect("free");
        let in_use = async || match Board::look(&found).await {
            Ok(Seen::InUse(Owner { process, .. })) => process,
            seen => panic!("{seen:?}"),
        };
        // Of before there were such sockets.
        assert_eq!(in_use().await, std::process::id());
        let stuck = net::UnixListener::bind(&look).expect("a socket");
        assert_eq!(in_use().await, std::process::id());
        drop(stuck);
        fake(&look, PROTOCOL_VERSION + 1);
        assert_eq!(in_use().await, std::process::id());
    }
}
