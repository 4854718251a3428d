//! The socket that host tools use, of a board that runs in this process: frames in COBS, ended by zeros.

use std::fs::{self, Permissions};
use std::io::{self, Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

use crate::pace::Traffic;

/// Longest frame that is waited for; longer ones are noise.
const MAX_BYTES: usize = 4096;

/// The socket, with the tool that is connected.
#[derive(Debug)]
pub struct ToolLink {
    listener: UnixListener,
    tool: Option<UnixStream>,
    arrived: Vec<u8>,
    to_send: Vec<u8>,
    traffic: Traffic,
}

impl ToolLink {
    /// Listens at `path`, for the user alone.
    ///
    /// # Errors
    /// Where the system does not let it.
    pub fn listen(path: &Path) -> io::Result<Self> {
        let listener = UnixListener::bind(path)?;
        fs::set_permissions(path, Permissions::from_mode(0o600))?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            listener,
            tool: None,
            arrived: Vec::new(),
            to_send: Vec::new(),
            traffic: Traffic::default(),
        })
    }

    /// When something goes through it.
    pub fn traffic(&self) -> Traffic {
        self.traffic.clone()
    }

    /// Whether a tool is connected. One at a time: others wait until it has gone.
    pub fn has_tool(&mut self) -> bool {
        if self.tool.is_none()
            && let Ok((tool, _)) = self.listener.accept()
            && tool.set_nonblocking(true).is_ok()
        {
            self.tool = Some(tool);
            self.arrived.clear();
            self.to_send.clear();
        }
        self.tool.is_some()
    }

    /// Whether one was connected at the last look.
    pub fn is_connected(&self) -> bool {
        self.tool.is_some()
    }

    /// The device has gone, and the tool's connection with it.
    pub fn hang_up(&mut self) {
        self.tool = None;
    }

    /// Whether there is room for another frame to the tool.
    pub fn has_room(&self) -> bool {
        self.to_send.len() < MAX_BYTES
    }

    /// Puts a frame on its way.
    pub fn send(&mut self, frame: &[u8]) {
        self.to_send.extend(cobs::encode_vec(frame));
        self.to_send.push(0);
    }

    /// Sends what can be sent, and takes the frames that have arrived.
    pub fn exchange(&mut self) -> Vec<Vec<u8>> {
        let is_there = self.write().and_then(|()| self.read());
        if is_there.is_err() {
            self.tool = None;
        }
        let mut frames = Vec::new();
        while let Some(end) = self.arrived.iter().position(|byte| *byte == 0) {
            let rest = self.arrived.split_off(end + 1);
            let encoded = std::mem::replace(&mut self.arrived, rest);
            // What does not decode was disturbed, and is passed over.
            frames.extend(
                cobs::decode_vec(&encoded[..end])
                    .ok()
                    .filter(|frame| !frame.is_empty()),
            );
        }
        if self.arrived.len() > MAX_BYTES {
            self.arrived.clear();
        }
        frames
    }

    fn write(&mut self) -> io::Result<()> {
        let Some(tool) = &mut self.tool else {
            return Ok(());
        };
        while !self.to_send.is_empty() {
            match tool.write(&self.to_send) {
                Ok(sent) => {
                    self.traffic.passes();
                    self.to_send.drain(..sent);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Fails where the tool has gone.
    fn read(&mut self) -> io::Result<()> {
        let Some(tool) = &mut self.tool else {
            return Ok(());
        };
        let mut bytes = [0; 1024];
        loop {
            match tool.read(&mut bytes) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(got) => {
                    self.traffic.passes();
                    self.arrived.extend(&bytes[..got]);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(error),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_go_both_ways_and_a_tool_that_leaves_makes_room() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        let mut link = ToolLink::listen(&path).expect("a socket");
        assert!(!link.has_tool());
        let mut tool = UnixStream::connect(&path).expect("it listens");
        assert!(link.has_tool());
        tool.write_all(b"\x00\x03\x11\x22\x01\x00").expect("room");
        assert_eq!(link.exchange(), [[0x11, 0x22, 0x00]]);
        link.send(&[0, 1]);
        assert!(link.exchange().is_empty());
        let mut bytes = [0; 4];
        tool.read_exact(&mut bytes).expect("a frame");
        assert_eq!(bytes, [1, 2, 1, 0]);
        drop(tool);
        link.exchange();
        assert!(!link.has_tool());
    }
}
