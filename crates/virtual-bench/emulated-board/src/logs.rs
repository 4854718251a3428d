//! The firmware's log: defmt frames from semihosting, decoded with the table in the image.

use std::io::{self, Read};

use defmt_decoder::{DecodeError, Table};

/// The log messages that an image can send.
pub struct LogTable(Table);

/// Why a log cannot be decoded.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The image holds no table.
    #[error("this image holds no defmt table; was it built with this workspace?")]
    NoTable,
    /// The table is of another defmt version.
    #[error("the image's defmt table cannot be read: {0}")]
    Table(String),
}

impl LogTable {
    /// Reads the table from an ELF image.
    ///
    /// # Errors
    /// Where there is none, or of another version.
    pub fn from_elf(elf: &[u8]) -> Result<Self, LogError> {
        match Table::parse(elf) {
            Ok(Some(table)) => Ok(Self(table)),
            Ok(None) => Err(LogError::NoTable),
            Err(error) => Err(LogError::Table(error.to_string())),
        }
    }

    /// Decodes `frames` until they end, and gives each message, with time and level, to `line`.
    ///
    /// # Errors
    /// Where `frames` cannot be read.
    pub fn decode(&self, mut frames: impl Read, mut line: impl FnMut(String)) -> io::Result<()> {
        let mut decoder = self.0.new_stream_decoder();
        let mut buffer = [0; 1024];
        loop {
            let got = frames.read(&mut buffer)?;
            if got == 0 {
                return Ok(());
            }
            decoder.received(&buffer[..got]);
            loop {
                match decoder.decode() {
                    Ok(frame) => line(frame.display(false).to_string()),
                    Err(DecodeError::UnexpectedEof) => break,
                    Err(DecodeError::Malformed) => {
                        line("(a log frame was not understood)".to_owned());
                        break;
                    }
                }
            }
        }
    }
}
