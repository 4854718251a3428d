//! What the application needs of a board.

#[cfg(feature = "board-host")]
pub mod host;
#[cfg(any(feature = "board-host", feature = "board-mps2"))]
pub mod lockstep;
#[cfg(feature = "board-mps2")]
pub mod mps2;
#[cfg(feature = "board-stm32g474")]
pub mod stm32g474;

#[cfg(feature = "board-host")]
pub use host::{flash::BoardFlash, link::LinkTx};
#[cfg(feature = "board-mps2")]
pub use mps2::{flash::BoardFlash, link::LinkTx};
#[cfg(feature = "board-stm32g474")]
pub use stm32g474::{flash::BoardFlash, link::LinkTx};

use control_core::{AdcCode, CHANNELS, Micrometre, PwmCode, SupplyCode};
use mirror_protocol::{OptionBytes, Trigger};

/// A board as the control loop sees it.
pub trait Board {
    /// What people call it.
    const NAME: &'static str;

    /// Whether it is emulated, with a virtual mirror on it.
    const IS_EMULATED: bool;

    /// Leaves for a bootloader that takes new firmware, where there is one.
    const BOOTLOADER: Option<fn() -> !>;

    /// The option bytes of the board's chip, where it has any.
    fn option_bytes() -> Option<OptionBytes> {
        None
    }

    /// Drives the four channels from the next tick on, in which the trigger pins tell what begins then; whether that came before the tick began. What comes later is
    /// driven a tick late, and maybe not on all channels at once. After [`Self::disable`] it switches the output stages'
    /// supply on and enables the outputs: zero is to be driven until the supply is there.
    fn drive(&mut self, codes: [PwmCode; CHANNELS], trigger: Trigger) -> bool;

    /// Disables the outputs of all four channels and switches their stages' supply off until the next [`Self::drive`]:
    /// more than code 0, for a channel whose compare value does not act, and for a stage that does not follow.
    fn disable(&mut self);
}

/// What the converters read during one control tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sensed {
    /// Current sense, channel by channel.
    pub currents: [AdcCode; CHANNELS],
    /// Supply of the output stages.
    pub supply: SupplyCode,
    /// The comparators at the outputs have disabled them since they were enabled last.
    pub is_over_voltage: bool,
    /// Control ticks before this one that did not take place.
    pub missed_ticks: u16,
    /// A position sensor on the sensor input, if there is one. For telemetry only.
    pub sensor_z: Option<Micrometre>,
}
