//! The gains of the current sense, by what is read with a known resistor in the place of each actuator.

use control_core::CHANNELS;
use quantities::Resistance;

use crate::error::NoResistor;
use crate::report::decimal;

/// Voltages at which the gain is read, up to 6 mA in 499 ohm. The zero is known by then.
pub(super) const DRIVES_V: [f32; 3] = [1.0, 2.0, 3.0];
/// By so much of itself a resistor may seem to rise from the lowest drive to the highest. Of what it reads, the ripple leaves up to
/// 0.22 % at either (docs/board.md), half a code of the drive 0.05 % at 1 V, the converter's noise of 0.1 uA 0.01 % in 1 kohm, and a metal
/// film itself, 50 ppm/K and some 10 K, 0.05 %: twice their sum. A heater rises by a quarter: 3.4e-3/K and some 90 K.
const WARMS: f64 = 0.01;
/// A gain may be so far from 1: five times the 0.3 % for which shunt, amplifier and reference are good together (docs/board.md).
const TOLERANCE: f64 = 0.015;

/// What flows for each ampere that is read beyond the zero: `beyond_zero_a` at each of [`DRIVES_V`], as a board as designed reads it.
///
/// # Errors
/// Where an actuator has no resistor, or not this one, in its place.
pub(super) fn gains(
    beyond_zero_a: &[[f64; CHANNELS]; DRIVES_V.len()],
    resistor: Resistance,
) -> Result<[f32; CHANNELS], NoResistor> {
    let mut gains = [1.0; CHANNELS];
    for (i, gain) in gains.iter_mut().enumerate() {
        let read_a = beyond_zero_a.map(|read_a| read_a[i]);
        check_stays(i + 1, &read_a)?;
        *gain = self::gain(i + 1, &read_a, resistor)? as f32;
    }
    Ok(gains)
}

/// Whether what is on `actuator`, from 1, resists at all drives alike.
fn check_stays(actuator: usize, read_a: &[f64; DRIVES_V.len()]) -> Result<(), NoResistor> {
    let top = DRIVES_V.len() - 1;
    let [low_v, high_v] = [DRIVES_V[0], DRIVES_V[top]].map(decimal);
    let (low_ohm, high_ohm) = (low_v / read_a[0], high_v / read_a[top]);
    if high_ohm > (1.0 + WARMS) * low_ohm {
        return Err(NoResistor::Warms {
            actuator,
            low_ohm,
            low_v,
            high_ohm,
            high_v,
        });
    }
    Ok(())
}

/// The least squares of what flows from what `actuator`, from 1, reads.
fn gain(
    actuator: usize,
    read_a: &[f64; DRIVES_V.len()],
    resistor: Resistance,
) -> Result<f64, NoResistor> {
    let flows_a = DRIVES_V.map(|drive_v| decimal(drive_v) / resistor.ohm);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let gain = product(&flows_a, read_a) / product(read_a, read_a);
    if (gain - 1.0).abs() <= TOLERANCE {
        return Ok(gain);
    }
    let top = DRIVES_V.len() - 1;
    Err(NoResistor::Gain {
        actuator,
        resistor,
        drive_v: decimal(DRIVES_V[top]),
        read_a: read_a[top],
        flows_a: flows_a[top],
        beyond: TOLERANCE,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMED: Resistance = Resistance { ohm: 499.0 };

    /// What four channels read of resistances at each drive.
    fn read(ohm: [f64; DRIVES_V.len()]) -> [[f64; CHANNELS]; DRIVES_V.len()] {
        std::array::from_fn(|k| [decimal(DRIVES_V[k]) / ohm[k]; CHANNELS])
    }

    #[test]
    fn a_resistor_tells_the_gain() {
        let of_one = |ohm: f64| gains(&read([ohm; 3]), NAMED);
        let [gain, ..] = of_one(1.003 * NAMED.ohm).expect("within the tolerance");
        assert!((gain - 1.003).abs() < 1e-6, "{gain}");
        // The next ones in the row E96.
        for wrong_ohm in [487.0, 511.0, 1e9] {
            let refused = of_one(wrong_ohm).expect_err("another resistor");
            assert!(
                matches!(refused, NoResistor::Gain { actuator: 1, .. }),
                "{refused}"
            );
        }
    }

    #[test]
    fn what_warms_is_no_resistor_whatever_its_gain_would_be() {
        let stays = read([499.0, 500.0, 501.0]);
        assert!(gains(&stays, NAMED).is_ok());
        let mut warms = stays;
        for (read_a, heater_a) in warms.iter_mut().zip(read([360.0, 395.0, 450.0])) {
            read_a[2] = heater_a[2];
        }
        for ohm in [420.0, 450.0, 499.0] {
            // Others are refused for their gain before it.
            let only = warms.map(|read_a| [read_a[2]; CHANNELS]);
            let refused = gains(&only, Resistance { ohm }).expect_err("a heater");
            assert!(matches!(refused, NoResistor::Warms { .. }), "{refused}");
        }
        let refused = gains(&warms, NAMED).expect_err("a heater among resistors");
        assert!(
            matches!(refused, NoResistor::Warms { actuator: 3, .. }),
            "{refused}"
        );
    }

    #[test]
    fn a_channel_that_reads_nothing_has_no_resistor() {
        let open = [[0.0; CHANNELS]; DRIVES_V.len()];
        let refused = gains(&open, NAMED).expect_err("nothing flows");
        assert!(matches!(refused, NoResistor::Gain { .. }), "{refused}");
    }
}
