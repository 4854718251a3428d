//! What breaks in the plant, on demand, and how the board takes it.

use std::time::Duration;

use plant_link::{Converters, NO_READING, upset};
use virtual_mirror::MirrorConfig;

/// Part of the heat that the air takes which is left in a poor vacuum: the beams are then cooled by their ends.
const VACUUM: f64 = 0.05;
/// A solder bridge across a channel, with the leads to it (ohm).
const SHORT_OHM: f64 = 3.0;
/// What an output stage makes of a PWM pin that is always high.
const FULL_DUTY_V: f64 = 4.25;
/// What the stages are supplied with.
const STAGE_SUPPLY_V: f64 = 5.0;
/// Supply of a weak port, and of a bench supply set wrongly.
const WEAK_SUPPLY_V: f64 = 4.1;
const STRONG_SUPPLY_V: f64 = 5.8;
/// A supply that is switched off falls by 1 V in 1 ms; the processor is reset at 2.7 V, near the highest brown-out level
/// of the board's chip, 2.8 V.
const FALL_V: f64 = 0.1;
const BROWN_OUT_V: f64 = 2.7;
/// Ticks between the resets of a loop.
const RESET_TICKS: u32 = 400;
/// What a board drives at most to check its heaters, and a rounding more.
const CHECK_V: f64 = 0.301;
/// Ticks that an overrun skips.
const SKIPPED_TICKS: u16 = 10;
/// A patchy sensor: ticks from one lost reading to the next and from one that is off to the next, and by how much (um).
const LOST_TICKS: u32 = 250;
const OFF_TICKS: u32 = 1000;
const OFF_UM: f64 = 40.0;
/// Where the range of a sensor ends (um), and how late a late one is, in ticks.
const CLIPPED_UM: f64 = 100.0;
pub(crate) const LATE_TICKS: usize = 20;
/// How long a busy machine keeps a board waiting: longer than any time-out of the firmware's own, by the wall.
const STALL: Duration = Duration::from_secs(6);

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
    /// The channel's stage stays at so many millivolts, or at its supply where that is less, whatever it is told.
    StuckStage(usize, u16),
    /// The mirror is in vacuum, where heat hardly leaves it.
    Vacuum,
    /// The channel's converter repeats the code that it read last.
    FrozenSense(usize),
    /// The converters repeat what they read last, all of them.
    StoppedConverters,
    /// The channel's sense tells so many percent of its current.
    SenseGain(usize, u16),
    /// The channel's stage drives so many percent of what it is told.
    StageGain(usize, u16),
    /// Nothing comes from the position sensor.
    NoSensor,
    /// The position sensor loses one reading in 250, and one in 1000 is 40 um off: specks on the plate.
    PatchySensor,
    /// The position sensor's range ends at 100 um.
    ClippedSensor,
    /// The position sensor reads where the plate was 2 ms before.
    LateSensor,
    /// The supply of the output stages falls to 4.1 V.
    WeakSupply,
    /// It rises to 5.8 V.
    StrongSupply,
    /// The supply falls to nothing within 5 ms, and comes back.
    BrownOut,
    /// Ten control ticks do not take place, once.
    MissedTicks,
    /// The processor's clock is slow: every second control tick does not take place.
    SlowClock,
    /// The firmware finds a defect in itself, once.
    Panic,
    /// The processor reads where nothing is, once.
    HardFault,
    /// The firmware stays where it is, once.
    Hang,
    /// The processor is reset, once.
    Reset,
    /// It is reset ten times, 40 ms apart.
    ResetLoop,
    /// A busy machine keeps the board waiting for 6 s, once.
    Stall,
    /// What the converters read in one tick is there twice, as a reset between question and answer leaves it.
    StaleAnswer,
}

/// What a fault does to the processor itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Upset {
    /// The firmware finds a defect in itself.
    Panic,
    /// It reads where nothing is.
    HardFault,
    /// It stays where it is.
    Hang,
    /// It is reset.
    Reset,
    /// Its supply falls below what it is reset at.
    BrownOut,
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

/// A fault, when it begins, and what was seen of it.
#[derive(Debug, Default)]
pub(crate) struct Injected {
    fault: Option<PlantFault>,
    /// Ticks until it begins.
    ticks_left: u32,
    /// Its ticks so far.
    age_ticks: u32,
    observed: Observed,
}

impl Injected {
    /// A fault that begins after so many ticks.
    pub(crate) fn after(fault: Option<PlantFault>, ticks_left: u32) -> Self {
        Self {
            fault,
            ticks_left,
            ..Self::default()
        }
    }

    pub(crate) fn observed(&self) -> Observed {
        self.observed
    }

    pub(crate) fn is_quiet(&self) -> bool {
        self.fault.is_none()
    }

    /// The fault of this tick, and for how many ticks it has been there.
    pub(crate) fn of_this_tick(&mut self) -> (Option<PlantFault>, u32) {
        if let Some(left) = self.ticks_left.checked_sub(1) {
            self.ticks_left = left;
            return (None, 0);
        }
        let age_ticks = self.age_ticks;
        self.age_ticks = age_ticks.saturating_add(1);
        (self.fault, age_ticks)
    }

    /// Notes what a tick drove at the outputs, and how hot the mirror was.
    pub(crate) fn observe(&mut self, drive_v: [f64; 4], hottest_k: f64) {
        if self.age_ticks == 0 {
            return;
        }
        let observed = &mut self.observed;
        observed.hottest_k = observed.hottest_k.max(hottest_k);
        if drive_v.iter().any(|drive| *drive > CHECK_V) {
            if !observed.came_to_zero {
                observed.driven_ticks += 1;
            }
        } else if observed.driven_ticks > 0 {
            observed.came_to_zero = true;
        }
    }
}

impl PlantFault {
    /// Resets of a loop.
    pub const RESETS: u32 = 10;
    /// How long the loop lasts (s).
    pub const RESET_LOOP_S: f64 = (Self::RESETS * RESET_TICKS) as f64 * 1e-4;

    /// What arrives at the heaters (V) of what the output stages drive, with the timer's outputs enabled or not, and with
    /// as much supply as they want.
    pub fn at_the_heaters(self, mut drive_v: [f64; 4], enabled: bool) -> [f64; 4] {
        if let Self::OpenHeater(channel) | Self::ShortCircuit(channel) = self {
            drive_v[channel] = 0.0;
        }
        match self {
            Self::StuckOutput(channel) if enabled => drive_v[channel] = FULL_DUTY_V,
            Self::StuckStage(channel, millivolt) => {
                drive_v[channel] = f64::from(millivolt) * 1e-3;
            }
            Self::StageGain(channel, percent) => drive_v[channel] *= f64::from(percent) / 100.0,
            _ => {}
        }
        drive_v
    }

    /// What flows (A) at this drive (V), of what a sound mirror takes.
    pub fn currents(self, drive_v: [f64; 4], mut current_a: [f64; 4]) -> [f64; 4] {
        match self {
            Self::OpenHeater(channel) => current_a[channel] = 0.0,
            Self::ShortCircuit(channel) => current_a[channel] = drive_v[channel] / SHORT_OHM,
            Self::Bridge(channel, ohm) => current_a[channel] += drive_v[channel] / f64::from(ohm),
            Self::SenseGain(channel, percent) => current_a[channel] *= f64::from(percent) / 100.0,
            _ => {}
        }
        current_a
    }

    /// The supply (V) after so many ticks, where it is not sound.
    pub fn supply_v(self, sound_v: f64, age_ticks: u32) -> f64 {
        match self {
            Self::WeakSupply => WEAK_SUPPLY_V,
            Self::StrongSupply => STRONG_SUPPLY_V,
            Self::BrownOut => match sound_v - FALL_V * f64::from(age_ticks) {
                falling_v if falling_v > 0.0 => falling_v,
                _ => sound_v,
            },
            _ => sound_v,
        }
    }

    /// What the converters say, of what they would say, after so many ticks.
    pub(crate) fn converters(
        self,
        mut sound: Converters,
        before: &Converters,
        age_ticks: u32,
    ) -> Converters {
        match self {
            Self::FrozenSense(channel) => sound.current[channel] = before.current[channel],
            Self::StoppedConverters => {
                sound = Converters {
                    tick: sound.tick,
                    missed_ticks: 0,
                    quiet_ticks: 0,
                    is_over_voltage: sound.is_over_voltage,
                    ..*before
                }
            }
            Self::NoSensor | Self::PatchySensor | Self::ClippedSensor => {
                let um = self.sensor_um(f64::from(sound.sensor_z_nm) * 1e-3, age_ticks);
                sound.sensor_z_nm = um.map_or(NO_READING, |um| (um * 1e3).round() as i32);
            }
            Self::MissedTicks | Self::SlowClock => {
                sound.missed_ticks = self.missed_ticks(age_ticks);
            }
            _ => sound.upset = self.upset(age_ticks).map_or(upset::NONE, Upset::code),
        }
        sound
    }

    /// What the position sensor reads (um), of what it would read, after so many ticks.
    pub fn sensor_um(self, sound_um: f64, age_ticks: u32) -> Option<f64> {
        match self {
            Self::NoSensor => None,
            Self::ClippedSensor => Some(sound_um.min(CLIPPED_UM)),
            Self::PatchySensor if age_ticks.is_multiple_of(LOST_TICKS) => None,
            // Between two that are lost.
            Self::PatchySensor if age_ticks % OFF_TICKS == LOST_TICKS / 2 => {
                Some(sound_um + OFF_UM)
            }
            _ => Some(sound_um),
        }
    }

    /// How long the board waits for its converters.
    pub(crate) fn stall(self, age_ticks: u32) -> Duration {
        match self {
            Self::Stall if age_ticks == 0 => STALL,
            _ => Duration::ZERO,
        }
    }

    /// How often it gets what they read.
    pub(crate) fn answers(self, age_ticks: u32) -> usize {
        match self {
            Self::StaleAnswer if age_ticks == 0 => 2,
            _ => 1,
        }
    }

    /// Control ticks that do not take place before this one.
    pub fn missed_ticks(self, age_ticks: u32) -> u16 {
        match self {
            Self::MissedTicks if age_ticks == 0 => SKIPPED_TICKS,
            Self::SlowClock => 1,
            _ => 0,
        }
    }

    /// What happens to the processor itself.
    pub fn upset(self, age_ticks: u32) -> Option<Upset> {
        let is_first = age_ticks == 0;
        let browns_out = (STAGE_SUPPLY_V - BROWN_OUT_V) / FALL_V;
        match self {
            Self::Panic if is_first => Some(Upset::Panic),
            Self::HardFault if is_first => Some(Upset::HardFault),
            Self::Hang if is_first => Some(Upset::Hang),
            Self::Reset if is_first => Some(Upset::Reset),
            Self::BrownOut if age_ticks == browns_out.round() as u32 => Some(Upset::BrownOut),
            Self::ResetLoop
                if age_ticks.is_multiple_of(RESET_TICKS)
                    && age_ticks < Self::RESETS * RESET_TICKS =>
            {
                Some(Upset::Reset)
            }
            _ => None,
        }
    }
}

impl Upset {
    /// As the board in QEMU is told it, whose supply the processor does not share.
    fn code(self) -> u8 {
        match self {
            Self::Panic => upset::PANIC,
            Self::HardFault => upset::HARD_FAULT,
            Self::Hang => upset::HANG,
            Self::Reset | Self::BrownOut => upset::RESET,
        }
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
    fn a_fault_begins_after_its_ticks_and_ages() {
        let mut faults = Injected::after(Some(PlantFault::Panic), 2);
        let seen: Vec<_> = (0..4).map(|_| faults.of_this_tick()).collect();
        let fault = Some(PlantFault::Panic);
        assert_eq!(seen, [(None, 0), (None, 0), (fault, 0), (fault, 1)]);
    }

    #[test]
    fn driven_ticks_are_counted_until_all_channels_are_at_zero_and_the_hottest_is_kept() {
        let mut faults = Injected::after(Some(PlantFault::WeakSupply), 0);
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
