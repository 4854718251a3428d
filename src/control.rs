//! The control tick: converter codes in, PWM codes out.

mod wire;

use core::sync::atomic::Ordering;

use control_core::{
    Ampere, CHANNELS, Controller, CurrentSense, Limit, Limits, Micrometre, PwmCode,
    SenseCalibration, Setpoint, SupplyCode, Volt,
};
use mirror_protocol::{Commanded, Health, Telemetry};
use protection::{Denied, Fault, Lease, Protection, Reading};
use waveforms::{Player, Sampler, Stream, Trigger};

use crate::TICK_HZ;
use crate::board::{Board, Sensed};
use crate::mailbox::{ControlSide, Order};
use crate::retained::{KEPT_EVERY, Keep};
use crate::watchdog;

/// Samples so long after the last that told the uncertainty tell it again: the core takes as long to find it.
const UNCERTAINTY_TICKS: u32 = 16;

/// So often heaters are read again that may be another mirror's: after 11 s, one more than the core waits to decide by (`likeness.rs`).
const HEATERS_ASKED_EVERY: u32 = 11 * TICK_HZ;

/// The state from one tick to the next.
pub struct Control {
    sense: CurrentSense,
    /// What the protection goes by.
    watched_sense: CurrentSense,
    controller: Controller<'static>,
    retained: &'static Keep,
    /// The tick in which an actuator's states were kept last, and whose come next.
    kept: u32,
    next_kept: usize,
    protection: Protection,
    mailbox: ControlSide,
    setpoint: Setpoint,
    player: Option<Player>,
    /// The stream of a waveform that has not begun.
    awaited: Option<Stream>,
    /// An order has been taken and not been confirmed.
    is_unconfirmed: bool,
    applied: [PwmCode; CHANNELS],
    /// Whether the codes of `applied` came with another setpoint than those before.
    stepped: bool,
    limits_since_command: Limits,
    /// The trip that there is has been told to whoever logs it.
    is_trip_told: bool,
    tick: u32,
    missed_ticks: u32,
    late_ticks: u32,
    stream: Sampler,
    /// The tick of the last sample that told the uncertainty.
    uncertainty_told: u32,
    /// The tick in which they were read last for that.
    asked_heaters: u32,
    /// What begins as the codes of `applied` are driven.
    trigger: Trigger,
    /// What has begun since the last sample.
    untold: Trigger,
}

/// What a tick decides.
struct Decided {
    codes: [PwmCode; CHANNELS],
    /// What begins with them.
    trigger: Trigger,
    limits: Limits,
    currents: [Ampere; CHANNELS],
    sensor_z: Option<Micrometre>,
    supply: SupplyCode,
    /// What was wanted before.
    last: Setpoint,
}

impl Control {
    /// A loop that starts with all channels off.
    pub fn new(
        controller: Controller<'static>,
        sense: &SenseCalibration,
        mailbox: ControlSide,
        retained: &'static Keep,
    ) -> Self {
        Self {
            sense: CurrentSense::new(sense),
            watched_sense: CurrentSense::new(&sense.with_designed_gain()),
            protection: Protection::new(controller.calibration()),
            controller,
            retained,
            kept: 0,
            next_kept: 0,
            mailbox,
            setpoint: Setpoint::Off,
            player: None,
            awaited: None,
            is_unconfirmed: false,
            applied: [PwmCode(0); CHANNELS],
            stepped: false,
            limits_since_command: Limits::NONE,
            is_trip_told: false,
            tick: 0,
            missed_ticks: 0,
            late_ticks: 0,
            stream: Sampler::default(),
            uncertainty_told: 0,
            asked_heaters: 0,
            trigger: Trigger::NONE,
            untold: Trigger::NONE,
        }
    }

    /// Drives nothing until the fault that stopped the firmware before this start is cleared.
    pub fn trip(&mut self, fault: Fault) {
        self.protection.trip(fault);
    }

    /// Whether a lease that was granted for no longer than `short` ends after `soon`, or before.
    pub fn is_about_to_lapse(&self, short: Lease, soon: Lease) -> bool {
        self.protection.is_about_to_lapse(short, soon)
    }

    /// Whether anything waits for the next tick.
    pub fn is_asked(&self) -> bool {
        self.mailbox.has_any()
    }

    /// An idle board was left alone for so many ticks, in which it read this. Where they would change nothing they are only
    /// counted.
    pub fn be_quiet(&mut self, ticks: u16, sensed: Sensed) {
        if self.is_idle() && self.controller.is_at_rest() {
            self.count(ticks.into());
            self.controller.rest(ticks);
            return;
        }
        for _ in 0..ticks {
            self.tick(sensed);
        }
    }

    /// Whether nothing is driven, streamed or waited for.
    pub fn is_idle(&self) -> bool {
        self.setpoint == Setpoint::Off
            && self.player.is_none()
            && self.stream.is_over()
            && !self.is_unconfirmed
            && !self.controller.is_exchanging()
            && !self.protection.is_starting()
            && self.applied == [PwmCode(0); CHANNELS]
    }

    /// Whether the link has fallen behind: the next sample would be dropped. No stop waits for a link.
    pub fn is_congested(&self) -> bool {
        self.mailbox.is_congested() && !self.mailbox.has_stop()
    }

    /// One tick of `board`, which has just said what was sensed.
    pub fn tick_on(&mut self, board: &mut impl Board, sensed: Sensed) {
        let before = self.applied;
        let decided = self.decide(sensed);
        // What the next tick waits for comes before what the host waits for.
        let is_in_time = match self.protection.powers_stages() {
            true => board.drive(decided.codes, decided.trigger),
            false => {
                board.disable();
                true
            }
        };
        self.tell(decided);
        if self.protection.first_cause().is_some() {
            self.tell_trip();
        }
        if !is_in_time {
            self.late_ticks = self.late_ticks.wrapping_add(1);
            // The next tick senses what these drive.
            self.applied = before;
        }
    }

    fn tell_trip(&mut self) {
        if !self.is_trip_told {
            self.is_trip_told = true;
            self.mailbox.tell_trip();
        }
    }

    /// One tick: `sensed` are the codes read while the codes of the last tick were driven; the
    /// result is driven next.
    pub fn tick(&mut self, sensed: Sensed) -> [PwmCode; CHANNELS] {
        let decided = self.decide(sensed);
        let codes = decided.codes;
        self.tell(decided);
        codes
    }

    /// What is driven next.
    fn decide(&mut self, sensed: Sensed) -> Decided {
        self.missed_ticks = self.missed_ticks.wrapping_add(sensed.missed_ticks.into());
        self.count(sensed.missed_ticks.into());
        let last = self.setpoint;
        self.take_orders();
        let trigger = self.play();

        let applied = self.applied.map(PwmCode::drive);
        let currents = self.sense.currents(sensed.currents);
        let reading = Reading {
            codes: sensed.currents,
            currents: self.watched_sense.currents(sensed.currents),
            supply: sensed.supply,
            missed_ticks: sensed.missed_ticks,
            is_over_voltage: sensed.is_over_voltage,
        };
        let allowed = self.protection.tick(self.setpoint, applied, &reading);
        watchdog::PROTECTION.store(true, Ordering::Relaxed);
        let step = self.controller.step(allowed, applied, currents);
        let (codes, mut limits) = (step.codes, step.limits);
        if self.protection.has_lapsed() {
            limits.insert(Limit::LeaseLapsed);
        }
        self.limits_since_command = self.limits_since_command.union(limits);
        Decided {
            codes,
            trigger,
            limits,
            currents,
            sensor_z: sensed.sensor_z,
            supply: sensed.supply,
            last,
        }
    }

    /// What the host is told of this tick.
    fn telemetry(&self, decided: &Decided) -> Telemetry {
        let step = self.controller.latest();
        Telemetry {
            tick: self.tick,
            drive_v: self.applied.map(|code| code.drive().0),
            current_a: decided.currents.map(|current| current.0),
            temperature_k: step
                .sense
                .map(|channel| channel.map(|channel| channel.temperature_rise.0)),
            limits: decided.limits.bits(),
            states: self
                .protection
                .states(step.drives, step.limits)
                .map(wire::state),
            sensor_z_um: decided.sensor_z.map(|z| z.0),
            pose: wire::pose(&self.controller),
            room: self.controller.surroundings().map(wire::room),
            uncertainty: self.controller.uncertainty().map(wire::uncertainty),
            settles_in_ms: self.controller.settles_in().map(wire::whole_ms),
            trigger: self.trigger,
        }
    }

    /// Tells the host what was decided, which is driven from now on.
    fn tell(&mut self, decided: Decided) {
        let telemetry = self.telemetry(&decided);
        self.answer(decided.codes, &telemetry);
        self.report(telemetry, decided.supply);
        self.controller.foresee();
        self.applied = decided.codes;
        self.trigger = decided.trigger;
        self.stepped = self.setpoint != decided.last;
        self.tick = self.tick.wrapping_add(1);
        watchdog::CONTROL.store(true, Ordering::Relaxed);
        self.exchange();
        self.keep();
    }

    /// Has heaters read again that may be another mirror's, or were warm so far, while nothing else is asked of them. Now and then it is looked at.
    #[cold]
    fn ask_heaters(&mut self) {
        if self.controller.asks_for_heaters()
            && self.tick.wrapping_sub(self.asked_heaters) >= HEATERS_ASKED_EVERY
            && self.is_idle()
        {
            self.check_heaters();
        }
    }

    #[cold]
    fn check_heaters(&mut self) {
        self.asked_heaters = self.tick;
        self.protection.check_again();
    }

    /// Keeps what is to outlive a reset, one actuator's now and then; nothing of a controller that is between two calibrations.
    fn keep(&mut self) {
        if self.tick.wrapping_sub(self.kept) >= KEPT_EVERY && !self.controller.is_exchanging() {
            self.kept = self.tick;
            let retained = self.controller.retained(self.next_kept);
            self.retained.keep(self.next_kept, &retained);
            self.next_kept = (self.next_kept + 1) % CHANNELS;
            self.ask_heaters();
        }
    }

    /// Takes another calibration, of which much is computed: after what this tick has to drive, and a stage in each of the next ticks. Until
    /// then the protection lets nothing be driven but the heaters' check.
    fn exchange(&mut self) {
        if self.controller.is_exchanging() {
            if let Some(before) = self.controller.exchange_on() {
                self.mailbox.return_calibration(before);
                // By all of the new one.
                self.check_heaters();
            }
        } else if let Some(calibration) = self.mailbox.take_calibration() {
            // Drives computed under another calibration mean nothing.
            self.follow(Setpoint::Off);
            self.protection.recalibrate(calibration);
            self.controller.begin_exchange(calibration);
        }
        if let Some(sense) = self.mailbox.take_sense() {
            self.sense = CurrentSense::new(&sense);
            self.watched_sense = CurrentSense::new(&sense.with_designed_gain());
        }
    }

    fn count(&mut self, ticks: u32) {
        self.tick = self.tick.wrapping_add(ticks);
    }

    /// Takes what came since the last tick, as far as the protection lets it.
    fn take_orders(&mut self) {
        if self.mailbox.take_stop() {
            self.follow(Setpoint::Off);
        }
        if let Some((player, stream, lease)) = self.mailbox.take_play() {
            match self.protection.command(lease) {
                Ok(()) => {
                    // Until the heaters are checked.
                    self.follow(Setpoint::Drive([Volt(0.0); CHANNELS]));
                    let player = player.leading(self.controller.track_delay_ticks());
                    (self.player, self.awaited) = (Some(player), Some(stream));
                }
                Err(denied) => self.mailbox.deny_play(denied),
            }
        }
        if let Some(order) = self.mailbox.take_order() {
            match self.take(order) {
                Ok(()) => self.is_unconfirmed = true,
                Err(denied) => self.mailbox.confirm(Err(denied)),
            }
        }
    }

    fn take(&mut self, order: Order) -> Result<(), Denied> {
        match order {
            Order::Drive(setpoint, lease) => {
                self.protection.command(lease)?;
                self.follow(setpoint);
            }
            Order::Renew(lease) => self.protection.renew(lease)?,
            Order::Off => self.follow(Setpoint::Off),
            // A sound board goes on with what it does.
            Order::Compensate(is_wanted) => self.controller.compensate_surroundings(is_wanted),
            Order::Clear if self.protection.first_cause().is_none() => {}
            Order::Clear => {
                self.protection.clear();
                self.is_trip_told = false;
                self.follow(Setpoint::Off);
            }
        }
        Ok(())
    }

    /// Wants `setpoint` from now on, and no waveform.
    fn follow(&mut self, setpoint: Setpoint) {
        self.setpoint = setpoint;
        self.limits_since_command = Limits::NONE;
        self.player = None;
        self.awaited = None;
    }

    /// The waveform's next value, where one plays; what begins with it.
    fn play(&mut self) -> Trigger {
        let Some(player) = &mut self.player else {
            return Trigger::NONE;
        };
        if self.protection.is_starting() {
            return Trigger::NONE;
        }
        if player.is_over() && player.waveform().ends_off {
            self.follow(Setpoint::Off);
            return Trigger::NONE;
        }
        let played = player.next(|index| self.mailbox.point(index));
        self.setpoint = player.waveform().setpoint(&played);
        if let Some(stream) = self.awaited.take() {
            self.begin_stream(stream);
        }
        played.trigger
    }

    /// Answers orders that have been carried out, or can no longer be.
    fn answer(&mut self, codes: [PwmCode; CHANNELS], telemetry: &Telemetry) {
        let denied = self.protection.first_cause().map(Denied::Tripped);
        if let Some(denied) = denied.filter(|_| self.awaited.is_some()) {
            self.follow(Setpoint::Off);
            self.mailbox.deny_play(denied);
        }
        if self.is_unconfirmed && !self.protection.is_starting() {
            self.is_unconfirmed = false;
            let done = Commanded {
                tick: telemetry.tick,
                drive_v: codes.map(|code| code.drive().0),
                limits: telemetry.limits,
            };
            // Turning off, and forgetting faults, is done whatever has tripped.
            let denied = denied.filter(|_| self.setpoint != Setpoint::Off);
            self.mailbox.confirm(denied.map_or(Ok(done), Err));
        }
    }

    fn report(&mut self, telemetry: Telemetry, supply: SupplyCode) {
        let health = Health {
            lease_left_ms: self.protection.lease().map(wire::lease_ms),
            supply_v: supply.voltage().0,
            missed_ticks: self.missed_ticks,
            late_ticks: self.late_ticks,
            limits_since_command: self.limits_since_command.bits(),
            compensates_room: self.controller.compensates_surroundings(),
            lowest_position_um: self.controller.lowest().0,
            loss: self.controller.surroundings().map(wire::loss),
        };
        self.mailbox.publish(telemetry, health);
        if let Some(stream) = self.mailbox.take_stream() {
            self.begin_stream(stream);
        }
        self.untold = self.untold.with(telemetry.trigger);
        let reading = waveforms::Reading {
            current_a: telemetry.current_a,
            sensor_z_um: telemetry.sensor_z_um,
        };
        if let Some(sample) = self.stream.tick(reading, self.stepped) {
            // A sample of every tick, all of it, is more than USB carries.
            let is_told = telemetry.tick.wrapping_sub(self.uncertainty_told) >= UNCERTAINTY_TICKS;
            if is_told {
                self.uncertainty_told = telemetry.tick;
            }
            self.mailbox.send_sample(Telemetry {
                uncertainty: telemetry.uncertainty.filter(|_| is_told),
                settles_in_ms: telemetry.settles_in_ms.filter(|_| is_told),
                current_a: sample.current_a,
                sensor_z_um: sample.sensor_z_um,
                trigger: core::mem::take(&mut self.untold),
                ..telemetry
            });
        }
    }

    fn begin_stream(&mut self, stream: Stream) {
        self.stream = Sampler::new(stream);
        self.mailbox.begin_stream(self.tick);
    }
}
