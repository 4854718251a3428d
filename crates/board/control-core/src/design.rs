//! The board's design parameters, all in one place: what `docs/board.md` explains and everything else derives from.
//!
//! They belong to the analogue design and not to the microcontroller, so both boards share them. The
//! emulated electronics (`crates/virtual-bench/emulated-board/src/electronics.rs`) keep numbers of their own on purpose:
//! a wrong one here must show there.

use core::ops::RangeInclusive;

use crate::units::{Ampere, Kelvin, Ohm, Second, Volt};

/// Clock of the PWM timer (Hz).
pub const PWM_CLOCK_HZ: u32 = 170_000_000;
/// Timer counts of one PWM period: 170 MHz / 4250 = 40 kHz.
pub const PWM_PERIOD_COUNTS: u16 = 4250;
/// PWM periods in one control tick: 10 kHz.
pub const PWM_PERIODS_PER_TICK: u16 = 4;
/// Length of a control tick.
pub const TICK: Second =
    Second(PWM_PERIOD_COUNTS as f32 * PWM_PERIODS_PER_TICK as f32 / PWM_CLOCK_HZ as f32);
/// Ticks from a reset to the first one, in which nothing is driven (`hil/tests/silicon.rs` measures it).
pub const UNDRIVEN_TICKS: u16 = 100;

/// Supply of the microcontroller, which is the PWM's amplitude and the converters' reference.
pub const LOGIC_SUPPLY: Volt = Volt(3.3);
/// An output at full duty: the filtered 3.3 V, amplified by 1.2879.
pub const DRIVE_FULL_SCALE: Volt = Volt(4.25);

/// Shunt in the return of each actuator.
pub const SHUNT: Ohm = Ohm(10.0);
/// Gain of the amplifier behind the shunt: the converter's range then ends at 12.4 mA, just above the 12.3 mA that can flow.
pub const SENSE_GAIN: f32 = 26.4;
/// The amplifier's output at no current: 3.3 V by a divider of 100 to 1. It keeps zero, less the
/// offsets of amplifier and converter and their noise, within the converter's range.
pub const SENSE_PEDESTAL: Volt = Volt(LOGIC_SUPPLY.0 / 101.0);
/// Offset of that amplifier at its input: a standard deviation of such parts.
pub const SENSE_OFFSET: Volt = Volt(40e-6);
/// What a board's current sense may be off by, before it is calibrated: half a millivolt at the shunt.
pub const SENSE_ZERO_TOLERANCE: Ampere = Ampere(500e-6 / SHUNT.0);
/// Tolerances of shunt, amplifier and reference together, 0.3 % (docs/board.md), with a wide margin: a choice.
pub const SENSE_GAIN_TOLERANCE: f32 = 0.05;
/// Codes of a converter: 12 bits, oversampled 16 times.
pub const ADC_CODES: f32 = 65536.0;
/// At this code and above the sense is saturated: it reads less than what flows. A 12-bit
/// converter's top is 4095, and 16 of them are 65520.
pub const ADC_SATURATED: u16 = 65_450;

/// Part of the output stages' supply that its converter sees.
pub const SUPPLY_DIVIDER: f32 = 0.5;
/// The output stages give 3.5 V and the 0.12 V of the shunt, and need half a volt more. A low-power USB port gives 4.40 V
/// (USB 2.0, section 7.2.2), of which cable and connectors take up to 0.13 V.
pub const LOWEST_SUPPLY_MV: u32 = 4_200;
/// Their amplifiers bear 5.5 V.
pub const HIGHEST_SUPPLY_MV: u32 = 5_500;

/// Part of the position sensor's voltage that its converter sees: 11 V are the whole range.
pub const SENSOR_DIVIDER: f32 = 0.3;
/// The sensor's voltage at position zero. It is no 0 V, which is what an input gives to which nothing is connected.
pub const SENSOR_ZERO: Volt = Volt(1.0);
/// Micrometres for each volt above that.
pub const SENSOR_UM_PER_VOLT: f32 = 20.0;
/// No sensor gives less than this, or more: one that is off, beyond its range, or not there.
pub const SENSOR_RANGE_V: RangeInclusive<f32> = 0.5..=10.5;

/// Corner of the output filter's two equal poles, behind the PWM (Hz).
pub const OUTPUT_FILTER_HZ: f32 = 2000.0;
/// The highest voltage that any calibration may have a channel driven with. At it the paper's heaters are 129 K above
/// ambient in air (Table 1).
pub const HIGHEST_DRIVE: Volt = Volt(3.5);
/// The highest power that a calibration may allow (W): that drive at the coldest and lowest resistance is 37 mW.
pub const HIGHEST_POWER_W: f32 = 40e-3;
/// Resistances at ambient (ohm) that a heater on this board can have: the platinum line's 345 to 375 ohm (the paper's
/// Table 1), 4 % more or less among the four of a mirror, 40 ohm of leads, and a tenth for a line that is fitted over the
/// working range and meets ambient elsewhere.
pub const COLD_RESISTANCES_OHM: RangeInclusive<f32> = 310.0..=450.0;
/// Temperature coefficients (/K) that a calibration may have: 3.92e-3 is the platinum line's (the paper's Table 1), but displacement
/// and resistance tell only the product of coefficient and thermal resistance, so the temperatures of a refined model may be
/// off by a factor. The check of the cold heater and [`HIGHEST_TRIP_RISE`] hold what a calibration may claim within these.
pub const TCRS_PER_K: RangeInclusive<f32> = 1e-3..=1e-2;
/// Temperature coefficient of the heaters' platinum film (the paper's Table 1), by which the board tells a room in kelvins.
pub const FILM_TCR_PER_K: f32 = 3.92e-3;
/// The least that platinum's resistance grows with temperature, from a room's to 225 K more: IEC 60751 gives
/// R(247 degC) / R(22 degC) = 1.781.
pub const LEAST_TCR_PER_K: f32 = 3.47e-3;

/// How far a heater's resistance at ambient may be from the model's before it has been measured.
pub const COLD_RESISTANCE_TOLERANCE: Ohm = Ohm(15.0);
/// More than the coldest heater, 345 ohm, takes at the highest drive, 3.5 V; less than the sense's
/// range of 12.4 mA.
pub const HIGHEST_CURRENT: Ampere = Ampere(11.0e-3);
/// No heater may be hotter than this above ambient, whatever is driven and whatever a calibration says: aluminium films
/// begin to yield and creep above 250 degC.
pub const HOTTEST_RISE: Kelvin = Kelvin(225.0);
/// The board trips where a heater's resistance is that of platinum hotter by this, whatever a calibration says. The rest
/// up to [`HOTTEST_RISE`] is for what heats on until it is noticed, and for the tolerances of the sense; the search of
/// `cargo test -p protection --test attacks` set it.
pub const HIGHEST_TRIP_RISE: Kelvin = Kelvin(155.0);
