//! Virtual mirrors with nothing hidden, their structure drawn at random from a wide family. This is the only place where
//! the model lab touches the virtual mirror; the model and the virtual mirror know nothing of each other.

use crate::plan::{Channel, Plan};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use virtual_mirror::{Effect, Family, MirrorConfig, Reading, Sensor, VirtualMirror};

/// Families that approximation and thresholds are calibrated on; tests use the others.
pub const CALIBRATING: [Family; 5] = [Family::A, Family::B, Family::C, Family::D, Family::E];
/// Offset of a meter in parts of its highest reading, one standard deviation: some counts of a hand-held one.
const METER_OFFSET: f64 = 5e-4;
/// Draws that give an impossible mirror are drawn again, so many times at most.
const DRAWS: u64 = 20;

/// No thermometer tells better how warm a mirror in an oven is (K, one standard deviation): as a Pt100 of class A.
const THERMOMETER_K: f64 = 0.15;
/// No stage tells better how far it has moved (one standard deviation, a part of the way).
const STAGE_RATIO: f64 = 1e-3;

/// What a virtual mirror of the family shows at a plan's observations: no white noise, but the sensor's wander and the
/// errors of the current channels' gains, of thermometer and stage. The seed's remainder chooses the family.
pub fn observe(plan: &Plan, seed: u64) -> Vec<f64> {
    let (config, mut mirror) = (0..DRAWS)
        .find_map(|draw| {
            let config = draw_mirror(seed + draw * 3_000_000);
            VirtualMirror::new(&config)
                .ok()
                .map(|mirror| (config, mirror))
        })
        .expect("most draws of the family are possible mirrors");
    let mut sensor = Sensor::new(&config);
    let mut around = Around::new(seed);
    let meters = Meters::draw(plan, seed);
    let mut readings: Vec<Option<Reading>> = vec![None; plan.intervals.len()];
    let mut observed = plan.observations.iter().map(|o| o.interval).peekable();
    let (mut now_s, mut read_s) = (0.0, 0.0);
    for (index, interval) in plan.intervals.iter().enumerate() {
        mirror.set_ambient(around.warmer_k(interval.ambient_k));
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
    let zero_um = zero_reading(plan, &readings);
    let values = plan.observations.iter().map(|o| {
        let reading = readings[o.interval].unwrap_or_default();
        match o.channel {
            Channel::Displacement => reading.z_um - zero_um,
            Channel::Current(actuator) => reading.current_a[actuator] + meters.offset_a,
        }
    });
    plan.at_own_zeros(values.collect())
}

/// The surroundings as they are where instruments say what they are.
struct Around {
    rng: ChaCha8Rng,
    told_k: f64,
    warmer_k: f64,
    stage_gain: f64,
}

impl Around {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x0e4e);
        let normal: f64 = StandardNormal.sample(&mut rng);
        Self {
            rng,
            told_k: 0.0,
            warmer_k: 0.0,
            stage_gain: 1.0 + STAGE_RATIO * normal,
        }
    }

    /// Where the temperature is told to have changed, it is off by another error; in the first room by none.
    fn warmer_k(&mut self, told_k: f64) -> f64 {
        if told_k != self.told_k {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            let away = if told_k == 0.0 { 0.0 } else { 1.0 };
            self.warmer_k = told_k + away * THERMOMETER_K * normal;
            self.told_k = told_k;
        }
        self.warmer_k
    }

    fn stage_um(&self, told_um: f64) -> f64 {
        self.stage_gain * told_um
    }
}

/// What the meters at a heater on a bench are off by at 0, in parts of the highest reading. The driver board knows its own
/// zero.
struct Meters {
    offset_v: f64,
    offset_a: f64,
}

impl Meters {
    fn draw(plan: &Plan, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x3e7e_2500);
        let mut off = |highest: f64| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            if plan.is_of_heaters() {
                METER_OFFSET * highest * normal
            } else {
                0.0
            }
        };
        let volts = plan.intervals.iter().flat_map(|interval| interval.to_v);
        let amperes = plan.observations.iter().map(|o| o.value);
        Self {
            offset_v: off(volts.fold(0.0, f64::max)),
            offset_a: off(amperes.fold(0.0, f64::max)),
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
}

/// z is counted from the first 0 V reading, with whatever the sensor's wander was then.
fn zero_reading(plan: &Plan, readings: &[Option<Reading>]) -> f64 {
    plan.zero()
        .and_then(|zero| readings[zero.interval])
        .map_or(0.0, |reading| reading.z_um)
}

/// A mirror of one of the families that thresholds are calibrated on, with more spread than the family has of its own: a
/// user's mirror comes from none of them.
fn draw_mirror(seed: u64) -> MirrorConfig {
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
    config.sensor.position_noise_nm = 0.0;
    config.sensor.current_noise_ua = 0.0;
    config.sensor.current_noise_ratio = 0.0;
    config
}
