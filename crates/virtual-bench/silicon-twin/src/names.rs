//! What ST calls the chip's peripherals, registers, interrupts and pins (`stm32-metapac`, made from ST's own data).

use stm32_metapac::metadata::ir::{Array, Block, BlockItemInner, IR};
use stm32_metapac::metadata::{METADATA, Peripheral};

/// `PERIPHERAL.REGISTER` of an address, or what is known of it.
pub(crate) fn register(address: u32) -> String {
    let here = METADATA
        .peripherals
        .iter()
        .filter(|peripheral| peripheral.address <= u64::from(address))
        .filter_map(|peripheral| Some((peripheral, name_in(peripheral, address)?)))
        .max_by_key(|(peripheral, _)| peripheral.address);
    match here {
        Some((peripheral, register)) => format!("{}.{register}", peripheral.name),
        None => format!("address {address:#010x}, where this chip has no register"),
    }
}

fn name_in(peripheral: &Peripheral, address: u32) -> Option<String> {
    let registers = peripheral.registers.as_ref()?;
    let offset = address - peripheral.address as u32;
    name_in_block(registers.ir, registers.block, offset & !3)
}

fn name_in_block(ir: &IR, block: &str, offset: u32) -> Option<String> {
    let block: &Block = ir
        .blocks
        .iter()
        .find(|candidate| same_name(candidate.name, block))?;
    let own = block.items.iter().find_map(|item| {
        let starts: Vec<u32> = match &item.array {
            None => vec![0],
            Some(Array::Regular(array)) => (0..array.len).map(|i| i * array.stride).collect(),
            Some(Array::Cursed(array)) => array.offsets.to_vec(),
        };
        starts.iter().enumerate().find_map(|(i, start)| {
            let inner = offset.checked_sub(item.byte_offset + start)?;
            let index = match item.array {
                None => String::new(),
                Some(_) => format!("[{i}]"),
            };
            match &item.inner {
                BlockItemInner::Register(_) => {
                    (inner < 4).then(|| format!("{}{index}", item.name.to_uppercase()))
                }
                BlockItemInner::Block(nested) => {
                    let name = name_in_block(ir, nested.block, inner)?;
                    Some(format!("{}{index}.{name}", item.name.to_uppercase()))
                }
            }
        })
    });
    own.or_else(|| name_in_block(ir, block.extends?, offset))
}

/// The data names a block `TIM_ADV` and `TimAdv`.
fn same_name(one: &str, other: &str) -> bool {
    let letters = |name: &str| name.replace('_', "").to_uppercase();
    letters(one) == letters(other)
}

/// The signal of `peripheral` that alternate function `af` puts on a pin.
pub(crate) fn alternate(peripheral: &str, pin: &str, af: u8) -> Option<&'static str> {
    pins(peripheral)
        .find(|(name, _, number)| *name == pin && *number == Some(af))
        .map(|(_, signal, _)| signal)
}

/// The pin of an analogue input.
pub(crate) fn analogue(peripheral: &str, input: u32) -> Option<&'static str> {
    let wanted = format!("IN{input}");
    pins(peripheral)
        .find(|(_, signal, number)| *signal == wanted && number.is_none())
        .map(|(pin, _, _)| pin)
}

fn pins(peripheral: &str) -> impl Iterator<Item = (&'static str, &'static str, Option<u8>)> {
    let found = METADATA
        .peripherals
        .iter()
        .find(|candidate| candidate.name == peripheral);
    let pins = found.map_or(&[][..], |peripheral| peripheral.pins);
    pins.iter().map(|pin| (pin.pin, pin.signal, pin.af))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::{address, interrupt};

    #[test]
    fn addresses_have_the_names_of_the_reference_manual() {
        for (address, name) in [
            (address::RCC + 0x08, "RCC.CFGR"),
            (address::TIM1 + 0x44, "TIM1.BDTR"),
            (address::ADC1 + 0x4c, "ADC1.JSQR"),
            (address::GPIO + 0x800 + 0x20, "GPIOC.AFR[0]"),
            (address::USB + 0x08, "USB.EPR[2]"),
        ] {
            assert_eq!(register(address), name);
        }
        assert!(register(0x4fff_0000).contains("no register"));
    }

    #[test]
    fn pins_have_the_functions_of_the_data_sheet() {
        assert_eq!(alternate("TIM1", "PC0", 2), Some("CH1"));
        assert_eq!(alternate("TIM1", "PC0", 1), None);
        assert_eq!(analogue("ADC1", 15), Some("PB0"));
        assert_eq!(analogue("ADC2", 11), Some("PC5"));
    }

    #[test]
    fn base_addresses_and_interrupts_are_those_of_st() {
        let base = |name: &str| {
            let found = METADATA
                .peripherals
                .iter()
                .find(|peripheral| peripheral.name == name);
            found.map(|peripheral| peripheral.address as u32)
        };
        for &(name, address) in address::ALL {
            assert_eq!(base(name), Some(address), "{name}");
        }
        for &(name, number) in interrupt::ALL {
            let found = METADATA
                .interrupts
                .iter()
                .find(|interrupt| interrupt.name == name);
            assert_eq!(
                found.map(|interrupt| interrupt.number),
                Some(number),
                "{name}"
            );
        }
    }
}
