//! A stand-in for a board that misbehaves on purpose.

use std::fs::{self, Permissions};
use std::io::{Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::thread;

use host_tool::board::framing::{Decoder, encode};
use mirror_protocol::{
    Health, HelloEndpoint, Identity, PROTOCOL_VERSION, Sentence, Status, StatusEndpoint, Telemetry,
    Text,
};
use postcard_rpc::Endpoint;
use postcard_rpc::header::{VarHeader, VarKey};
use serde::Serialize;

/// How a fake board answers the greeting, and everything after it.
#[derive(Clone, Copy)]
pub(crate) enum Fake {
    /// Greets with this protocol version, and is silent from then on.
    Greets(u16),
    /// Greets and tells how it is, then writes that it was asked for more into a file beside its socket, and is silent.
    Deaf,
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
            let asked = path.with_extension("asked");
            thread::spawn(move || answer(stream, fake, &asked));
        }
    });
}

fn answer(mut stream: UnixStream, fake: Fake, asked: &Path) {
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
                Fake::Deaf if greeted => {
                    if !is_for::<StatusEndpoint>(&request) {
                        let _ = fs::write(asked, "");
                    } else {
                        let _ =
                            stream.write_all(&answer_to::<StatusEndpoint>(&request, &Ok(status())));
                    }
                    continue;
                }
                Fake::Greets(_) if greeted => continue,
                Fake::HangsUp | Fake::Noisy if greeted => return,
                Fake::Greets(version) => version,
                Fake::Deaf | Fake::HangsUp | Fake::Noisy => PROTOCOL_VERSION,
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
    let identity = Identity {
        protocol_version,
        firmware_version: Text::try_from("9.9.9").expect("short"),
        build: Text::try_from("fake").expect("short"),
        board: Text::try_from("fake board").expect("short"),
        is_emulated: false,
        tick_hz: 10_000,
    };
    answer_to::<HelloEndpoint>(request, &identity)
}

fn status() -> Status {
    Status {
        telemetry: Telemetry::default(),
        health: Health::default(),
        max_position_um: 170.0,
        max_drive_v: 3.5,
        dropped_samples: 0,
        stops: 0,
        last_stop: Sentence::new(),
        option_bytes: None,
    }
}

fn header(request: &[u8]) -> VarHeader {
    VarHeader::take_from_slice(request).expect("a header").0
}

/// Keys travel shortened, as far as they still tell endpoints apart.
fn is_for<E: Endpoint>(request: &[u8]) -> bool {
    header(request).key == VarKey::Key8(E::REQ_KEY)
}

fn answer_to<E: Endpoint<Response: Serialize>>(request: &[u8], answer: &E::Response) -> Vec<u8> {
    let mut frame = VarHeader {
        key: VarKey::Key8(E::RESP_KEY),
        seq_no: header(request).seq_no,
    }
    .write_to_vec();
    frame.extend(postcard::to_stdvec(answer).expect("it serialises"));
    encode(&frame)
}
