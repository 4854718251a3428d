//! From the chip's functions to the board's parts, pin by pin.

use super::gpio::{Mode, Port};
use super::timer::{Output, Timer};
use crate::board::{COMPARATORS_PIN, Connection, DRIVE_PINS, Driven, LOAD_SWITCH_PIN, connection};
use crate::names;

/// What the pins of the drives and of the load switch do, and where the comparators' line leads.
#[derive(Clone, Debug)]
pub(crate) struct Pins {
    pub(crate) driven: Driven,
    /// Whether the comparators' line leads to TIM1's break input.
    pub(crate) breaks: bool,
    /// The alternate function that does so.
    break_function: Option<u8>,
    /// For each drive, the channel of TIM1 that each alternate function gives to its pin.
    channels: [[Option<usize>; 16]; 4],
    /// For each converter and input, the port and pin, and what is connected to it.
    inputs: [[Option<Input>; 19]; 2],
}

#[derive(Clone, Copy, Debug)]
struct Input {
    port: usize,
    pin: u32,
    name: &'static str,
    connection: Option<Connection>,
}

impl Default for Pins {
    fn default() -> Self {
        let channel = |pin: &str, af: u8| match names::alternate("TIM1", pin, af)? {
            "CH1" => Some(0),
            "CH2" => Some(1),
            "CH3" => Some(2),
            "CH4" => Some(3),
            _ => None,
        };
        let input = |adc, number| {
            let name = names::analogue(adc, number)?;
            let (port, pin) = place(name)?;
            Some(Input {
                port,
                pin,
                name,
                connection: connection(name),
            })
        };
        let inputs =
            ["ADC1", "ADC2"].map(|adc| std::array::from_fn(|number| input(adc, number as u32)));
        Self {
            driven: Driven {
                outputs: [Output::Floating; 4],
                is_load_switch_on: false,
            },
            breaks: false,
            break_function: (0..16).find(|af| {
                names::alternate("TIM1", COMPARATORS_PIN, *af).is_some_and(|name| name == "BKIN")
            }),
            channels: DRIVE_PINS.map(|pin| std::array::from_fn(|af| channel(pin, af as u8))),
            inputs,
        }
    }
}

/// Port and number of a pin: `PC5` is 2 and 5.
fn place(pin: &str) -> Option<(usize, u32)> {
    let port = pin.as_bytes().get(1)?.checked_sub(b'A')?;
    Some((port.into(), pin.get(2..)?.parse().ok()?))
}

impl Pins {
    /// What the registers make of the drives' pins.
    pub(crate) fn follow(&mut self, ports: &[Port], tim1: &Timer) {
        let outputs = self.driven.outputs.iter_mut();
        for ((output, pin), channels) in outputs.zip(DRIVE_PINS).zip(&self.channels) {
            let Some((port, number)) = place(pin) else {
                continue;
            };
            let port = &ports[port];
            let driven = match port.mode(number) {
                Mode::Output(level) => Output::Level(level),
                Mode::Alternate(af) => match channels[usize::from(af)] {
                    Some(channel) => tim1.output(channel),
                    None => Output::Floating,
                },
                Mode::Input | Mode::Analogue => Output::Floating,
            };
            // An open drain pulls low only, and so does the board.
            *output = match port.is_push_pull(number) {
                true => driven,
                false => Output::Floating,
            };
        }
        // An open drain does not pull it up, and the board pulls it down.
        self.driven.is_load_switch_on = place(LOAD_SWITCH_PIN).is_some_and(|(port, pin)| {
            ports[port].mode(pin) == Mode::Output(true) && ports[port].is_push_pull(pin)
        });
        self.breaks = place(COMPARATORS_PIN).is_some_and(|(port, pin)| {
            matches!(ports[port].mode(pin), Mode::Alternate(af) if Some(af) == self.break_function)
        });
    }

    /// What is connected to a converter's input.
    pub(crate) fn analogue(
        &self,
        ports: &[Port],
        adc: usize,
        input: u32,
    ) -> Result<Connection, String> {
        let name = adc + 1;
        let Some(found) = self.inputs[adc].get(input as usize).copied().flatten() else {
            return Err(format!(
                "ADC{name} converts its input {input}, which has no pin"
            ));
        };
        let Some(connection) = found.connection else {
            let pin = found.name;
            return Err(format!(
                "ADC{name} converts {pin}, to which this board connects nothing"
            ));
        };
        match ports[found.port].mode(found.pin) {
            Mode::Analogue => Ok(connection),
            _ => Err(format!(
                "ADC{name} converts {}, which is not in analogue mode (RM0440, section 9.3.12)",
                found.name
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_on_the_wrong_function_drives_nothing() {
        let mut ports: Vec<Port> = (0..7).map(Port::new).collect();
        let mut tim1 = Timer::tim1();
        // OSSI: held at their idle level.
        tim1.write(0x44, 1 << 10, 0).expect("BDTR");
        let mut pins = Pins::default();
        for (af, output) in [(2, Output::Level(false)), (1, Output::Floating)] {
            ports[2].write(0x20, af).expect("AFRL");
            ports[2].write(0x00, 0xffff_fffe).expect("MODER");
            pins.follow(&ports, &tim1);
            assert_eq!(pins.driven.outputs[0], output, "alternate function {af}");
        }
    }

    #[test]
    fn load_switch_and_comparators_are_where_the_board_has_them() {
        let mut ports: Vec<Port> = (0..7).map(Port::new).collect();
        let tim1 = Timer::tim1();
        let mut pins = Pins::default();
        pins.follow(&ports, &tim1);
        assert!(
            !pins.driven.is_load_switch_on && !pins.breaks,
            "after a reset"
        );
        // PC12 an output that is high, PB12 on alternate function 6.
        ports[2].write(0x18, 1 << 12).expect("BSRR");
        ports[2].write(0x00, 0xfdff_ffff).expect("MODER");
        ports[1].write(0x24, 6 << 16).expect("AFRH");
        ports[1].write(0x00, 0xfeff_ffff).expect("MODER");
        pins.follow(&ports, &tim1);
        assert!(pins.driven.is_load_switch_on && pins.breaks);
        ports[2].write(0x04, 1 << 12).expect("OTYPER");
        ports[1].write(0x24, 5 << 16).expect("AFRH");
        pins.follow(&ports, &tim1);
        assert!(!pins.driven.is_load_switch_on && !pins.breaks);
    }

    #[test]
    fn inputs_lead_to_the_boards_parts() {
        let mut ports: Vec<Port> = (0..7).map(Port::new).collect();
        let pins = Pins::default();
        assert_eq!(pins.analogue(&ports, 0, 15), Ok(Connection::Sense(2)));
        assert_eq!(pins.analogue(&ports, 1, 11), Ok(Connection::Supply));
        assert!(
            pins.analogue(&ports, 0, 16).is_err(),
            "the chip's own temperature"
        );
        ports[1].write(0x00, 0xffff_fffc).expect("MODER");
        let error = pins.analogue(&ports, 0, 15).expect_err("an input");
        assert!(error.contains("PB0"), "{error}");
    }
}
