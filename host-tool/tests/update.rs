//! Firmware images, and updates in front of a bootloader made for the test.

mod common;

use std::time::Duration;

use common::{host_tool, no_boards};
use host_tool::update::dfuse::{Bootloader, Gone, UpdateError, update};
use host_tool::update::image::{Image, ImageError};
use host_tool::update::package::{BOARD, Package};
use mirror_protocol::usb::PRODUCT;
use proptest::prelude::*;

const START: u32 = Image::START;
const FLASH_BYTES: usize = 512 * 1024;
const ERASED: u8 = 0xff;

/// A little ELF file: one segment at `address`.
fn elf(address: u32, content: &[u8]) -> Vec<u8> {
    const HEADERS: u32 = 52 + 32;
    let mut elf = b"\x7fELF\x01\x01\x01".to_vec();
    elf.resize(16, 0);
    let halves = |elf: &mut Vec<u8>, halves: &[u16]| {
        elf.extend(halves.iter().flat_map(|half| half.to_le_bytes()));
    };
    let words = |elf: &mut Vec<u8>, words: &[u32]| {
        elf.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    };
    let length = content.len() as u32;
    halves(&mut elf, &[2, 40]);
    words(&mut elf, &[1, address, 52, 0, 0]);
    halves(&mut elf, &[52, 32, 1, 40, 0, 0]);
    words(
        &mut elf,
        &[1, HEADERS, address, address, length, length, 5, 4],
    );
    elf.extend(content);
    elf
}

/// A program: vectors, the product's name, and something.
fn program(bytes: usize, fill: u8) -> Vec<u8> {
    let mut program = 0x2001_8000_u32.to_le_bytes().to_vec();
    program.extend((START + 0x101).to_le_bytes());
    program.resize(256, fill);
    program.extend(PRODUCT.as_bytes());
    program.resize(bytes.max(program.len()), fill);
    program
}

fn image(bytes: usize, fill: u8) -> Image {
    Image::from_elf(&elf(START, &program(bytes, fill))).expect("a good image")
}

/// The ROM's bootloader, with the flash behind it.
struct Rom {
    flash: Vec<u8>,
    page_bytes: usize,
    state: u8,
    address: u32,
    started: bool,
    busy: bool,
    /// Erasures and writes until the power goes.
    powered_for: Option<usize>,
    /// An address that keeps a bit stuck.
    worn: Option<u32>,
}

impl Rom {
    fn new(page_bytes: usize, old: &Image) -> Self {
        let mut flash = vec![ERASED; FLASH_BYTES];
        flash[..old.bytes().len()].copy_from_slice(old.bytes());
        flash[FLASH_BYTES - 32 * 1024..].fill(0xca);
        Self {
            flash,
            page_bytes,
            state: 2,
            address: 0,
            started: false,
            busy: false,
            powered_for: None,
            worn: None,
        }
    }

    /// Whether the power lasts for another operation.
    fn operate(&mut self) -> Result<(), Gone> {
        match &mut self.powered_for {
            Some(0) => return Err(Gone("no power".to_owned())),
            Some(left) => *left -= 1,
            None => {}
        }
        self.busy = true;
        self.state = 5;
        Ok(())
    }

    fn erase(&mut self, address: u32) -> Result<(), Gone> {
        self.operate()?;
        let page = (address - START) as usize / self.page_bytes * self.page_bytes;
        self.flash[page..page + self.page_bytes].fill(ERASED);
        Ok(())
    }

    fn program(&mut self, data: &[u8]) -> Result<(), Gone> {
        assert!(self.address.is_multiple_of(8) && data.len().is_multiple_of(8));
        let at = (self.address - START) as usize;
        let target = at..at + data.len();
        if self.flash[target.clone()]
            .iter()
            .any(|byte| *byte != ERASED)
        {
            self.state = 10;
            return Ok(());
        }
        if let Err(gone) = self.operate() {
            // Some words made it; a single one does or does not.
            let made = data.len() / 16 * 8;
            self.flash[at..at + made].copy_from_slice(&data[..made]);
            return Err(gone);
        }
        self.flash[target].copy_from_slice(data);
        if let Some(worn) = self
            .worn
            .take_if(|worn| (*worn - START) as usize / 8 == at / 8)
        {
            self.flash[(worn - START) as usize] ^= 1;
        }
        Ok(())
    }

    fn holds(&self, image: &Image) -> bool {
        self.flash[..image.bytes().len()] == *image.bytes()
    }
}

impl Bootloader for Rom {
    fn write(&mut self, request: u8, value: u16, data: &[u8]) -> Result<(), Gone> {
        match (request, value, data) {
            (6, 0, []) if self.state != 10 => self.state = 2,
            (4, 0, []) => self.state = 2,
            (1, 0, []) => self.started = true,
            (1, 0, [command, a, b, c, d]) => {
                let address = u32::from_le_bytes([*a, *b, *c, *d]);
                match command {
                    0x21 => {
                        self.address = address;
                        self.state = 5;
                    }
                    0x41 => self.erase(address)?,
                    other => panic!("command {other:#x}"),
                }
            }
            (1, 2, data) => self.program(data)?,
            other => panic!("{other:?}"),
        }
        Ok(())
    }

    fn read(&mut self, request: u8, value: u16, length: usize) -> Result<Vec<u8>, Gone> {
        if self.powered_for == Some(0) || self.started {
            return Err(Gone("it left".to_owned()));
        }
        match (request, value) {
            (3, 0) => {
                let state = if self.busy { 4 } else { self.state };
                self.busy = false;
                Ok(vec![u8::from(state == 10), 5, 0, 0, state, 0])
            }
            (2, 2) => {
                assert_eq!(self.state, 2, "uploads begin where it is idle");
                let at = (self.address - START) as usize;
                self.state = 9;
                Ok(self.flash[at..at + length].to_vec())
            }
            other => panic!("{other:?}"),
        }
    }

    fn pause(&mut self, time: Duration) {
        assert_eq!(time, Duration::from_millis(5));
    }
}

#[test]
fn an_image_is_written_read_back_and_started() {
    let (old, new) = (image(9000, 1), image(20_001, 2));
    for page_bytes in [2048, 4096] {
        let mut rom = Rom::new(page_bytes, &old);
        let mut reached = 0;
        update(&mut rom, &new, |written| reached = written).expect("it is written");
        assert!(rom.holds(&new) && rom.started);
        assert_eq!(reached, new.bytes().len());
        let calibrations = &rom.flash[FLASH_BYTES - 32 * 1024..];
        assert!(calibrations.iter().all(|byte| *byte == 0xca));
    }
}

#[test]
fn a_bootloader_left_anywhere_takes_an_update() {
    let new = image(5000, 2);
    for state in [2, 5, 9, 10] {
        let mut rom = Rom::new(2048, &image(9000, 1));
        rom.state = state;
        update(&mut rom, &new, |_| {}).expect("it is written");
        assert!(rom.holds(&new) && rom.started);
    }
}

/// Between an operation and the next one; and within a write, of which some words are made.
#[test]
fn after_a_power_cut_the_old_program_starts_or_none_or_the_new_one() {
    let (old, new) = (image(30_000, 1), image(25_000, 2));
    let mut outcomes = [0; 3];
    for operations in 0.. {
        let mut rom = Rom::new(2048, &old);
        rom.powered_for = Some(operations);
        let result = update(&mut rom, &new, |_| {});
        let has_entry = rom.flash[..8] != [ERASED; 8];
        let outcome = match (rom.holds(&old), has_entry) {
            (true, _) => 0,
            (_, false) => 1,
            (_, true) if rom.holds(&new) => 2,
            _ => panic!("a broken program would start after {operations} operations"),
        };
        outcomes[outcome] += 1;
        if result.is_ok() {
            break;
        }
        rom.powered_for = None;
        rom.state = 2;
        update(&mut rom, &new, |_| {}).expect("it takes another update");
        assert!(rom.holds(&new) && rom.started);
    }
    // 13 pages and 13 blocks before the entry.
    assert_eq!(outcomes, [1, 26, 2]);
}

#[test]
fn what_reads_back_wrong_is_not_started() {
    let new = image(25_000, 2);
    let mut rom = Rom::new(2048, &image(9000, 1));
    let worn = START + 8 + 3 * 2048;
    rom.worn = Some(worn);
    let result = update(&mut rom, &new, |_| {});
    assert_eq!(result, Err(UpdateError::Verify { address: worn }));
    assert!(!rom.started);
    assert_eq!(rom.flash[..8], [ERASED; 8]);
}

#[test]
fn files_that_are_no_firmware_for_this_board_are_refused() {
    let refused = |elf: &[u8]| Image::from_elf(elf).expect_err("no firmware");
    assert_eq!(refused(b"hello"), ImageError::NotElf);
    assert_eq!(
        refused(&elf(0, &program(300, 0))),
        ImageError::Address { address: 0 }
    );
    let calibrations = START + (512 - 32) * 1024 - 8;
    assert_eq!(
        refused(&elf(calibrations, &program(300, 0))),
        ImageError::Address {
            address: calibrations
        }
    );
    assert_eq!(
        refused(&elf(START + 0x1000, &program(300, 0))),
        ImageError::Start
    );
    let mut other = elf(START, &program(300, 0));
    other[18] = 62;
    assert_eq!(refused(&other), ImageError::Processor);
    let mut broken = program(300, 0);
    broken[4] = 0;
    assert!(matches!(
        refused(&elf(START, &broken)),
        ImageError::Vectors { .. }
    ));
    let mut stranger = program(300, 0);
    stranger[260] ^= 1;
    assert_eq!(refused(&elf(START, &stranger)), ImageError::Stranger);
}

proptest! {
    #[test]
    fn no_file_makes_the_reader_panic(
        at in 0_usize..500,
        bytes in proptest::collection::vec(any::<u8>(), 0..40),
        length in 0_usize..600,
    ) {
        let mut file = elf(START, &program(500, 3));
        let end = file.len().min(at + bytes.len());
        file[at..end].copy_from_slice(&bytes[..end - at]);
        file.truncate(length);
        // Whether it is read does not matter here.
        let _ = Image::from_elf(&file);
    }
}

#[test]
fn the_command_checks_the_file_before_it_looks_for_a_board() {
    let directory = no_boards();
    let file = directory.path().join("other.update");
    let package = |board: &str| Package {
        board: board.to_owned(),
        version: "0.1.0".to_owned(),
        build: "0123abc".to_owned(),
        image: image(300, 0),
    };
    std::fs::write(&file, package("another").to_bytes()).expect("a file");
    let said = host_tool(directory.path(), &["update", &file.to_string_lossy()]);
    assert_eq!(said.code, 1);
    assert!(
        said.sentence().contains("it is for another board"),
        "{}",
        said.err
    );
    assert_eq!(said.out, "");
    std::fs::write(&file, elf(START, &program(300, 0))).expect("a file");
    let said = host_tool(directory.path(), &["update", &file.to_string_lossy()]);
    assert!(said.sentence().contains("stm32g474.update"), "{}", said.err);
    std::fs::write(&file, package(BOARD).to_bytes()).expect("a file");
    let said = host_tool(directory.path(), &["update", &file.to_string_lossy()]);
    assert!(
        said.sentence().contains("no board was found"),
        "{}",
        said.err
    );
}
