//! The program: its bytes in flash, and the names of its functions.

use std::env;
use std::path::{Path, PathBuf};

use object::elf::{EF_ARM_ABI_FLOAT_HARD, EM_ARM, FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind};
use sha2::{Digest, Sha256};

use crate::chip::memory::{FLASH, FLASH_BYTES};

/// What is written into a board.
#[derive(Clone, Debug)]
pub struct Image {
    /// Addresses and bytes.
    pub segments: Vec<(u32, Vec<u8>)>,
    functions: Vec<Symbol>,
    objects: Vec<Symbol>,
}

/// A function or a variable.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Symbol {
    address: u32,
    bytes: usize,
    name: String,
}

/// Why an image cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// It is no ELF file, or a damaged one.
    #[error("this is no image that can be read: {0}; `cargo xtask build stm32g474` makes one")]
    NoElf(String),
    /// It is for something else.
    #[error("this image is not for a Cortex-M4 with floating-point unit: {0}")]
    OtherProcessor(String),
    /// It lies where this chip has no flash.
    #[error(
        "this image is for another chip: it has {bytes} bytes at {address:#010x}, and this chip's flash is at \
         0x08000000 to 0x08080000"
    )]
    OutsideFlash {
        /// Where.
        address: u32,
        /// How much.
        bytes: usize,
    },
    /// Nobody could tell where it fails.
    #[error("this image has no symbols, so no place in it could be named; was it stripped?")]
    NoSymbols,
}

/// Where the image is that `cargo xtask flash` writes into a driver board; for tests, which `MIRROR_IMAGE` gives another one.
pub fn flashed_image() -> PathBuf {
    if let Some(image) = env::var_os("MIRROR_IMAGE") {
        return image.into();
    }
    let target = env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let target =
        target.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../target"));
    target.join("thumbv7em-none-eabihf/firmware/stm32g474")
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// Where it is not for this chip, or has no symbols.
    pub fn from_elf(elf: &[u8]) -> Result<Self, ImageError> {
        let unreadable = |error: object::Error| ImageError::NoElf(error.to_string());
        let header = FileHeader32::<Endianness>::parse(elf).map_err(unreadable)?;
        let endian = header.endian().map_err(unreadable)?;
        if header.e_machine(endian) != EM_ARM {
            let machine = format!("ELF machine {}", header.e_machine(endian));
            return Err(ImageError::OtherProcessor(machine));
        }
        if header.e_flags(endian) & EF_ARM_ABI_FLOAT_HARD == 0 {
            let what = "it passes floating-point numbers in core registers".to_owned();
            return Err(ImageError::OtherProcessor(what));
        }
        let mut segments = Vec::new();
        for segment in header.program_headers(endian, elf).map_err(unreadable)? {
            let bytes = segment
                .data(endian, elf)
                .map_err(|()| ImageError::NoElf("it is cut off".to_owned()))?;
            let address = segment.p_paddr(endian);
            if segment.p_type(endian) != PT_LOAD || bytes.is_empty() {
                continue;
            }
            if !is_in_flash(address, bytes.len()) {
                let bytes = bytes.len();
                return Err(ImageError::OutsideFlash { address, bytes });
            }
            segments.push((address, bytes.to_vec()));
        }
        let file = object::File::parse(elf).map_err(unreadable)?;
        let functions = symbols(&file, SymbolKind::Text);
        if functions.is_empty() {
            return Err(ImageError::NoSymbols);
        }
        Ok(Self {
            segments,
            functions,
            objects: symbols(&file, SymbolKind::Data),
        })
    }

    /// SHA-256 of what is written into the flash, with its addresses.
    pub fn hash(&self) -> String {
        let mut hash = Sha256::new();
        for (address, bytes) in &self.segments {
            hash.update(address.to_le_bytes());
            hash.update(bytes);
        }
        hash.finalize()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }

    /// The address of a variable.
    pub fn object(&self, name: &str) -> Option<u32> {
        address_of(&self.objects, name)
    }

    /// The address of a function.
    pub fn function_at(&self, name: &str) -> Option<u32> {
        address_of(&self.functions, name)
    }

    /// All functions: where they are in the flash, their bytes, their names.
    pub fn functions(&self) -> impl Iterator<Item = (usize, usize, &str)> {
        self.functions.iter().filter_map(|function| {
            let offset = function.address.checked_sub(FLASH)?;
            Some((offset as usize, function.bytes, &*function.name))
        })
    }

    /// The function that an address lies in.
    pub fn function(&self, address: u32) -> &str {
        let after = self
            .functions
            .partition_point(|function| function.address <= address);
        match after.checked_sub(1) {
            Some(index) if is_in_flash(address, 0) => &self.functions[index].name,
            _ => "no function",
        }
    }
}

/// Programs for tests.
#[cfg(test)]
impl Image {
    /// These half-words behind two vectors, as one function of the name `program`.
    pub(crate) fn of(code: &[u16]) -> Self {
        let entry = FLASH + 8;
        let vectors = [crate::chip::memory::SRAM + 0x1000, entry | 1];
        let mut bytes: Vec<u8> = vectors.into_iter().flat_map(u32::to_le_bytes).collect();
        bytes.extend(code.iter().flat_map(|half| half.to_le_bytes()));
        let program = Symbol {
            address: entry,
            bytes: 2 * code.len(),
            name: "program".to_owned(),
        };
        Self {
            segments: vec![(FLASH, bytes)],
            functions: vec![program],
            objects: Vec::new(),
        }
    }
}

fn is_in_flash(address: u32, bytes: usize) -> bool {
    address
        .checked_sub(FLASH)
        .is_some_and(|offset| offset as usize + bytes <= FLASH_BYTES)
}

fn address_of(symbols: &[Symbol], name: &str) -> Option<u32> {
    let found = symbols.iter().find(|symbol| symbol.name == name);
    found.map(|symbol| symbol.address)
}

/// All functions, or all variables, by address.
fn symbols(file: &object::File<'_>, kind: SymbolKind) -> Vec<Symbol> {
    let is_code = kind == SymbolKind::Text;
    let mut symbols: Vec<_> = file
        .symbols()
        .filter(|symbol| symbol.kind() == kind && symbol.size() > 0)
        .filter_map(|symbol| {
            let name = rustc_demangle::demangle(symbol.name().ok()?);
            Some(Symbol {
                address: symbol.address() as u32 & !u32::from(is_code),
                bytes: symbol.size() as usize,
                name: format!("{name:#}"),
            })
        })
        .collect();
    symbols.sort();
    symbols
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ELF file for a Cortex-M4F with one segment of 16 bytes at `address`, and no symbols.
    fn elf(address: u32) -> Vec<u8> {
        const HEAD: u32 = 52;
        const PROGRAM: u32 = 32;
        let mut elf = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
        elf.extend([2, 0, 40, 0, 1, 0, 0, 0]);
        for word in [address, HEAD, 0, 0x0500_0400] {
            elf.extend(word.to_le_bytes());
        }
        for half in [HEAD, PROGRAM, 1, 40, 0, 0] {
            elf.extend((half as u16).to_le_bytes());
        }
        for word in [1, HEAD + PROGRAM, address, address, 16, 16, 5, 4] {
            elf.extend(word.to_le_bytes());
        }
        elf.extend([0; 16]);
        elf
    }

    /// The sentence by which an image is refused.
    #[track_caller]
    fn refusal(elf: &[u8]) -> String {
        Image::from_elf(elf).expect_err("a refusal").to_string()
    }

    #[test]
    fn what_is_no_image_for_this_chip_is_refused_in_a_sentence() {
        let makes = "`cargo xtask build stm32g474` makes one";
        assert!(refusal(b"hello").ends_with(makes));
        assert!(refusal(&elf(FLASH)[..90]).ends_with(makes), "cut off");
        let mut other = elf(FLASH);
        other[18] = 62;
        let said = refusal(&other);
        assert!(
            said.contains("not for a Cortex-M4") && said.contains("machine 62"),
            "{said}"
        );
        let mut soft = elf(FLASH);
        soft[37] = 0;
        assert!(refusal(&soft).contains("core registers"));
        // The start of SRAM, and the last bytes of the flash but eight.
        for address in [0x2000_0000, FLASH + FLASH_BYTES as u32 - 8] {
            let said = refusal(&elf(address));
            assert!(said.contains("for another chip"), "{said}");
            assert!(said.contains(&format!("{address:#010x}")), "{said}");
        }
        assert!(refusal(&elf(FLASH)).contains("was it stripped?"));
    }
}
