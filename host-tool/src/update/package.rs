//! Firmware as it is given to people: an image with what it is for, what it is, and a digest over all of it.
//!
//! Lines of text and an empty one, then the bytes for the flash. `cargo xtask build stm32g474` writes it.

use std::fmt::Write;

use sha2::{Digest, Sha256};

use super::image::{Image, ImageError};

/// The first line: what this is, and the version of this format.
const MAGIC: &str = "mirror-firmware";
const FORMAT: u32 = 1;

/// What the board that takes updates says that it is (`src/board/stm32g474`).
pub const BOARD: &str = "STM32G474RE driver board";

/// An image, and what it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Package {
    /// The board that it is for, as the board itself says it.
    pub board: String,
    /// The firmware's version.
    pub version: String,
    /// The commit that it was built from.
    pub build: String,
    /// What is written to the flash.
    pub image: Image,
}

/// Why a file is no firmware that can be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PackageError {
    /// A file of another kind.
    #[error(
        "it is no firmware for updates, which `cargo xtask build stm32g474` writes as `stm32g474.update`"
    )]
    Stranger,
    /// A format of later days.
    #[error(
        "it has format {format}, and this tool knows format {FORMAT}: use the tool that came with it"
    )]
    Format {
        /// Its format.
        format: String,
    },
    /// Something in it is not as it was written.
    #[error("it is damaged: its digest is not that of its content; copy or build it again")]
    Damaged,
    /// For another board.
    #[error("it is for another board: {board}")]
    Board {
        /// Which.
        board: String,
    },
    /// What it says of its version.
    #[error(
        "it says that it is version `{version}`, which is none: three numbers with points between them, such as 0.1.0; build it again"
    )]
    Version {
        /// What it says.
        version: String,
    },
    /// The image itself.
    #[error(transparent)]
    Image(#[from] ImageError),
}

impl Package {
    /// As the bytes of a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let head = self.head();
        let mut file = head.clone().into_bytes();
        let digest = digest(head.as_bytes(), self.image.bytes());
        file.extend(format!("sha256 = {digest}\n\n").bytes());
        file.extend(self.image.bytes());
        file
    }

    /// From the bytes of a file, every one of which is checked.
    ///
    /// # Errors
    /// Says why they are no firmware for the driver board.
    pub fn from_bytes(file: &[u8]) -> Result<Self, PackageError> {
        let first = file.split(|byte| *byte == b'\n').next().unwrap_or_default();
        let first = std::str::from_utf8(first).map_err(|_| PackageError::Stranger)?;
        let format = first
            .strip_prefix(MAGIC)
            .and_then(|rest| rest.strip_prefix(' '));
        let format = format.ok_or(PackageError::Stranger)?;
        if format != FORMAT.to_string() {
            return Err(PackageError::Format {
                format: format.chars().take(20).collect(),
            });
        }
        let (head, bytes) = split(file).ok_or(PackageError::Damaged)?;
        let (said, told) = head.rsplit_once("sha256 = ").ok_or(PackageError::Damaged)?;
        if told != digest(said.as_bytes(), bytes) {
            return Err(PackageError::Damaged);
        }
        let value = |key: &str| {
            let mut lines = said.lines().filter_map(|line| line.split_once(" = "));
            let (_, value) = lines.find(|(name, _)| *name == key)?;
            Some(value.to_owned())
        };
        if value("bytes") != Some(bytes.len().to_string()) {
            return Err(PackageError::Damaged);
        }
        let package = Self {
            board: value("board").ok_or(PackageError::Damaged)?,
            version: value("version").ok_or(PackageError::Damaged)?,
            build: value("build").ok_or(PackageError::Damaged)?,
            image: Image::from_bytes(bytes.to_vec())?,
        };
        if package.board != BOARD {
            return Err(PackageError::Board {
                board: package.board,
            });
        }
        match numbers(&package.version) {
            Some(_) => Ok(package),
            None => Err(PackageError::Version {
                version: package.version,
            }),
        }
    }

    fn head(&self) -> String {
        let mut head = format!("{MAGIC} {FORMAT}\n");
        for (key, value) in [
            ("board", &self.board),
            ("version", &self.version),
            ("build", &self.build),
            ("bytes", &self.image.bytes().len().to_string()),
        ] {
            // A line ends where it ends.
            let value: String = value
                .chars()
                .filter(|character| !character.is_control())
                .collect();
            let _ = writeln!(head, "{key} = {value}");
        }
        head
    }
}

/// The numbers of a version, whatever follows the last of them after a `-` or `+`; `None` where it is no version.
pub(crate) fn numbers(version: &str) -> Option<[u32; 3]> {
    let end = version.find(['-', '+']).unwrap_or(version.len());
    let numbers = version[..end].split('.').map(|number| number.parse().ok());
    let numbers: Vec<u32> = numbers.collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// The lines up to the empty one, and what follows it.
fn split(file: &[u8]) -> Option<(&str, &[u8])> {
    let end = file.windows(2).position(|pair| pair == b"\n\n")?;
    let head = std::str::from_utf8(&file[..end]).ok()?;
    Some((head, &file[end + 2..]))
}

fn digest(head: &[u8], bytes: &[u8]) -> String {
    let digest = Sha256::new()
        .chain_update(head)
        .chain_update(bytes)
        .finalize();
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_protocol::usb::PRODUCT;
    use proptest::prelude::*;

    fn package() -> Package {
        let mut bytes = 0x2001_8000_u32.to_le_bytes().to_vec();
        bytes.extend((Image::START + 0x101).to_le_bytes());
        bytes.resize(256, 7);
        bytes.extend(PRODUCT.as_bytes());
        Package {
            board: BOARD.to_owned(),
            version: "0.1.0".to_owned(),
            build: "0123abc".to_owned(),
            image: Image::from_bytes(bytes).expect("a good image"),
        }
    }

    #[test]
    fn a_file_comes_back_as_it_was() {
        assert_eq!(Package::from_bytes(&package().to_bytes()), Ok(package()));
    }

    #[test]
    fn a_bit_that_falls_over_anywhere_is_noticed() {
        let file = package().to_bytes();
        for bit in 0..8 * file.len() {
            let mut flipped = file.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(Package::from_bytes(&flipped).is_err(), "bit {bit}");
        }
        for length in 0..file.len() {
            assert!(
                Package::from_bytes(&file[..length]).is_err(),
                "{length} bytes"
            );
        }
    }

    #[test]
    fn other_formats_boards_and_kinds_are_told() {
        let file = package().to_bytes();
        let later = [b"mirror-firmware 2\n".as_slice(), &file[18..]].concat();
        let format = "2".to_owned();
        assert_eq!(
            Package::from_bytes(&later),
            Err(PackageError::Format { format })
        );
        assert_eq!(
            Package::from_bytes(b"\x7fELF\x01"),
            Err(PackageError::Stranger)
        );
        for version in ["not a version", "1.2", "99999999999.0.0", ""] {
            let version = version.to_owned();
            let forged = Package {
                version: version.clone(),
                ..package()
            };
            let refused = Package::from_bytes(&forged.to_bytes());
            assert_eq!(refused, Err(PackageError::Version { version }));
        }
        let board = "another".to_owned();
        let other = Package {
            board: board.clone(),
            ..package()
        };
        let refused = Package::from_bytes(&other.to_bytes());
        assert_eq!(refused, Err(PackageError::Board { board }));
    }

    proptest! {
        #[test]
        fn no_file_makes_the_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = Package::from_bytes(&bytes);
            let _ = Package::from_bytes(&[b"mirror-firmware 1\n".as_slice(), &bytes].concat());
        }
    }
}
