//! A tool that serves a board, and a client with a plain socket.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::Child;
use std::time::Duration;

use hil::Bench;
use serde_json::Value;
use virtual_mirror::MirrorConfig;

/// What has not come by then does not come: as for a board, thirty times what anything here waits for.
pub(super) const PATIENCE: Duration = Duration::from_secs(90);

/// A bench with a tool that serves its board.
pub(super) struct Serving {
    pub(super) bench: Bench,
    pub(super) tool: Child,
    pub(super) address: SocketAddr,
}

impl Serving {
    pub(super) fn start() -> Self {
        Self::of(Bench::emulated(MirrorConfig::bench()))
    }

    pub(super) fn of(bench: Bench) -> Self {
        let mut tool = bench.start_tool(&["serve", "--listen", "127.0.0.1:0", "--json"]);
        let mut line = String::new();
        let out = tool.stdout.take().expect("it is piped");
        BufReader::new(out).read_line(&mut line).expect("text");
        let said: Value = serde_json::from_str(&line).expect("JSON");
        let address = said["listening"].as_str().expect("an address");
        Self {
            bench,
            tool,
            address: address.parse().expect("an address"),
        }
    }

    pub(super) fn client(&self) -> Client {
        let stream = TcpStream::connect(self.address).expect("it listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("possible");
        Client(BufReader::new(stream))
    }

    /// A client that drives the mirror.
    pub(super) fn driver(&self) -> Client {
        // What was observed of earlier drives is forgotten.
        self.bench.controls().inject(None);
        let mut client = self.client();
        client.say("SOUR:VOLT 2V");
        client.is_content();
        self.bench.wait_until_driven(1);
        client
    }

    /// Waits until the mirror is not driven any more.
    pub(super) fn wait_for_zero(&self) {
        let is_zero = |bench: &Bench| bench.controls().observed().came_to_zero;
        self.bench.wait("it is driven on", is_zero);
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.tool.kill();
        let _ = self.tool.wait();
    }
}

/// A client with a plain socket.
pub(super) struct Client(pub(super) BufReader<TcpStream>);

impl Client {
    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.0.get_mut().write_all(bytes).expect("it is connected");
    }

    pub(super) fn say(&mut self, line: &str) {
        self.send(format!("{line}\n").as_bytes());
    }

    pub(super) fn hear(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).expect("an answer");
        line.trim_end().to_owned()
    }

    pub(super) fn ask(&mut self, line: &str) -> String {
        self.say(line);
        self.hear()
    }

    pub(super) fn numbers(&mut self, line: &str) -> Vec<f64> {
        let answer = self.ask(line);
        let numbers = answer.split(',').map(|text| text.parse().ok());
        numbers
            .collect::<Option<_>>()
            .unwrap_or_else(|| panic!("{line}: {answer}"))
    }

    pub(super) fn number(&mut self, line: &str) -> f64 {
        self.numbers(line)[0]
    }

    /// The oldest error.
    pub(super) fn error(&mut self) -> String {
        self.ask("SYST:ERR?")
    }

    /// There is no error.
    pub(super) fn is_content(&mut self) {
        assert_eq!(self.error(), "0,\"No error\"");
    }

    /// A block of bytes.
    pub(super) fn block(&mut self, line: &str) -> Vec<u8> {
        self.say(line);
        let mut start = [0; 2];
        self.0.read_exact(&mut start).expect("a block");
        assert_eq!(start[0], b'#', "{line}: {}", self.hear());
        let mut length = vec![0; usize::from(start[1] - b'0')];
        self.0.read_exact(&mut length).expect("its length");
        let length = std::str::from_utf8(&length).expect("digits");
        let mut bytes = vec![0; length.parse().expect("a number")];
        self.0.read_exact(&mut bytes).expect("the bytes");
        assert_eq!(self.hear(), "", "the line ends with the block");
        bytes
    }
}
