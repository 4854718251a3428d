//! MPS2-AN386 in QEMU: a Cortex-M4F whose time is the count of control ticks, in lockstep with the
//! plant behind it.
//!
//! embassy-stm32 cannot start on any machine that QEMU offers, since the ready bits of the clock
//! registers are not modelled; hence these few drivers.

mod exit;
pub mod flash;
mod grace;
pub mod link;
mod plant;
pub mod stop_fifos;
mod time;
mod uart;
mod upset;
pub mod watchdog;

pub use exit::origin;
pub use plant::PlantFifos;

/// Timestamps of log messages, in simulated microseconds.
mod log {
    use defmt_semihosting as _;

    defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());
}
