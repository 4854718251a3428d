//! From the chip's functions to the board's parts, pin by pin.

use super::gpio::{Mode, Port};
use super::timer::{Output, Timer};
use crate::board::{Connection, DRIVE_PINS, connection};
use crate::names;

/// What the pins of the four drives do.
#[derive(Clone, Debug)]
pub(crate) struct Pins {
    pub(crate) outputs: [Output; 4],
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
            outputs: [Output::Floating; 4],
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
        for ((output, pin), channels) in self.outputs.iter_mut().zip(DRIVE_PINS).zip(&self.channels)
        {
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
            assert_eq!(pins.outputs[0], output, "alternate function {af}");
        }
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
