//! Channel states and leases.

use control_core::{AdcCode, Ampere, CHANNELS, Calibration, Limits, Setpoint, SupplyCode, Volt};

use crate::board::BoardWatch;
use crate::channel::ChannelWatch;
use crate::fault::Fault;

/// Drive at which heaters are checked before anything drives them: 0.28 mA, and a warming by 0.1 K.
const CHECK_DRIVE: Volt = Volt(0.1);
/// Ticks of the check: twice what the current needs to follow, and the debouncing.
const CHECK_TICKS: u8 = 16;

/// Fall of the drive in a tick once a lease has ended: from 3.5 V to zero in 88 ms.
const RAMP: Volt = Volt(4e-3);

/// What was sensed during one tick.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// Current-sense codes.
    pub codes: [AdcCode; CHANNELS],
    /// The currents that they stand for.
    pub currents: [Ampere; CHANNELS],
    /// The output stages' supply.
    pub supply: SupplyCode,
    /// Control ticks before this one that did not take place.
    pub missed_ticks: u16,
}

/// What one channel is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChannelState {
    /// Zero drive: another channel has turned the board off.
    #[default]
    Off,
    /// The heater is being checked, at start and once faults are cleared.
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
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The heaters are being checked.
    Starting { ticks_left: u8 },
    /// Zero drive, as wanted.
    Idle,
    /// What is wanted is carried out.
    Enabled,
    /// The lease has ended: the drives ramp to zero and stay there.
    Lapsed,
    /// A fault has turned all channels off.
    Tripped,
}

const CHECK: Phase = Phase::Starting {
    ticks_left: CHECK_TICKS,
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
            phase: CHECK,
            lease: Lease(0),
            granted: Lease(0),
            causes: [None; CHANNELS],
        }
    }

    /// Watches the heaters as another calibration describes them, and checks them.
    pub fn recalibrate(&mut self, calibration: &Calibration) {
        self.channels = watches(calibration);
        if self.phase != Phase::Tripped {
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
            Phase::Starting { .. } | Phase::Idle | Phase::Lapsed => Err(Denied::NoLease),
        }
    }

    /// Forgets the faults and checks the heaters. What still is a fault trips again.
    pub fn clear(&mut self) {
        self.causes = [None; CHANNELS];
        self.phase = CHECK;
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
            Phase::Idle | Phase::Tripped => Setpoint::Off,
            Phase::Starting { .. } => Setpoint::Drive([CHECK_DRIVE; CHANNELS]),
            Phase::Enabled => wanted,
            Phase::Lapsed => {
                Setpoint::Drive(applied.map(|drive| Volt((drive.0 - RAMP.0).max(0.0))))
            }
        }
    }

    /// Whether heaters are being checked, and what is wanted has to wait.
    pub fn is_starting(&self) -> bool {
        matches!(self.phase, Phase::Starting { .. })
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

    /// Whether the next tick ends a lease that was granted for no longer than `short`.
    pub fn is_about_to_lapse(&self, short: Lease) -> bool {
        self.lease() == Some(Lease(0)) && self.granted <= short
    }

    /// What each channel is doing, where it drives `drives` and `limits` act.
    pub fn states(&self, drives: [Volt; CHANNELS], limits: Limits) -> [ChannelState; CHANNELS] {
        core::array::from_fn(|i| match (self.causes[i], self.phase) {
            (Some(fault), _) => ChannelState::Tripped(fault),
            (None, Phase::Tripped) => ChannelState::Off,
            (None, Phase::Starting { .. }) => ChannelState::Starting,
            (None, _) if drives[i].0 == 0.0 => ChannelState::Ready,
            (None, _) if limits != Limits::NONE => ChannelState::Limited,
            (None, _) => ChannelState::Driving,
        })
    }

    fn watch(&mut self, applied: &[Volt; CHANNELS], reading: &Reading) {
        let board = self.board.check(reading.supply, reading.missed_ticks);
        let mut found = [board; CHANNELS];
        for (i, channel) in self.channels.iter_mut().enumerate() {
            let heater = channel.check(applied[i], reading.codes[i], reading.currents[i]);
            found[i] = heater.or(found[i]);
        }
        // What follows from the first fault is none of its causes.
        if self.phase != Phase::Tripped && found.iter().any(Option::is_some) {
            self.causes = found;
            self.phase = Phase::Tripped;
        }
    }

    fn next_phase(&mut self, wanted: Setpoint) -> Phase {
        match self.phase {
            Phase::Tripped => Phase::Tripped,
            Phase::Starting { ticks_left } if ticks_left > 0 => Phase::Starting {
                ticks_left: ticks_left - 1,
            },
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
