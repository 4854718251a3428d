//! The null ensemble's mirrors: virtual mirrors that lack no effect, their structure as far as it is known, and otherwise drawn at
//! random from wide families. This module alone of the lab knows the virtual mirror; model and virtual mirror know nothing of
//! each other.

mod described;
mod shape;
pub(super) mod stated;

use identification::dataset::{Channel, Dataset};
use mirror_model::Device;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use virtual_mirror::{Effect, Family, MirrorConfig, MotionConfig, Reading, Sensor, VirtualMirror};

/// Families that discrepancy and thresholds are calibrated on; tests and benches use the others.
pub const CALIBRATING: [Family; 5] = [Family::A, Family::B, Family::C, Family::D, Family::E];
/// Offset of a meter in parts of its highest reading, one standard deviation: 3 counts of a hand-held one of 6000.
const METER_OFFSET: f64 = 5e-4;
/// Draws that give an impossible mirror are drawn again, so many times at most.
const DRAWS: u64 = 20;

/// A mass on four springs between these frequencies moves as if it followed at once (Hz): above what the effect `resonance` may have, and up to
/// where a lag of some microseconds shows in nothing.
const PLATE_HZ: (f64, f64) = (3e3, 3e4);
/// Quality factor of a plate that does not ring: the flattest response, 1/sqrt(2).
const DAMPED_Q: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// No thermometer tells better how warm a mirror in an oven is (K, one standard deviation): a Pt100 of class A at 0 degC,
/// IEC 60751.
const THERMOMETER_K: f64 = 0.15;
/// No stage tells better how far it has moved (one standard deviation, a part of the way): the lead error of a ground
/// micrometer screw, some 0.1 um in 100 um.
const STAGE_RATIO: f64 = 1e-3;

/// What a virtual mirror shows at a dataset's observations (um, A): no white noise, but the sensor's wander and the errors of
/// the current channels' gains, of thermometer and stage. The seed's remainder chooses the family.
pub(super) fn observe(data: &Dataset, device: &Device, seed: u64) -> Vec<f64> {
    let (config, mirror) = member(device, seed);
    observe_with(data, mirror, Sensor::new(&config), seed)
}

/// The same of this mirror by this sensor.
pub(super) fn observe_with(
    data: &Dataset,
    mut mirror: VirtualMirror,
    mut sensor: Sensor,
    seed: u64,
) -> Vec<f64> {
    let mut around = Surroundings::new(seed);
    let meters = Meters::draw(data, seed);
    let mut readings: Vec<Option<Reading>> = vec![None; data.intervals.len()];
    let mut observed = data.observations.iter().map(|o| o.interval).peekable();
    let (mut now_s, mut read_s) = (0.0, 0.0);
    for (index, interval) in data.intervals.iter().enumerate() {
        mirror.set_ambient(around.rise_k(interval.ambient_k));
        mirror.set_stage(around.stage_um(interval.reference_um));
        let drive = interval.to_v.map(|volts| meters.drive(volts));
        if interval.from_v == interval.to_v {
            mirror.advance(drive, interval.duration_s);
        } else {
            mirror.advance_ramp(drive, interval.duration_s);
        }
        now_s += interval.duration_s;
        if observed.peek() == Some(&index) {
            while observed.next_if_eq(&index).is_some() {}
            readings[index] = Some(sensor.read(&mirror.state(), now_s - read_s));
            read_s = now_s;
        }
    }
    let zero_um = zero_reading(data, &readings);
    let values = data.observations.iter().map(|o| {
        let reading = readings[o.interval].unwrap_or_default();
        match o.channel {
            Channel::Displacement => reading.z_um - zero_um,
            Channel::Current(actuator) => reading.current_a[actuator],
        }
    });
    data.at_own_zeros(meters.read(values.collect()))
}

/// A mirror of the ensemble.
pub(super) fn member(device: &Device, seed: u64) -> (MirrorConfig, VirtualMirror) {
    let drawn = (0..DRAWS).find_map(|draw| {
        let config = draw_mirror(seed + draw * 3_000_000, device);
        let mirror = VirtualMirror::new(&config).ok()?;
        Some((config, mirror))
    });
    drawn.expect("most draws of the family are possible mirrors")
}

/// The surroundings as they are where thermometer and stage say what they are.
struct Surroundings {
    rng: ChaCha8Rng,
    told_k: f64,
    rise_k: f64,
    stage_gain: f64,
}

impl Surroundings {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x0e4e);
        let normal: f64 = StandardNormal.sample(&mut rng);
        Self {
            rng,
            told_k: 0.0,
            rise_k: 0.0,
            stage_gain: 1.0 + STAGE_RATIO * normal,
        }
    }

    /// Where the temperature is told to have changed, it is off by another error; in the first room by none.
    fn rise_k(&mut self, told_k: f64) -> f64 {
        if told_k != self.told_k {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            let away = if told_k == 0.0 { 0.0 } else { 1.0 };
            self.rise_k = told_k + away * THERMOMETER_K * normal;
            self.told_k = told_k;
        }
        self.rise_k
    }

    fn stage_um(&self, told_um: f64) -> f64 {
        self.stage_gain * told_um
    }
}

/// What the meters at a heater on a bench are off by at 0, in parts of the highest reading. The driver board knows its own
/// zero.
struct Meters {
    offset_v: f64,
    current_ratio: f64,
}

impl Meters {
    fn draw(data: &Dataset, seed: u64) -> Self {
        if !data.is_of_heaters() {
            return Self {
                offset_v: 0.0,
                current_ratio: 0.0,
            };
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x3e7e_2500);
        let mut ratio = || {
            let normal: f64 = StandardNormal.sample(&mut rng);
            METER_OFFSET * normal
        };
        let volts = data.intervals.iter().flat_map(|interval| interval.to_v);
        Self {
            offset_v: ratio() * volts.fold(0.0, f64::max),
            current_ratio: ratio(),
        }
    }

    /// The drive that reads as this.
    fn drive(&self, volts: f64) -> f64 {
        if volts > 0.0 {
            (volts + self.offset_v).max(0.0)
        } else {
            volts
        }
    }

    /// What they show of a session's currents.
    fn read(&self, mut currents_a: Vec<f64>) -> Vec<f64> {
        if self.current_ratio != 0.0 {
            let offset_a = self.current_ratio * currents_a.iter().copied().fold(0.0, f64::max);
            currents_a
                .iter_mut()
                .for_each(|current| *current += offset_a);
        }
        currents_a
    }
}

/// z is counted from the first 0 V reading, with whatever the sensor's wander was then.
fn zero_reading(data: &Dataset, readings: &[Option<Reading>]) -> f64 {
    data.zero()
        .and_then(|zero| readings[zero.interval])
        .map_or(0.0, |reading| reading.z_um)
}

/// A mirror of one of the families that thresholds are calibrated on, with more spread than the family has of its own: a
/// user's mirror comes from none of them. The spreads are standard deviations of logarithms; they were widened until mirrors
/// of families that were left out lay inside what the ensemble spans (`docs/figures/diagnosis.md`).
fn draw_mirror(seed: u64, device: &Device) -> MirrorConfig {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut config = MirrorConfig::draw(
        CALIBRATING[(seed % CALIBRATING.len() as u64) as usize],
        seed,
    );
    let mut factor = |spread: f64| {
        let normal: f64 = StandardNormal.sample(&mut rng);
        (spread * normal.clamp(-2.5, 2.5)).exp()
    };
    config.plate.air_loss_uw_k *= factor(0.4);
    // How long the plate takes to follow decides what of its warming looks like the chip's.
    config.plate.silicon_um *= factor(0.9);
    // How well the isolation isolates decides how uneven the heat is, and with it how straight R(P).
    let (air, uneven, isolation) = (factor(0.3), factor(0.2), factor(0.8));
    // One actuator is several beams side by side: their heat capacity, and with it all times, vary more than their losses.
    let beams = (2.0 * factor(1.0)).clamp(0.7, 10.0);
    for segment in &mut config.segments {
        segment.air_loss_w_m_k *= if segment.turned { air * uneven } else { air };
        segment.length_um *= if segment.heated { 1.0 } else { isolation };
        segment.width_um *= if segment.heated { beams } else { 1.0 };
    }
    config.shape.clamp = (config.shape.clamp + rng.random_range(-0.2..0.2)).clamp(0.0, 0.95);
    // Released beams stand up from the substrate, the paper's by 220 um: no missing physics, but a bent curve.
    config.shape.rest_height_um = rng.random_range(0.0..300.0);
    // No heater is without leads and contacts, 1 to 20 ohm of them, nor without cold ends, which look the same and are more.
    config
        .effects
        .set(Effect::SeriesResistance, rng.random_range(0.0..4.5));
    config.motion = Some(plate_at_once(
        PLATE_HZ.0 * (PLATE_HZ.1 / PLATE_HZ.0).powf(rng.random()),
    ));
    shape::draw(&mut config, &mut rng);
    config.sensor.position_noise_nm = 0.0;
    config.sensor.current_noise_ua = 0.0;
    config.sensor.current_noise_ratio = 0.0;
    described::state(&mut config, device, seed);
    config
}

/// No plate follows at once: one that the air below it damps until it does not ring is late by the time in which it would turn by a radian or
/// so, 4 to 40 us.
fn plate_at_once(piston_hz: f64) -> MotionConfig {
    MotionConfig {
        piston_hz,
        tilt_hz: 1.3 * piston_hz,
        q: DAMPED_Q,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(channels: &[Channel]) -> Dataset {
        let channels: Vec<_> = channels.iter().map(|&channel| (channel, 1e-3)).collect();
        Dataset::driven([(0.0, 1.0), (3.0, 1.0)]).read_at_each(&channels)
    }

    #[test]
    fn a_mirror_moves_from_its_first_reading_at_rest() {
        let data = data(&[Channel::Displacement, Channel::Current(0)]);
        for seed in 0..CALIBRATING.len() as u64 {
            let seen = observe(&data, &Device::default(), seed);
            let [rest_um, rest_a, driven_um, driven_a] = seen[..] else {
                panic!("four observations");
            };
            assert_eq!(rest_um, 0.0);
            assert_eq!(rest_a, 0.0);
            assert!(driven_um > 1.0 && driven_a > 1e-3, "{driven_um} {driven_a}");
        }
    }

    #[test]
    fn a_seed_has_one_mirror_and_two_seeds_have_two() {
        let data = data(&[Channel::Displacement]);
        let observe = |seed| observe(&data, &Device::default(), seed);
        assert_eq!(observe(7), observe(7));
        assert_ne!(observe(7), observe(12));
    }

    #[test]
    fn a_meter_is_off_by_a_part_of_its_highest_reading() {
        let meters = Meters {
            offset_v: 0.01,
            current_ratio: -0.001,
        };
        assert_eq!(meters.read(vec![0.0, 2.0]), [-0.002, 1.998]);
        assert_eq!([0.0, 1.0].map(|volts| meters.drive(volts)), [0.0, 1.01]);
    }
}
