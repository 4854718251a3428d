//! Which board an update is for. A bootloader erases whatever microcontroller it is in, so nothing is left to chance.

/// A microcontroller in its bootloader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InBootloader {
    /// Its serial number, which the ROM makes of the microcontroller's unique id.
    pub serial: Option<String>,
}

/// What an update begins with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// A board that runs its firmware, by its name: it is sent to its bootloader first.
    Running(String),
    /// One of those in their bootloader, by its place among them.
    InBootloader(usize),
}

/// Why there is no telling which one is meant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Undecided {
    /// Nothing is there.
    #[error("no board was found, neither with its firmware nor in its bootloader")]
    Nothing,
    /// The one that was named is not there.
    #[error("there is no board {name}; found: {found}")]
    NotThere {
        /// What was asked for.
        name: String,
        /// What is there.
        found: String,
    },
    /// More than one could be meant.
    #[error("more than one board could be meant: {found}")]
    Several {
        /// What is there.
        found: String,
    },
}

/// The board called `name`, which may be its serial number or that of its bootloader, or the only one there is.
///
/// # Errors
/// Where that is none, or more than one.
pub fn choose(
    name: Option<&str>,
    running: &[String],
    bootloaders: &[InBootloader],
) -> Result<Target, Undecided> {
    let found = || describe(running, bootloaders);
    let Some(name) = name else {
        return match (running, bootloaders) {
            ([], []) => Err(Undecided::Nothing),
            ([only], []) => Ok(Target::Running(only.clone())),
            ([], [_]) => Ok(Target::InBootloader(0)),
            _ => Err(Undecided::Several { found: found() }),
        };
    };
    if running.iter().any(|board| board == name) {
        return Ok(Target::Running(name.to_owned()));
    }
    place_of(name, bootloaders).ok_or_else(|| Undecided::NotThere {
        name: name.to_owned(),
        found: found(),
    })
}

/// The bootloader of the board `name` among these.
pub fn place_of(name: &str, bootloaders: &[InBootloader]) -> Option<Target> {
    let of_rom = serial_in_rom(name);
    let place = bootloaders.iter().position(|bootloader| {
        let serial = bootloader.serial.as_deref();
        serial == Some(name) || serial.is_some() && serial == of_rom.as_deref()
    });
    place.map(Target::InBootloader)
}

fn describe(running: &[String], bootloaders: &[InBootloader]) -> String {
    let bootloaders = bootloaders.iter().map(|bootloader| {
        let serial = bootloader
            .serial
            .as_deref()
            .unwrap_or("without a serial number");
        format!("{serial} (in its bootloader)")
    });
    let all: Vec<String> = running.iter().cloned().chain(bootloaders).collect();
    match all.is_empty() {
        true => "none".to_owned(),
        false => all.join(", "),
    }
}

/// The serial number that the bootloader in the ROM shows, of the unique id that is the board's: 24 hexadecimal digits, in the
/// order of memory. The sum of its first and third words, and the upper half of the second, as in ST's USB device examples
/// (`Get_SerialNum`).
pub fn serial_in_rom(unique_id: &str) -> Option<String> {
    let is_hex = unique_id.len() == 24 && unique_id.bytes().all(|digit| digit.is_ascii_hexdigit());
    let word = |place: usize| {
        let digits = unique_id.get(8 * place..8 * place + 8)?;
        Some(u32::from_str_radix(digits, 16).ok()?.swap_bytes())
    };
    if !is_hex {
        return None;
    }
    let sum = word(0)?.wrapping_add(word(2)?);
    Some(format!("{sum:08X}{:04X}", word(1)? >> 16))
}

/// Whether a bootloader's flash, in the words of its interface (UM0424, section 4.3.2), is that of the board: 512 KB from
/// 0x08000000 in pages of 2 KB, or of 4 KB in single-bank mode (RM0440, section 3.3.1).
pub fn has_flash_of_the_board(layout: &str) -> bool {
    let mut parts = layout.split('/').map(str::trim);
    let is_flash = parts
        .next()
        .is_some_and(|name| name.starts_with("@Internal Flash"));
    let is_at_start = parts.next() == Some("0x08000000");
    let pages_kb = |sectors: &str| -> Option<u32> {
        let mut all_kb = 0;
        for sector in sectors.split(',') {
            let (count, size) = sector.trim().split_once('*')?;
            let page_kb: u32 = size.trim().split_once('K')?.0.trim().parse().ok()?;
            if ![2, 4].contains(&page_kb) {
                return None;
            }
            all_kb += count.trim().parse::<u32>().ok()?.checked_mul(page_kb)?;
        }
        Some(all_kb)
    };
    is_flash && is_at_start && parts.next().and_then(pages_kb) == Some(512)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: &str = "1F0045000D50484142363520";

    fn in_rom(serial: &str) -> InBootloader {
        InBootloader {
            serial: Some(serial.to_owned()),
        }
    }

    #[test]
    fn the_rom_s_serial_number_comes_of_the_unique_id() {
        // Words 0x0045001f, 0x4148500d, 0x20353642, by hand.
        assert_eq!(serial_in_rom(ID).as_deref(), Some("207A36614148"));
        assert_eq!(serial_in_rom("emulated"), None);
        assert_eq!(serial_in_rom("1F0045000D5048414236352é"), None);
    }

    #[test]
    fn a_board_that_is_named_is_the_one_whatever_else_is_in_its_bootloader() {
        let boards = [ID.to_owned(), "other".to_owned()];
        let strangers = [in_rom("AAAABBBBCCCC")];
        let running = Ok(Target::Running(ID.to_owned()));
        assert_eq!(choose(Some(ID), &boards, &strangers), running);
        let both = [in_rom("AAAABBBBCCCC"), in_rom("207A36614148")];
        assert_eq!(choose(Some(ID), &[], &both), Ok(Target::InBootloader(1)));
        let by_rom = choose(Some("AAAABBBBCCCC"), &boards, &both);
        assert_eq!(by_rom, Ok(Target::InBootloader(0)));
        let not_there = choose(Some(ID), &[], &strangers).expect_err("another one");
        assert!(
            not_there
                .to_string()
                .contains("AAAABBBBCCCC (in its bootloader)")
        );
    }

    #[test]
    fn without_a_name_there_must_be_one_and_no_other() {
        let (one, none) = ([ID.to_owned()], []);
        let stranger = [in_rom("AAAABBBBCCCC")];
        assert_eq!(choose(None, &none, &[]), Err(Undecided::Nothing));
        assert_eq!(choose(None, &one, &[]), Ok(Target::Running(ID.to_owned())));
        assert_eq!(choose(None, &none, &stranger), Ok(Target::InBootloader(0)));
        let several = [
            choose(None, &one, &stranger),
            choose(None, &none, &[in_rom("A"), InBootloader { serial: None }]),
        ];
        for several in several {
            assert!(
                matches!(several, Err(Undecided::Several { .. })),
                "{several:?}"
            );
        }
    }

    #[test]
    fn another_chip_s_flash_is_not_the_board_s() {
        for layout in [
            "@Internal Flash   /0x08000000/256*02Kg",
            "@Internal Flash  /0x08000000/128*04Kg",
            "@Internal Flash  /0x08000000/128*2Kg,128*2Kg",
        ] {
            assert!(has_flash_of_the_board(layout), "{layout}");
        }
        for layout in [
            // An STM32F4, an STM32L4 of 1 MB, an STM32G4 of 128 KB, and what is none.
            "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg",
            "@Internal Flash   /0x08000000/512*02Kg",
            "@Internal Flash   /0x08000000/64*02Kg",
            "@Option Bytes  /0x1FFF7800/01*040 e",
            "@Internal Flash",
            "",
        ] {
            assert!(!has_flash_of_the_board(layout), "{layout}");
        }
    }
}
