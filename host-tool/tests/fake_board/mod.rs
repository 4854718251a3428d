//! A stand-in for a board that misbehaves on purpose.

use std::fs::{self, Permissions};
use std::io::{Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::thread;

use host_tool::board::framing::{Decoder, encode};
use mirror_protocol::{HelloEndpoint, Identity, PROTOCOL_VERSION, Text};
use postcard_rpc::Endpoint;
use postcard_rpc::header::{VarHeader, VarKey};

/// How a fake board answers the greeting, and everything after it.
#[derive(Clone, Copy)]
pub(crate) enum Fake {
    /// Greets with this protocol version, and is silent from then on.
    Greets(u16),
    /// Never answers.
    Silent,
    /// Greets well and hangs up at the next request.
    HangsUp,
    /// Answers the greeting with noise, then properly, and hangs up at the next request.
    Noisy,
}

/// A fake board called `name` in `directory`, for as long as the test runs.
pub(crate) fn fake_board(directory: &Path, name: &str, fake: Fake) {
    let path = directory.join(format!("{name}.sock"));
    let listener = UnixListener::bind(&path).expect("a socket");
    fs::set_permissions(&path, Permissions::from_mode(0o600)).expect("ours");
    thread::spawn(move || {
        for stream in listener.incoming() {
            let stream = stream.expect("a connection");
            thread::spawn(move || answer(stream, fake));
        }
    });
}

fn answer(mut stream: UnixStream, fake: Fake) {
    let mut decoder = Decoder::default();
    let mut greeted = false;
    let mut bytes = [0; 256];
    loop {
        let got = stream.read(&mut bytes).unwrap_or(0);
        if got == 0 {
            return;
        }
        decoder.buffer().extend(&bytes[..got]);
        while let Some(request) = decoder.next_frame() {
            let version = match fake {
                Fake::Silent => continue,
                Fake::Greets(_) if greeted => continue,
                Fake::HangsUp | Fake::Noisy if greeted => return,
                Fake::Greets(version) => version,
                Fake::HangsUp | Fake::Noisy => PROTOCOL_VERSION,
            };
            if matches!(fake, Fake::Noisy) {
                let _ = stream.write_all(&[3, 1, 0, 0, 255, 254, 253, 0, 17]);
                let _ = stream.write_all(&[0]);
            }
            let _ = stream.write_all(&greeting(&request, version));
            greeted = true;
        }
    }
}

fn greeting(request: &[u8], protocol_version: u16) -> Vec<u8> {
    let (header, _) = VarHeader::take_from_slice(request).expect("a header");
    let identity = Identity {
        protocol_version,
        firmware_version: Text::try_from("9.9.9").expect("short"),
        build: Text::try_from("fake").expect("short"),
        board: Text::try_from("fake board").expect("short"),
        is_emulated: false,
        tick_hz: 10_000,
    };
    let key = VarKey::Key8(HelloEndpoint::RESP_KEY);
    let mut frame = VarHeader {
        key,
        seq_no: header.seq_no,
    }
    .write_to_vec();
    frame.extend(postcard::to_stdvec(&identity).expect("it serialises"));
    encode(&frame)
}
