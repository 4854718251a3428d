//! The plant link: two FIFOs through semihosting, blocking, one exchange a control tick.

use core::sync::atomic::Ordering;

use control_core::{AdcCode, CHANNELS, Micrometre, PwmCode, SupplyCode};
use embassy_futures::yield_now;
use plant_link::{Converters, FROM_PLANT, Pins, TO_PLANT};
use protection::Lease;
use semihosting::fs::File;
use semihosting::io::{self, Read, Write};

use super::grace::Grace;
use super::{exit, time, upset, watchdog};
use crate::TICK_HZ;
use crate::board::{Board, Lockstep, Sensed};
use crate::control::Control;

/// Leases up to this one, 100 ms, are those of a host that renews all the time (`docs/protocol.md`).
const SHORT_LEASE: Lease = Lease::ticks(TICK_HZ / 10);

/// A plant that waits for the board at every tick, as the board waits for it.
pub struct LockstepPlant {
    to_plant: File,
    from_plant: File,
    pins: Pins,
    is_idle: bool,
    quiet_ticks: u16,
    grace: Grace,
}

impl LockstepPlant {
    /// Opens the link and starts the first tick with all channels off.
    ///
    /// # Errors
    /// Where the emulator was started without a plant, or the link is already open.
    pub fn open() -> io::Result<Self> {
        // The other end opens in the same order; opening a FIFO waits for it.
        let to_plant = File::create(TO_PLANT)?;
        let from_plant = File::open(FROM_PLANT)?;
        let grace = Grace::take().ok_or(io::ErrorKind::AlreadyExists)?;
        let mut plant = Self {
            grace,
            to_plant,
            from_plant,
            pins: Pins::default(),
            is_idle: false,
            quiet_ticks: 0,
        };
        plant.send()?;
        exit::HAS_PLANT.store(true, Ordering::Relaxed);
        Ok(plant)
    }

    fn send(&mut self) -> io::Result<()> {
        self.to_plant.write_all(&self.pins.to_bytes())
    }

    /// Ends the tick with these pins.
    fn set(&mut self, codes: [PwmCode; CHANNELS], enable: bool) {
        self.pins = Pins {
            tick: self.pins.tick.wrapping_add(1),
            compare: codes.map(|code| code.0),
            outputs_enabled: enable,
            stages_supplied: enable,
            is_idle: self.is_idle,
        };
        if self.send().is_err() {
            exit::plant_lost();
        }
    }

    /// A short lease ends for want of a host, and not for want of a fast one.
    async fn wait_for_renewal(&mut self, control: &Control) {
        if control.is_about_to_lapse(SHORT_LEASE) {
            self.grace.begin();
            while control.is_about_to_lapse(SHORT_LEASE) && !self.grace.is_over() {
                watchdog::feed();
                yield_now().await;
            }
        }
    }

    /// What was read at the pins that were sent last. A reset can have left behind an answer to others.
    fn receive(&mut self) -> io::Result<Converters> {
        loop {
            let mut bytes = [0; Converters::BYTES];
            self.from_plant.read_exact(&mut bytes)?;
            let converters = Converters::from_bytes(&bytes);
            if converters.tick == self.pins.tick {
                return Ok(converters);
            }
        }
    }
}

impl Board for LockstepPlant {
    const NAME: &'static str = "emulated MPS2-AN386 with a virtual mirror";
    const IS_EMULATED: bool = true;
    const BOOTLOADER: Option<fn() -> !> = None;

    fn drive(&mut self, codes: [PwmCode; CHANNELS]) -> bool {
        self.set(codes, true);
        true
    }

    fn disable(&mut self) {
        self.set([PwmCode(0); CHANNELS], false);
    }
}

impl Lockstep for LockstepPlant {
    async fn sense(&mut self, control: &Control) -> Sensed {
        yield_now().await;
        // Simulated time waits for the host rather than losing samples.
        while control.is_congested() {
            watchdog::feed();
            yield_now().await;
        }
        self.wait_for_renewal(control).await;
        let Ok(converters) = self.receive() else {
            exit::plant_lost()
        };
        upset::suffer(converters.upset);
        self.is_idle = control.is_idle();
        self.quiet_ticks = converters.quiet_ticks;
        time::advance(1 + u64::from(self.quiet_ticks));
        let missed_ticks = converters.missed_ticks;
        let passed = u32::from(missed_ticks) + u32::from(self.quiet_ticks);
        self.pins.tick = self.pins.tick.wrapping_add(passed);
        Sensed {
            currents: converters.current.map(AdcCode),
            supply: SupplyCode(converters.supply),
            missed_ticks,
            is_over_voltage: converters.is_over_voltage,
            sensor_z: converters.sensor_z().map(Micrometre),
        }
    }

    fn quiet_ticks(&self) -> u16 {
        self.quiet_ticks
    }
}
