//! What breaks in the plant, on demand, and how the board takes it.

use std::sync::{Arc, Mutex};

use plant_link::{Converters, upset};
use virtual_mirror::MirrorConfig;

/// Part of the heat that the air takes which is left in a poor vacuum: the beams are then cooled by their ends.
const VACUUM: f64 = 0.05;
/// A solder bridge across a channel, with the leads to it (ohm).
const SHORT_OHM: f64 = 3.0;
/// What an output stage makes of a PWM pin that is always high.
const FULL_DUTY_V: f64 = 4.25;
/// What the stages are supplied with, less nothing: an amplifier that reaches its rail.
const STAGE_SUPPLY_V: f64 = 5.0;
/// Supply of a weak port, and of a bench supply set wrongly.
const WEAK_SUPPLY_V: f64 = 4.1;
/// What a board drives at most to check its heaters, and a rounding more.
const CHECK_V: f64 = 0.301;
/// Ticks that an overrun skips.
const SKIPPED_TICKS: u32 = 10;

/// What breaks, on the channel that is named where it breaks on one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlantFault {
    /// The heater's beams break.
    OpenHeater(usize),
    /// The heater is shorted by 3 ohm.
    ShortCircuit(usize),
    /// The heater is bridged by so many ohms, which dirt can do.
    Bridge(usize, u16),
    /// The channel's PWM pin stays high: its stage drives 4.25 V for as long as the timer's outputs are enabled.
    StuckOutput(usize),
    /// The channel's stage stays at its supply, whatever the board does.
    StuckStage(usize),
    /// The mirror is in vacuum, where heat hardly leaves it.
    Vacuum,
    /// The channel's converter repeats the code that it read last.
    FrozenSense(usize),
    /// The supply of the output stages falls to 4.1 V.
    WeakSupply,
    /// Ten control ticks do not take place, once.
    MissedTicks,
    /// The firmware finds a defect in itself, once.
    Panic,
    /// The processor reads where nothing is, once.
    HardFault,
    /// The firmware stays where it is, once.
    Hang,
    /// The processor is reset, once.
    Reset,
}

/// What was seen since a fault began.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observed {
    /// Ticks in which any channel was driven, by more than the check of the heaters, before all of them were at zero.
    pub driven_ticks: u64,
    /// Whether all channels came to zero after a drive.
    pub came_to_zero: bool,
    /// Hottest temperature anywhere in the mirror since (K above ambient).
    pub hottest_k: f64,
}

/// The fault that is there now, and what was seen of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Faults(Arc<Mutex<Injected>>);

/// A fault, when it begins, and what was seen of it.
#[derive(Debug, Default)]
struct Injected {
    fault: Option<PlantFault>,
    /// Ticks until it begins.
    ticks_left: u32,
    is_new: bool,
    observed: Observed,
}

impl Faults {
    /// From so many ticks on.
    pub(crate) fn begin(&self, fault: Option<PlantFault>, ticks_left: u32) {
        let mut state = self.lock();
        *state = Injected {
            fault,
            ticks_left,
            is_new: true,
            observed: Observed::default(),
        };
    }

    pub(crate) fn observed(&self) -> Observed {
        self.lock().observed
    }

    /// The fault of this tick, and whether it is its first.
    pub(crate) fn of_this_tick(&self) -> (Option<PlantFault>, bool) {
        let mut state = self.lock();
        if let Some(left) = state.ticks_left.checked_sub(1) {
            state.ticks_left = left;
            return (None, false);
        }
        let is_new = std::mem::take(&mut state.is_new);
        (state.fault, is_new)
    }

    /// Notes what a tick drove, and how hot the mirror was.
    pub(crate) fn observe(&self, drive_v: [f64; 4], hottest_k: f64) {
        let mut state = self.lock();
        if state.is_new {
            return;
        }
        let observed = &mut state.observed;
        observed.hottest_k = observed.hottest_k.max(hottest_k);
        if drive_v.iter().any(|drive| *drive > CHECK_V) {
            if !observed.came_to_zero {
                observed.driven_ticks += 1;
            }
        } else if observed.driven_ticks > 0 {
            observed.came_to_zero = true;
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Injected> {
        self.0
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl PlantFault {
    /// What arrives at the heaters of what the output stages drive.
    pub(crate) fn at_the_heaters(self, mut drive_v: [f64; 4], enabled: bool) -> [f64; 4] {
        if let Self::OpenHeater(channel) | Self::ShortCircuit(channel) = self {
            drive_v[channel] = 0.0;
        }
        match self {
            Self::StuckOutput(channel) if enabled => drive_v[channel] = FULL_DUTY_V,
            Self::StuckStage(channel) => drive_v[channel] = STAGE_SUPPLY_V,
            _ => {}
        }
        drive_v
    }

    /// What flows, of what a sound mirror takes.
    pub(crate) fn currents(self, drive_v: [f64; 4], mut current_a: [f64; 4]) -> [f64; 4] {
        match self {
            Self::OpenHeater(channel) => current_a[channel] = 0.0,
            Self::ShortCircuit(channel) => current_a[channel] = drive_v[channel] / SHORT_OHM,
            Self::Bridge(channel, ohm) => current_a[channel] += drive_v[channel] / f64::from(ohm),
            _ => {}
        }
        current_a
    }

    /// The supply, where it is not sound.
    pub(crate) fn supply_v(self) -> Option<f64> {
        (self == Self::WeakSupply).then_some(WEAK_SUPPLY_V)
    }

    /// What the converters say, of what they would say; `is_first` in the fault's first tick.
    pub(crate) fn converters(
        self,
        mut sound: Converters,
        before: &Converters,
        is_first: bool,
    ) -> Converters {
        match self {
            Self::FrozenSense(channel) => sound.current[channel] = before.current[channel],
            Self::MissedTicks if is_first => sound.tick = sound.tick.wrapping_add(SKIPPED_TICKS),
            Self::Panic if is_first => sound.upset = upset::PANIC,
            Self::HardFault if is_first => sound.upset = upset::HARD_FAULT,
            Self::Hang if is_first => sound.upset = upset::HANG,
            Self::Reset if is_first => sound.upset = upset::RESET,
            _ => {}
        }
        sound
    }
}

/// The same mirror in vacuum.
pub(crate) fn in_vacuum(config: &MirrorConfig) -> MirrorConfig {
    let mut config = config.clone();
    for segment in &mut config.segments {
        segment.air_loss_w_m_k *= VACUUM;
    }
    config.plate.air_loss_uw_k *= VACUUM;
    config
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVEN: [f64; 4] = [0.0, 1.0, 0.0, 0.0];

    #[test]
    fn a_fault_begins_after_its_ticks_and_is_first_once() {
        let faults = Faults::default();
        faults.begin(Some(PlantFault::Panic), 2);
        let seen: Vec<_> = (0..4).map(|_| faults.of_this_tick()).collect();
        let fault = Some(PlantFault::Panic);
        assert_eq!(
            seen,
            [(None, false), (None, false), (fault, true), (fault, false)]
        );
    }

    #[test]
    fn driven_ticks_are_counted_until_all_channels_are_at_zero_and_the_hottest_is_kept() {
        let faults = Faults::default();
        faults.begin(Some(PlantFault::WeakSupply), 0);
        faults.observe(DRIVEN, 300.0);
        assert_eq!(faults.observed(), Observed::default(), "it has not begun");
        faults.of_this_tick();
        for (drive_v, hottest_k) in [
            (DRIVEN, 80.0),
            (DRIVEN, 90.0),
            ([0.1; 4], 70.0),
            (DRIVEN, 60.0),
        ] {
            faults.observe(drive_v, hottest_k);
        }
        let expected = Observed {
            driven_ticks: 2,
            came_to_zero: true,
            hottest_k: 90.0,
        };
        assert_eq!(faults.observed(), expected);
    }

    #[test]
    fn a_fault_changes_its_own_channel_only() {
        let drive_v = [1.0, 2.0, 3.0, 3.5];
        let sound_a = drive_v.map(|drive| drive / 500.0);
        for (fault, channel_a) in [
            (PlantFault::OpenHeater(2), 0.0),
            (PlantFault::ShortCircuit(2), 1.0),
            (PlantFault::Bridge(2, 300), 3.0 / 500.0 + 0.01),
        ] {
            let current_a = fault.currents(drive_v, sound_a);
            assert!(
                (current_a[2] - channel_a).abs() < 1e-12,
                "{fault:?}: {current_a:?}"
            );
            for other in [0, 1, 3] {
                assert_eq!(current_a[other], sound_a[other]);
            }
        }
    }
}
