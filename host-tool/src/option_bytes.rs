//! What of a chip's option bytes is not as the board's design wants it (`docs/board.md`).

use mirror_protocol::OptionBytes;

/// The highest brown-out level: the chip is held in reset, and its outputs off, below some 2.8 V of its 3.3 V (STM32G474
/// data sheet, embedded reset and power control).
const BROWN_OUT_LEVEL: u8 = 4;
/// What the levels are, in the data sheet's typical volts of a falling supply.
const BROWN_OUT_V: [f64; 5] = [1.7, 2.0, 2.2, 2.5, 2.8];

/// One that is not as wanted.
pub(crate) struct OptionFlaw {
    /// What that means.
    pub(crate) what: String,
    /// What sets it right.
    pub(crate) remedy: String,
}

/// All that is not as wanted.
pub(crate) fn option_flaws(options: &OptionBytes) -> Vec<OptionFlaw> {
    let level = options.brown_out_level;
    let volts = BROWN_OUT_V.get(usize::from(level)).unwrap_or(&0.0);
    let flaws = [
        (level < BROWN_OUT_LEVEL).then(|| {
            let what = format!(
                "the chip runs on a supply down to {volts} V (BOR_LEV {level}), its outputs with it"
            );
            OptionFlaw::new(what, "BOR_LEV=4")
        }),
        (!options.boots_by_pin).then(|| {
            let what = "the jumper BOOT0 does nothing (nSWBOOT0 0): a board without a program cannot be updated";
            OptionFlaw::new(what.to_owned(), "nSWBOOT0=1")
        }),
        (!options.is_dual_bank).then(|| {
            let what = "the flash is one bank (DBANK 0): no calibration is kept";
            OptionFlaw::new(what.to_owned(), "DBANK=1")
        }),
    ];
    flaws.into_iter().flatten().collect()
}

impl OptionFlaw {
    fn new(what: String, setting: &str) -> Self {
        Self {
            what,
            remedy: format!(
                "set it with a debugger connected: `STM32_Programmer_CLI -c port=SWD -ob {setting}`"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the chips are delivered (RM0440, option bytes: 0xFFEFF8AA), but for the brown-out level.
    const DESIGNED: OptionBytes = OptionBytes {
        brown_out_level: 4,
        boots_by_pin: true,
        is_dual_bank: true,
    };

    #[test]
    fn a_board_as_designed_has_no_flaw_and_each_other_is_told_with_its_remedy() {
        assert!(option_flaws(&DESIGNED).is_empty());
        for (options, setting) in [
            (
                OptionBytes {
                    brown_out_level: 0,
                    ..DESIGNED
                },
                "BOR_LEV=4",
            ),
            (
                OptionBytes {
                    brown_out_level: 3,
                    ..DESIGNED
                },
                "BOR_LEV=4",
            ),
            (
                OptionBytes {
                    boots_by_pin: false,
                    ..DESIGNED
                },
                "nSWBOOT0=1",
            ),
            (
                OptionBytes {
                    is_dual_bank: false,
                    ..DESIGNED
                },
                "DBANK=1",
            ),
        ] {
            let flaws = option_flaws(&options);
            assert_eq!(flaws.len(), 1);
            assert!(
                flaws[0].remedy.ends_with(&format!("{setting}`")),
                "{}",
                flaws[0].remedy
            );
        }
    }
}
