//! A board in lockstep with a plant that waits for it at every tick, as the board waits for the plant.

use control_core::{AdcCode, CHANNELS, Micrometre, PwmCode, SupplyCode};
use embassy_futures::yield_now;
use mirror_protocol::Trigger;
use plant_link::{Converters, Pins};
use protection::Lease;

use super::{Board, Sensed};
use crate::TICK_HZ;
use crate::control::Control;

/// Runs the control loop on a board in lockstep, a tick at a time, for ever.
pub async fn run<L: PlantLink>(mut board: LockstepBoard<L>, mut control: Control) -> ! {
    loop {
        let sensed = board.sense(&control).await;
        control.be_quiet(board.quiet_ticks, sensed);
        control.tick_on(&mut board, sensed);
    }
}

/// Leases up to this one, 100 ms, are those of a host that renews all the time (`docs/reference/protocol.md`).
const SHORT_LEASE: Lease = Lease::ticks(TICK_HZ / 10);
/// Time stands for a renewal from so much before the end on, 2 ms: what was asked before it is answered by a tick, for the link takes
/// one request after the other.
const SOON: Lease = Lease::ticks(TICK_HZ / 500);

/// The processor that the firmware runs on, and its way to the plant.
pub trait PlantLink {
    /// What people call the board.
    const NAME: &'static str;

    /// Sends the pins of the next tick.
    fn send(&mut self, pins: Pins);

    /// What was read at `pins`, which were sent last.
    fn receive(&mut self, pins: Pins) -> Converters;

    /// So many ticks have passed for everything that waits for a time.
    fn pass(&mut self, ticks: u64);

    /// Keeps the watchdog from running out, where there is one, while the board waits for its host.
    fn feed_watchdog(&mut self);

    /// From now on the host has some seconds of real time for what it owes: simulated time runs many times faster than the
    /// host's, so a host that renews a lease every few milliseconds of board time could not keep up on a busy machine.
    fn begin_grace(&mut self);

    /// Whether the host has had them.
    fn is_grace_over(&mut self) -> bool;
}

/// A board that waits for its plant.
pub struct LockstepBoard<L> {
    link: L,
    pins: Pins,
    is_idle: bool,
    quiet_ticks: u16,
    /// The host has not renewed the lease in its grace, which then ends.
    is_given_up: bool,
}

impl<L: PlantLink> LockstepBoard<L> {
    /// Starts the first tick with all channels off.
    pub fn new(mut link: L) -> Self {
        let pins = Pins::default();
        link.send(pins);
        Self {
            link,
            pins,
            is_idle: false,
            quiet_ticks: 0,
            is_given_up: false,
        }
    }

    /// Ends the tick with these pins.
    fn set(&mut self, codes: [PwmCode; CHANNELS], enable: bool, trigger: Trigger) {
        self.pins = Pins {
            tick: self.pins.tick.wrapping_add(1),
            compare: codes.map(|code| code.0),
            outputs_enabled: enable,
            stages_supplied: enable,
            trigger: trigger.bits(),
            is_idle: self.is_idle,
        };
        self.link.send(self.pins);
    }

    /// A short lease ends for want of a host, and not for want of a fast one.
    async fn wait_for_renewal(&mut self, control: &Control) {
        if !control.is_about_to_lapse(SHORT_LEASE, SOON) {
            self.is_given_up = false;
            return;
        }
        if self.is_given_up {
            return;
        }
        self.link.begin_grace();
        while !control.is_asked() {
            if self.link.is_grace_over() {
                self.is_given_up = true;
                return;
            }
            self.link.feed_watchdog();
            yield_now().await;
        }
    }
}

impl<L: PlantLink> Board for LockstepBoard<L> {
    const NAME: &'static str = L::NAME;
    const IS_EMULATED: bool = true;
    const BOOTLOADER: Option<fn() -> !> = None;

    fn drive(&mut self, codes: [PwmCode; CHANNELS], trigger: Trigger) -> bool {
        self.set(codes, true, trigger);
        true
    }

    fn disable(&mut self) {
        self.set([PwmCode(0); CHANNELS], false, Trigger::NONE);
    }
}

impl<L: PlantLink> LockstepBoard<L> {
    /// Waits for the next control tick and returns what the converters read during the one that just ended. Time can wait for
    /// the host; `control` tells whether it should.
    async fn sense(&mut self, control: &Control) -> Sensed {
        yield_now().await;
        // Simulated time waits for the host rather than losing samples.
        while control.is_congested() {
            self.link.feed_watchdog();
            yield_now().await;
        }
        self.wait_for_renewal(control).await;
        let converters = self.link.receive(self.pins);
        self.is_idle = control.is_idle();
        self.quiet_ticks = converters.quiet_ticks;
        self.link.pass(1 + u64::from(self.quiet_ticks));
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
}
