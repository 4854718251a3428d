//! The control tick: converter codes in, PWM codes out.

use control_core::{Controller, LANES, Limit, PwmCode, Setpoint};
use mirror_protocol::{ChannelState, Commanded, Health, LEASE_FOREVER_MS, Stream, Telemetry};
use protection::{Denied, Lease, Protection, Reading};

use crate::board::{Board, Sensed};
use crate::mailbox::{Mailbox, Order};
use crate::{TICK_HZ, TICKS_PER_MS};

/// Runs the control loop on `board`, a tick at a time, for ever.
pub async fn run(mut board: impl Board, mut control: Control) -> ! {
    loop {
        let sensed = board.sense().await;
        let codes = control.tick(sensed);
        board.drive(codes);
    }
}

/// Leases up to this one are those of a host that renews all the time: 1 s.
const SHORT_LEASE_TICKS: u32 = TICK_HZ;

/// The state from one tick to the next.
pub struct Control {
    controller: Controller,
    protection: Protection,
    mailbox: &'static Mailbox,
    setpoint: Setpoint,
    applied: [PwmCode; LANES],
    tick: u32,
    missed_ticks: u32,
    /// An order waits to be confirmed.
    is_unconfirmed: bool,
    stream: Pacer,
}

impl Control {
    /// A loop that starts with all channels off.
    pub fn new(controller: Controller, mailbox: &'static Mailbox) -> Self {
        Self {
            protection: Protection::new(controller.calibration()),
            controller,
            mailbox,
            setpoint: Setpoint::Off,
            applied: [PwmCode(0); LANES],
            tick: 0,
            missed_ticks: 0,
            is_unconfirmed: false,
            stream: Pacer::default(),
        }
    }

    /// One tick: `sensed` are the codes read while the codes of the last tick were driven; the
    /// result is driven next.
    pub fn tick(&mut self, sensed: Sensed) -> [PwmCode; LANES] {
        if let Some(order) = self.mailbox.take_order() {
            self.take(order);
        }
        let applied = self.applied.map(PwmCode::drive);
        let currents = sensed.currents.map(|code| code.current());
        let reading = Reading {
            codes: sensed.currents,
            currents,
            supply: sensed.supply,
            missed_ticks: sensed.missed_ticks,
        };
        let allowed = self.protection.tick(self.setpoint, applied, &reading);
        let mut step = self.controller.step(allowed, applied, currents);
        if self.protection.has_lapsed() {
            step.limits.insert(Limit::LeaseLapsed);
        }
        let codes = step.drives.map(PwmCode::nearest);

        self.missed_ticks = self.missed_ticks.wrapping_add(sensed.missed_ticks.into());
        self.tick = self.tick.wrapping_add(sensed.missed_ticks.into());
        let telemetry = Telemetry {
            tick: self.tick,
            drive_v: applied.map(|drive| drive.0),
            current_a: currents.map(|current| current.0),
            temperature_k: step
                .sense
                .map(|lane| lane.map(|lane| lane.temperature_rise.0)),
            limits: step.limits.bits(),
            states: self
                .protection
                .states(step.drives, step.limits)
                .map(wire_state),
            sensor_z_um: sensed.sensor_z.map(|z| z.0),
        };
        let health = Health {
            lease_left_ms: self.protection.lease().map(lease_ms),
            supply_v: sensed.supply.voltage().0,
            missed_ticks: self.missed_ticks,
        };
        self.report(codes, telemetry, health);
        self.applied = codes;
        self.tick = self.tick.wrapping_add(1);
        codes
    }

    fn take(&mut self, order: Order) {
        let taken = match order {
            Order::Drive(setpoint, lease) => self
                .protection
                .command(lease)
                .map(|()| self.setpoint = setpoint),
            Order::Renew(lease) => self.protection.renew(lease),
            Order::Off => {
                self.setpoint = Setpoint::Off;
                Ok(())
            }
            Order::Clear => {
                self.setpoint = Setpoint::Off;
                self.protection.clear();
                Ok(())
            }
        };
        match taken {
            Ok(()) => self.is_unconfirmed = true,
            Err(denied) => self.mailbox.confirm(Err(denied)),
        }
    }

    fn report(&mut self, codes: [PwmCode; LANES], telemetry: Telemetry, health: Health) {
        let short = Lease::ticks(SHORT_LEASE_TICKS);
        let about_to_lapse = self.protection.is_about_to_lapse(short);
        self.mailbox.publish(telemetry, health, about_to_lapse);
        if self.is_unconfirmed && !self.protection.is_starting() {
            self.is_unconfirmed = false;
            let done = Commanded {
                tick: telemetry.tick,
                drive_v: codes.map(|code| code.drive().0),
                limits: telemetry.limits,
            };
            let driven_to_a_trip = self
                .protection
                .first_cause()
                .filter(|_| self.setpoint != Setpoint::Off);
            self.mailbox
                .confirm(driven_to_a_trip.map_or(Ok(done), |fault| Err(Denied::Tripped(fault))));
        }
        if let Some(stream) = self.mailbox.take_stream() {
            self.stream = Pacer::new(stream);
            self.mailbox.begin_stream(telemetry.tick);
        }
        if self.stream.is_due() {
            self.mailbox.send_sample(telemetry);
        }
    }
}

fn wire_state(state: protection::ChannelState) -> ChannelState {
    match state {
        protection::ChannelState::Off => ChannelState::Off,
        protection::ChannelState::Starting => ChannelState::Starting,
        protection::ChannelState::Ready => ChannelState::Ready,
        protection::ChannelState::Driving => ChannelState::Driving,
        protection::ChannelState::Limited => ChannelState::Limited,
        protection::ChannelState::Tripped(fault) => ChannelState::Tripped(fault.code()),
    }
}

fn lease_ms(lease: Lease) -> u32 {
    lease
        .remaining()
        .map_or(LEASE_FOREVER_MS, |ticks| ticks / TICKS_PER_MS)
}

/// Picks the ticks that a stream asked for.
#[derive(Default)]
struct Pacer {
    period_ticks: u16,
    ticks_to_next: u16,
    samples_left: u32,
}

impl Pacer {
    fn new(stream: Stream) -> Self {
        Self {
            period_ticks: stream.period_ticks,
            ticks_to_next: 1,
            samples_left: stream.count,
        }
    }

    fn is_due(&mut self) -> bool {
        if self.samples_left == 0 {
            return false;
        }
        self.ticks_to_next = self.ticks_to_next.saturating_sub(1);
        if self.ticks_to_next > 0 {
            return false;
        }
        self.ticks_to_next = self.period_ticks;
        self.samples_left -= 1;
        true
    }
}
