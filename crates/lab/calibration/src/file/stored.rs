//! A calibration as its file holds it: quantities by their names in TOML, lists as long as they are used.

use std::ops::RangeInclusive;

use control_core::calibration::{
    Bounds, FAST_POLES, Heat, Label, Lag, Lever, Memory, Origin, Parts, Path, Plate, Play,
    Residual, Resonance, SENSED_RISES, SensedRises,
};
use control_core::shape::KNOTS;
use control_core::{
    ActuatorCalibration, CHANNELS, Calibration, CalibrationError, Hertz, InverseTable, Kelvin,
    KelvinPerWatt, Micrometre, Ohm, PerKelvin, Second, SecondPerKelvin, Volt, Watt,
};
use serde::{Deserialize, Serialize};

/// How long levers are (um). MEMS mirrors are millimetres wide, the paper's half a millimetre: the ends are far from any, and keep out levers
/// in metres, millimetres and nanometres.
const LEVERS_UM: RangeInclusive<f32> = 1.0..=1e5;

/// The version of the format that this crate reads and writes.
const FORMAT: u32 = 1;

/// A calibration as its file holds it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stored {
    format: u32,
    device: String,
    date: String,
    model_hash: String,
    move_time_s: f64,
    #[serde(default)]
    beam_lag_s: f64,
    #[serde(default)]
    time_growth_s_per_k: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    resonance: Option<StoredResonance>,
    max_drive_v: f64,
    max_power_w: f64,
    max_rise_k: f64,
    fast_poles: Vec<StoredPole>,
    #[serde(default)]
    slow_poles: Vec<StoredPole>,
    #[serde(default)]
    plays: Vec<StoredPlay>,
    #[serde(default)]
    release_s: f64,
    #[serde(default)]
    creep: Vec<StoredLag>,
    #[serde(default)]
    levers: Vec<StoredLever>,
    #[serde(default)]
    ambient_ratio: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    sensed_crosstalk: f64,
    #[serde(default)]
    residual: Option<StoredResidual>,
    actuators: Vec<StoredActuator>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredResonance {
    frequency_hz: f64,
    quality: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredLag {
    weight: f64,
    time_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredPole {
    weight: f64,
    time_s: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    shared: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredPlay {
    weight: f64,
    radius_um: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredLever {
    x_um: f64,
    y_um: f64,
    warp: f64,
}

/// What the calibration leaves unknown, as standard uncertainties.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredResidual {
    piston_um: f64,
    /// Files of before do not say how far they were tried.
    #[serde(default)]
    tried_um: Option<f64>,
    part: f64,
    apart: f64,
    ambient_ratio: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredActuator {
    cold_resistance_ohm: f64,
    tcr_per_k: f64,
    thermal_resistance_k_per_w: f64,
    loss_growth_per_k: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    slower_by_s: f64,
    top_um: f64,
    temperature_rise_k: Vec<f64>,
    #[serde(default)]
    sensed_top_k: f64,
    #[serde(default)]
    sensed_rise_k: Vec<f64>,
}

impl From<&Calibration> for Stored {
    fn from(calibration: &Calibration) -> Self {
        let p = calibration.parts();
        // Without weight, too, where it is followed.
        let lags = |lags: &[Lag]| -> Vec<StoredLag> {
            let followed = lags.iter().filter(|lag| **lag != Memory::NONE.creep[0]);
            followed
                .map(|lag| StoredLag {
                    weight: decimal(lag.weight),
                    time_s: decimal(lag.time.0),
                })
                .collect()
        };
        let poles = |lags: &[Lag], shared: &[f32]| -> Vec<StoredPole> {
            let used = lags.iter().zip(shared).filter(|(lag, _)| lag.weight != 0.0);
            used.map(|(lag, shared)| StoredPole {
                weight: decimal(lag.weight),
                time_s: decimal(lag.time.0),
                shared: decimal(*shared),
            })
            .collect()
        };
        let plays = p.memory.plays.iter().filter(|play| play.radius.0 > 0.0);
        Self {
            format: FORMAT,
            device: p.origin.device.as_str().to_owned(),
            date: p.origin.date.as_str().to_owned(),
            model_hash: format!("{:016x}", p.origin.model_hash),
            move_time_s: decimal(p.path.move_time.0),
            beam_lag_s: decimal(p.heat.beam_lag.0),
            time_growth_s_per_k: decimal(p.heat.time_growth.0),
            resonance: p.path.resonance.is_known().then(|| StoredResonance {
                frequency_hz: decimal(p.path.resonance.frequency.0),
                quality: decimal(p.path.resonance.quality),
            }),
            max_drive_v: decimal(p.bounds.drive.0),
            max_power_w: decimal(p.bounds.power.0),
            max_rise_k: decimal(p.bounds.rise.0),
            fast_poles: poles(&p.heat.fast, &p.heat.shared[..FAST_POLES]),
            slow_poles: poles(&p.heat.slow, &p.heat.shared[FAST_POLES..]),
            plays: plays
                .map(|play| StoredPlay {
                    weight: decimal(play.weight),
                    radius_um: decimal(play.radius.0),
                })
                .collect(),
            release_s: decimal(p.memory.release.0),
            creep: lags(&p.memory.creep),
            levers: match p.plate.is_known() {
                true => p.plate.levers.iter().map(StoredLever::from).collect(),
                false => Vec::new(),
            },
            ambient_ratio: decimal(p.ambient_ratio),
            sensed_crosstalk: decimal(p.sensed_crosstalk),
            residual: p
                .residual
                .is_known()
                .then(|| StoredResidual::from(&p.residual)),
            actuators: p.actuators.iter().map(StoredActuator::from).collect(),
        }
    }
}

impl From<&Lever> for StoredLever {
    fn from(lever: &Lever) -> Self {
        Self {
            x_um: decimal(lever.x.0),
            y_um: decimal(lever.y.0),
            warp: decimal(lever.warp),
        }
    }
}

impl From<&Residual> for StoredResidual {
    fn from(residual: &Residual) -> Self {
        Self {
            piston_um: decimal(residual.piston.0),
            tried_um: Some(decimal(residual.tried.0)),
            part: decimal(residual.part),
            apart: decimal(residual.apart),
            ambient_ratio: decimal(residual.ambient_ratio),
        }
    }
}

impl StoredResidual {
    /// That of a range up to `top`.
    fn read(&self, top: Micrometre) -> Residual {
        let residual = Residual {
            piston: Micrometre(self.piston_um as f32),
            tried: Micrometre(0.0),
            part: self.part as f32,
            apart: self.apart as f32,
            ambient_ratio: self.ambient_ratio as f32,
        };
        Residual {
            tried: match self.tried_um {
                Some(um) => Micrometre(um as f32),
                None => residual.tried_wholly_or_not(top),
            },
            ..residual
        }
    }
}

impl From<&ActuatorCalibration> for StoredActuator {
    fn from(actuator: &ActuatorCalibration) -> Self {
        Self {
            cold_resistance_ohm: decimal(actuator.cold_resistance.0),
            tcr_per_k: decimal(actuator.tcr.0),
            thermal_resistance_k_per_w: decimal(actuator.thermal_resistance.0),
            loss_growth_per_k: decimal(actuator.loss_growth.0),
            slower_by_s: decimal(actuator.slower_by.0),
            top_um: decimal(actuator.shape.top().0),
            temperature_rise_k: actuator.shape.knots().map(decimal).to_vec(),
            sensed_top_k: decimal(actuator.sensed_rises.top.0),
            sensed_rise_k: match actuator.sensed_rises.is_known() {
                true => actuator.sensed_rises.knots.map(decimal).to_vec(),
                false => Vec::new(),
            },
        }
    }
}

impl Stored {
    /// The calibration, or which value it cannot have.
    pub(super) fn read(&self) -> Result<Calibration, String> {
        if self.format != FORMAT {
            return Err(format!("it is of format {}, not {FORMAT}", self.format));
        }
        let label = |what: &str, text: &str| {
            let max = Label::CAPACITY;
            Label::new(text).ok_or_else(|| format!("{what} is longer than {max} bytes, or holds a line break or another control character"))
        };
        let [Ok(a), Ok(b), Ok(c), Ok(d)] = std::array::from_fn(|i| self.actuator(i)) else {
            let first = (0..4).find_map(|i| self.actuator(i).err());
            return Err(first.unwrap_or_default());
        };
        if self.actuators.len() != 4 {
            return Err(format!("it has {} actuators, not 4", self.actuators.len()));
        }
        let mut heat = Heat {
            beam_lag: Second(self.beam_lag_s as f32),
            time_growth: SecondPerKelvin(self.time_growth_s_per_k as f32),
            ..Heat::INSTANT
        };
        heat.fast[0].weight = 0.0;
        fill(
            "fast_poles",
            &mut heat.fast,
            &self.fast_poles,
            StoredPole::read,
        )?;
        fill(
            "slow_poles",
            &mut heat.slow,
            &self.slow_poles,
            StoredPole::read,
        )?;
        let (fast, slow) = heat.shared.split_at_mut(FAST_POLES);
        for (parts, stored) in [(fast, &self.fast_poles), (slow, &self.slow_poles)] {
            for (part, pole) in parts.iter_mut().zip(stored) {
                *part = pole.shared as f32;
            }
        }
        let mut memory = Memory::NONE;
        fill("plays", &mut memory.plays, &self.plays, StoredPlay::read)?;
        let widest = self.plays.last().map_or(0.0, |play| play.radius_um);
        for unused in &mut memory.plays[self.plays.len()..] {
            unused.radius = Micrometre(widest as f32);
        }
        memory.release = Second(self.release_s as f32);
        fill("creep", &mut memory.creep, &self.creep, StoredLag::read)?;
        let parts = Parts {
            origin: Origin {
                device: label("device", &self.device)?,
                date: label("date", &self.date)?,
                model_hash: u64::from_str_radix(&self.model_hash, 16)
                    .map_err(|_| "model_hash is not a hexadecimal number".to_owned())?,
            },
            actuators: [a, b, c, d],
            heat,
            memory,
            plate: self.plate()?,
            path: Path {
                move_time: Second(self.move_time_s as f32),
                resonance: match &self.resonance {
                    Some(stored) => Resonance {
                        frequency: Hertz(stored.frequency_hz as f32),
                        quality: stored.quality as f32,
                    },
                    None => Resonance::UNKNOWN,
                },
            },
            bounds: Bounds {
                drive: Volt(self.max_drive_v as f32),
                power: Watt(self.max_power_w as f32),
                rise: Kelvin(self.max_rise_k as f32),
            },
            ambient_ratio: self.ambient_ratio as f32,
            sensed_crosstalk: self.sensed_crosstalk as f32,
            residual: match &self.residual {
                Some(residual) => residual.read(a.shape.top()),
                None => Residual::UNKNOWN,
            },
        };
        Calibration::new(parts).map_err(|error| error.to_string())
    }

    fn plate(&self) -> Result<Plate, String> {
        let levers: Vec<Lever> = self.levers.iter().map(StoredLever::read).collect();
        match <[Lever; CHANNELS]>::try_from(levers) {
            Ok(levers) => match levers.iter().position(|lever| !is_a_lever(lever)) {
                None => Ok(Plate { levers }),
                Some(index) => Err(format!(
                    "levers[{index}] is {:e} um long, and an actuator acts {} to {} um from the plate's centre; x_um and y_um are in micrometres",
                    length_um(&levers[index]),
                    LEVERS_UM.start(),
                    LEVERS_UM.end()
                )),
            },
            Err(none) if none.is_empty() => Ok(Plate::UNKNOWN),
            Err(some) => Err(format!("it has {} levers, not {CHANNELS}", some.len())),
        }
    }

    fn actuator(&self, index: usize) -> Result<ActuatorCalibration, String> {
        let actuator = self.actuators.get(index);
        let actuator = actuator.ok_or_else(|| format!("it has {index} actuators, not 4"))?;
        let of = |what: String| format!("{what} of actuator {}", index + 1);
        let knots: Vec<f32> = actuator
            .temperature_rise_k
            .iter()
            .map(|&k| k as f32)
            .collect();
        let knots = <[f32; KNOTS]>::try_from(knots).map_err(|knots| {
            of(format!(
                "{} values, not {KNOTS}, in temperature_rise_k",
                knots.len()
            ))
        })?;
        let sensed: Vec<f32> = actuator.sensed_rise_k.iter().map(|&k| k as f32).collect();
        let sensed_rises = match sensed.is_empty() {
            true => SensedRises::UNKNOWN,
            false => SensedRises {
                top: Kelvin(actuator.sensed_top_k as f32),
                knots: <[f32; SENSED_RISES]>::try_from(sensed).map_err(|sensed| {
                    of(format!(
                        "{} values, not {SENSED_RISES}, in sensed_rise_k",
                        sensed.len()
                    ))
                })?,
            },
        };
        let shape = InverseTable::new(Micrometre(actuator.top_um as f32), knots)
            .map_err(|error| CalibrationError::from(error).of_actuator(index).to_string())?;
        Ok(ActuatorCalibration {
            cold_resistance: Ohm(actuator.cold_resistance_ohm as f32),
            tcr: PerKelvin(actuator.tcr_per_k as f32),
            thermal_resistance: KelvinPerWatt(actuator.thermal_resistance_k_per_w as f32),
            loss_growth: PerKelvin(actuator.loss_growth_per_k as f32),
            slower_by: Second(actuator.slower_by_s as f32),
            shape,
            sensed_rises,
        })
    }
}

impl StoredLag {
    fn read(&self) -> Lag {
        Lag {
            weight: self.weight as f32,
            time: Second(self.time_s as f32),
        }
    }
}

impl StoredPole {
    fn read(&self) -> Lag {
        Lag {
            weight: self.weight as f32,
            time: Second(self.time_s as f32),
        }
    }
}

fn length_um(lever: &Lever) -> f32 {
    lever.x.0.hypot(lever.y.0)
}

/// Not so for NaN. Levers that are all nothing are none ([`Plate::UNKNOWN`]).
fn is_a_lever(lever: &Lever) -> bool {
    LEVERS_UM.contains(&length_um(lever))
}

impl StoredLever {
    fn read(&self) -> Lever {
        Lever {
            x: Micrometre(self.x_um as f32),
            y: Micrometre(self.y_um as f32),
            warp: self.warp as f32,
        }
    }
}

impl StoredPlay {
    fn read(&self) -> Play {
        Play {
            weight: self.weight as f32,
            radius: Micrometre(self.radius_um as f32),
        }
    }
}

/// The first places of a list that may be shorter.
fn fill<T, S>(what: &str, places: &mut [T], list: &[S], read: fn(&S) -> T) -> Result<(), String> {
    if list.len() > places.len() {
        return Err(format!(
            "{} {what} are more than {}",
            list.len(),
            places.len()
        ));
    }
    for (place, stored) in places.iter_mut().zip(list) {
        *place = read(stored);
    }
    Ok(())
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

/// `value` as a person would write it: 0.1 and not 0.100000001.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}
