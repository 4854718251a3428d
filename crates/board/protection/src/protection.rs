//! Channel states and leases.

use control_core::{CHANNELS, Calibration, Limits, Setpoint, Volt};

use crate::board::BoardWatch;
use crate::channel::ChannelWatch;
use crate::fault::Fault;
use crate::reading::Reading;
use crate::told::TURNS;

/// Drive at which heaters are checked before anything drives them: 0.83 mA, of which an offset of 12 uA is 1.5 %, and a
/// temperature rise of at most 1.4 K.
const CHECK_DRIVE: Volt = Volt(0.3);
/// Ticks of the check: twice what the current needs to follow, and the ticks whose mean is the cold resistance.
const CHECK_TICKS: u8 = 24;
const COUNTED_TICKS: u8 = 8;
/// Ticks without drive between the checks of heaters that may still be warm, after a reset or a trip: 0.25 s.
const PAUSE_TICKS: u16 = 2500;

/// Ticks from the stages' supply being switched on to the first drive: twice what the load switch takes to bring 5 V up
/// (docs/board.md).
const POWER_TICKS: u8 = 20;

/// Fall of the drive in a tick once a lease has ended: from 3.5 V to zero in 88 ms.
const RAMP: Volt = Volt(4e-3);

/// What one channel is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChannelState {
    /// Zero drive: another channel has turned the board off.
    #[default]
    Off,
    /// The stages get their supply, or the heater is being checked, at start and once faults are cleared.
    Starting,
    /// The heater is sound; zero drive.
    Ready,
    /// Driven as asked.
    Driving,
    /// Driven, but not as asked; the limits say why.
    Limited,
    /// Turned off because of this fault.
    Tripped(Fault),
}

/// How long a command is carried out without renewal, in control ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Lease(u32);

/// Why a command or a renewal is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Denied {
    /// The board has tripped, for this reason first of all.
    Tripped(Fault),
    /// There is no lease to renew: nothing is driven, or the lease has ended.
    NoLease,
}

/// The state from one tick to the next.
#[derive(Clone, Debug)]
pub struct Protection {
    channels: [ChannelWatch; CHANNELS],
    board: BoardWatch,
    phase: Phase,
    lease: Lease,
    granted: Lease,
    causes: [Option<Fault>; CHANNELS],
    /// No heater may be warm from before a reset or a trip any more.
    have_cooled: bool,
    /// Which channel learns at this tick, if it is one of them.
    learning: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// No supply for the stages of heaters that may be warm; they are checked next.
    Cooling { ticks_left: u16 },
    /// The stages' supply comes up; zero drive.
    Powering { ticks_left: u8 },
    /// The heaters are being checked.
    Starting { ticks_left: u8 },
    /// Zero drive, as wanted.
    Idle,
    /// What is wanted is carried out.
    Enabled,
    /// The lease has ended: the drives ramp to zero and stay there.
    Lapsed,
    /// A fault has turned all channels off, and their supply.
    Tripped,
}

const POWER: Phase = Phase::Powering {
    ticks_left: POWER_TICKS - 1,
};

const CHECK: Phase = Phase::Starting {
    ticks_left: CHECK_TICKS,
};
const PAUSE: Phase = Phase::Cooling {
    ticks_left: PAUSE_TICKS,
};

impl Lease {
    /// A lease that does not end.
    pub const FOREVER: Self = Self(u32::MAX);

    /// A lease of so many ticks.
    pub const fn ticks(ticks: u32) -> Self {
        Self(ticks)
    }

    /// What is left of it, in ticks; `None`: it does not end.
    pub fn remaining(self) -> Option<u32> {
        (self != Self::FOREVER).then_some(self.0)
    }

    /// Lets a tick pass; whether the lease is over.
    fn is_over(&mut self) -> bool {
        if *self == Self::FOREVER {
            return false;
        }
        match self.0.checked_sub(1) {
            Some(left) => {
                self.0 = left;
                false
            }
            None => true,
        }
    }
}

impl Protection {
    /// Watches the heaters that `calibration` describes, and checks them first.
    pub fn new(calibration: &Calibration) -> Self {
        Self {
            channels: watches(calibration),
            board: BoardWatch::default(),
            phase: POWER,
            lease: Lease(0),
            granted: Lease(0),
            causes: [None; CHANNELS],
            have_cooled: false,
            learning: 0,
        }
    }

    /// Watches the same heaters as another calibration describes them, and checks them.
    pub fn recalibrate(&mut self, calibration: &Calibration) {
        let allowed = calibration.parts().bounds.rise;
        for (watch, actuator) in self.channels.iter_mut().zip(calibration.actuators()) {
            watch.recalibrate(actuator, allowed);
        }
        self.check_again();
    }

    /// Checks the heaters again, where nothing is in the way: what is wanted waits for it.
    pub fn check_again(&mut self) {
        if matches!(
            self.phase,
            Phase::Starting { .. } | Phase::Idle | Phase::Enabled | Phase::Lapsed
        ) {
            self.phase = CHECK;
        }
    }

    /// A command that drives the channels may be carried out, under this lease and no earlier one.
    ///
    /// # Errors
    /// Where the board has tripped.
    pub fn command(&mut self, lease: Lease) -> Result<(), Denied> {
        if let Some(fault) = self.first_cause() {
            return Err(Denied::Tripped(fault));
        }
        (self.lease, self.granted) = (lease, lease);
        if self.phase == Phase::Lapsed {
            self.phase = Phase::Enabled;
        }
        Ok(())
    }

    /// Extends the lease of what is driven to this one; a longer one stays.
    ///
    /// # Errors
    /// Where nothing is driven any more.
    pub fn renew(&mut self, lease: Lease) -> Result<(), Denied> {
        match self.phase {
            Phase::Enabled => {
                if lease > self.lease {
                    (self.lease, self.granted) = (lease, lease);
                }
                Ok(())
            }
            Phase::Tripped => Err(self.first_cause().map_or(Denied::NoLease, Denied::Tripped)),
            _ => Err(Denied::NoLease),
        }
    }

    /// Forgets the faults, and checks the heaters once they have cooled. What still is a fault trips again. Where nothing
    /// has tripped it forgets nothing: what is suspected of a heater is not for a host to clear.
    pub fn clear(&mut self) {
        if self.phase != Phase::Tripped {
            return;
        }
        self.have_cooled &= !self.causes.contains(&Some(Fault::OverTemperature));
        self.causes = [None; CHANNELS];
        self.phase = PAUSE;
        self.board.clear();
        self.channels.iter_mut().for_each(ChannelWatch::clear);
    }

    /// Trips all channels for a reason that is found elsewhere.
    pub fn trip(&mut self, fault: Fault) {
        if self.phase != Phase::Tripped {
            self.causes = [Some(fault); CHANNELS];
            self.phase = Phase::Tripped;
        }
    }

    /// One control tick: `reading` was sensed while `applied` was driven, and `wanted` was
    /// commanded. Returns what the control core may carry out.
    pub fn tick(
        &mut self,
        wanted: Setpoint,
        applied: [Volt; CHANNELS],
        reading: &Reading,
    ) -> Setpoint {
        self.watch(&applied, reading);
        self.phase = self.next_phase(wanted);
        match self.phase {
            Phase::Idle | Phase::Tripped | Phase::Cooling { .. } | Phase::Powering { .. } => {
                Setpoint::Off
            }
            Phase::Starting { .. } => Setpoint::Drive([CHECK_DRIVE; CHANNELS]),
            Phase::Enabled => wanted,
            Phase::Lapsed => {
                Setpoint::Drive(applied.map(|drive| Volt((drive.0 - RAMP.0).max(0.0))))
            }
        }
    }

    /// Whether stages get their supply or heaters are being checked, and what is wanted has to wait.
    pub fn is_starting(&self) -> bool {
        matches!(
            self.phase,
            Phase::Starting { .. } | Phase::Cooling { .. } | Phase::Powering { .. }
        )
    }

    /// Whether the output stages are to have their supply, and the outputs to be enabled. They have both at rest, too, so
    /// that what is commanded begins at its tick.
    pub fn powers_stages(&self) -> bool {
        !matches!(self.phase, Phase::Tripped | Phase::Cooling { .. })
    }

    /// Why the board has tripped, if it has: the fault of the first channel that has one.
    pub fn first_cause(&self) -> Option<Fault> {
        self.causes.into_iter().flatten().next()
    }

    /// Whether what was commanded is no longer carried out because its lease has ended.
    pub fn has_lapsed(&self) -> bool {
        self.phase == Phase::Lapsed
    }

    /// What is left of the lease; `None` where nothing is driven under one.
    pub fn lease(&self) -> Option<Lease> {
        (self.phase == Phase::Enabled).then_some(self.lease)
    }

    /// Whether a lease that was granted for no longer than `short` ends after `soon`, or before.
    pub fn is_about_to_lapse(&self, short: Lease, soon: Lease) -> bool {
        self.lease().is_some_and(|left| left <= soon) && self.granted <= short
    }

    /// What each channel is doing, where it drives `drives` and `limits` act.
    pub fn states(&self, drives: [Volt; CHANNELS], limits: Limits) -> [ChannelState; CHANNELS] {
        core::array::from_fn(|i| match (self.causes[i], self.phase) {
            (Some(fault), _) => ChannelState::Tripped(fault),
            (None, Phase::Tripped) => ChannelState::Off,
            (None, _) if self.is_starting() => ChannelState::Starting,
            (None, _) if drives[i].0 == 0.0 => ChannelState::Ready,
            (None, _) if limits != Limits::NONE => ChannelState::Limited,
            (None, _) => ChannelState::Driving,
        })
    }

    fn watch(&mut self, applied: &[Volt; CHANNELS], reading: &Reading) {
        let board = self.board.check(reading, self.powers_stages());
        let mut found = [board; CHANNELS];
        for (i, channel) in self.channels.iter_mut().enumerate() {
            if i == self.learning {
                channel.learn();
            }
            let heater = channel.check(applied[i], reading.codes[i], reading.currents[i]);
            found[i] = heater.or(found[i]);
        }
        self.learning = (self.learning + 1) % TURNS;
        if let Phase::Starting { ticks_left } = self.phase {
            self.check_heaters(ticks_left, reading, &mut found);
        }
        // What follows from the first fault is none of its causes.
        if self.phase != Phase::Tripped && found.iter().any(Option::is_some) {
            self.causes = found;
            self.phase = Phase::Tripped;
        }
    }

    /// The last ticks of the check tell the resistances of the heaters, which are cold then or still cool.
    fn check_heaters(
        &mut self,
        ticks_left: u8,
        reading: &Reading,
        found: &mut [Option<Fault>; CHANNELS],
    ) {
        if ticks_left >= COUNTED_TICKS {
            self.channels.iter_mut().for_each(ChannelWatch::begin_check);
            return;
        }
        for (channel, current) in self.channels.iter_mut().zip(reading.currents) {
            channel.add_to_check(current, 1.0 / f32::from(COUNTED_TICKS));
        }
        let is_sound = found.iter().all(Option::is_none);
        if ticks_left > 0 || !is_sound {
            return;
        }
        let mut is_any_cooling = false;
        for (found, channel) in found.iter_mut().zip(&mut self.channels) {
            match channel.end_check(CHECK_DRIVE) {
                Ok(is_cooling) => is_any_cooling |= is_cooling,
                Err(fault) => *found = Some(fault),
            }
        }
        self.have_cooled |= !is_any_cooling;
    }

    fn next_phase(&mut self, wanted: Setpoint) -> Phase {
        match self.phase {
            Phase::Tripped => Phase::Tripped,
            Phase::Cooling { ticks_left: 0 } => POWER,
            Phase::Cooling { ticks_left } => Phase::Cooling {
                ticks_left: ticks_left - 1,
            },
            Phase::Powering { ticks_left } if ticks_left > 0 => Phase::Powering {
                ticks_left: ticks_left - 1,
            },
            Phase::Powering { .. } => CHECK,
            Phase::Starting { ticks_left } if ticks_left > 0 => Phase::Starting {
                ticks_left: ticks_left - 1,
            },
            Phase::Starting { .. } if !self.have_cooled => PAUSE,
            _ if wanted == Setpoint::Off => Phase::Idle,
            Phase::Lapsed => Phase::Lapsed,
            _ if self.lease.is_over() => Phase::Lapsed,
            _ => Phase::Enabled,
        }
    }
}

fn watches(calibration: &Calibration) -> [ChannelWatch; CHANNELS] {
    let allowed = calibration.parts().bounds.rise;
    let channels = calibration.actuators().each_ref();
    channels.map(|channel| ChannelWatch::new(channel, allowed))
}
