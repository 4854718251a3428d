//! Errors of the chain's links, each taken at the measured input of that link.

use super::ladder::STEADY_S;
use super::reading::rms;
use crate::dataset::{Channel, Dataset};
use mirror_model::{ACTUATORS, Model, PistonModel};
use serde::Serialize;

/// Drives that heat next to nothing show the cold resistance (V): 0.6 mW in 360 ohm, 3 K, 1 % of resistance.
const COLD_V: f64 = 0.45;
/// A current of so many times its noise tells a resistance to 5 %, and one of so many what heat makes of it, to 0.2 %.
const TELLS: f64 = 20.0;
const TELLS_HEAT: f64 = 500.0;
/// A course of the resistance over temperature that is smaller is no trend (%).
const TREND_PERCENT: f64 = 0.1;

/// Steady errors by stage, where currents were measured.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StageErrors {
    /// Shape: z measured less z modelled at the measured resistance, root mean square.
    pub z_at_equal_r_um: Option<f64>,
    /// Heat: the resistance measured against that modelled at the measured power, root mean square in percent.
    pub r_at_equal_p_percent: Option<f64>,
    /// What the error of the resistance at equal power makes of z, root mean square.
    pub heat_um: Option<f64>,
    /// Resistance: the resistance at low drives against the model's, mean in percent.
    pub r_at_low_v_percent: Option<f64>,
    /// The resistance at equal power against the model's (%) where it is coldest, between, and hottest (K of warming); empty
    /// where it is the same everywhere.
    pub heat_course: Vec<(f64, f64)>,
    /// What the errors of heat and shape are the root mean squares of, in the order of time. Not for `--json`.
    #[serde(skip)]
    pub points: Vec<StagePoint>,
}

/// The errors of heat and of shape at one steady drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StagePoint {
    /// Modelled warming (K).
    pub warming_k: f64,
    /// Heat: the resistance measured against that modelled at the measured power (%).
    pub r_at_equal_p_percent: f64,
    /// Shape: z measured less z modelled at the measured resistance (um), where z was measured.
    pub z_at_equal_r_um: Option<f64>,
}

/// One steady instant with all actuators at one drive, means over the actuators whose currents were measured.
struct SteadyPoint {
    voltage: f64,
    /// Measured and modelled.
    ohm: [f64; 2],
    z_um: Option<[f64; 2]>,
    /// Measured, in its own noise.
    current_in_noise: f64,
}

pub(super) fn stages(model: &Model, data: &Dataset, predicted: &[f64]) -> StageErrors {
    let piston = PistonModel {
        parameters: model.parameters,
    };
    let p = &piston.parameters;
    let ohm_per_kelvin = p.cold_resistance_ohm * p.resistance_coefficient_per_k;
    let kelvin = |point: &SteadyPoint| {
        (point.ohm[1] / p.cold_resistance_ohm - 1.0) / p.resistance_coefficient_per_k
    };
    let um_per_kelvin = |point: &SteadyPoint| {
        piston.displacement_um(kelvin(point) + 0.5) - piston.displacement_um(kelvin(point) - 0.5)
    };
    let (mut stage_points, mut heat_um, mut cold) = (Vec::new(), Vec::new(), Vec::new());
    for point in points(data, predicted) {
        let [measured, modelled] = point.ohm;
        let (off, of_power) = (
            measured - modelled,
            point.voltage.powi(2) * (1.0 / measured - 1.0 / modelled),
        );
        // The drive is the same; what is off in power moves the model's temperature, too.
        let at_equal_power = off - ohm_per_kelvin * p.thermal_resistance_k_per_w * of_power;
        let percent = 100.0 * at_equal_power / modelled;
        if point.voltage < COLD_V {
            cold.push(100.0 * off / modelled);
        }
        if point.current_in_noise < TELLS_HEAT {
            continue;
        }
        heat_um.push(um_per_kelvin(&point) * at_equal_power / ohm_per_kelvin);
        let off_um = um_per_kelvin(&point) * off / ohm_per_kelvin;
        stage_points.push(StagePoint {
            warming_k: kelvin(&point),
            r_at_equal_p_percent: percent,
            z_at_equal_r_um: point.z_um.map(|[z, of_model]| z - of_model - off_um),
        });
    }
    let of = |values: &[f64]| (!values.is_empty()).then(|| rms(values.iter().copied()));
    let points = stage_points.iter();
    let shape: Vec<f64> = points.clone().filter_map(|p| p.z_at_equal_r_um).collect();
    let heat = points.map(|p| (p.warming_k, p.r_at_equal_p_percent));
    let (heat_course, percents): (Vec<_>, Vec<_>) = heat.map(|heat| (heat, heat.1)).unzip();
    StageErrors {
        z_at_equal_r_um: of(&shape),
        r_at_equal_p_percent: of(&percents),
        heat_um: of(&heat_um),
        r_at_low_v_percent: (!cold.is_empty())
            .then(|| cold.iter().sum::<f64>() / cold.len() as f64),
        heat_course: thirds(&heat_course),
        points: stage_points,
    }
}

/// Means over the thirds of a range, or nothing where they are alike.
fn thirds(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let top = points.iter().map(|p| p.0).fold(0.0, f64::max);
    let mean = |third: usize| {
        let inside: Vec<_> = points
            .iter()
            .filter(|p| (3.0 * p.0 / top).floor().clamp(0.0, 2.0) as usize == third)
            .collect();
        let count = inside.len() as f64;
        let sum = |of: fn(&(f64, f64)) -> f64| inside.iter().map(|p| of(p)).sum::<f64>() / count;
        (count > 0.0).then(|| (sum(|p| p.0), sum(|p| p.1)))
    };
    let means: Vec<_> = (0..3).filter_map(mean).collect();
    let (low, high) = means
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), m| {
            (a.min(m.1), b.max(m.1))
        });
    if high - low > TREND_PERCENT {
        means
    } else {
        Vec::new()
    }
}

fn points(data: &Dataset, predicted: &[f64]) -> Vec<SteadyPoint> {
    let mut points: Vec<SteadyPoint> = Vec::new();
    let seen: Vec<_> = data.observations.iter().zip(predicted).collect();
    for row in seen.chunk_by(|a, b| a.0.interval == b.0.interval) {
        let interval = &data.intervals[row[0].0.interval];
        let voltage = interval.to_v[0];
        let alike = interval.from_v == interval.to_v && interval.to_v == [voltage; ACTUATORS];
        if !alike || interval.duration_s < STEADY_S || voltage <= 0.0 {
            continue;
        }
        let currents: Vec<_> = row
            .iter()
            .filter(|(o, p)| {
                o.channel != Channel::Displacement && o.value > TELLS * o.noise && **p > 0.0
            })
            .collect();
        if currents.is_empty() {
            continue;
        }
        let in_noise = currents.iter().map(|(o, _)| o.value / o.noise);
        let mean = |of: &dyn Fn(f64, f64) -> f64| {
            currents
                .iter()
                .map(|(o, p)| voltage / of(o.value, **p))
                .sum::<f64>()
                / currents.len() as f64
        };
        points.push(SteadyPoint {
            voltage,
            current_in_noise: in_noise.fold(f64::INFINITY, f64::min),
            ohm: [mean(&|measured, _| measured), mean(&|_, modelled| modelled)],
            z_um: row
                .iter()
                .find(|(o, _)| o.channel == Channel::Displacement)
                .map(|(o, p)| [o.value, **p]),
        });
    }
    points
}

impl StageErrors {
    /// What a person would say of the stages.
    pub(super) fn sentences(&self) -> Vec<String> {
        let mut sentences = Vec::new();
        let mut parts = Vec::new();
        if let Some(cold) = self.r_at_low_v_percent {
            parts.push(format!(
                "the resistance at low drives is off by {cold:+.2} %"
            ));
        }
        if let Some(percent) = self.r_at_equal_p_percent {
            parts.push(match (self.heat_um, self.z_at_equal_r_um) {
                (Some(um), Some(_)) => {
                    format!("at equal power by {percent:.2} % rms (heat; worth {um:.2} um of z)")
                }
                _ => format!("at equal power by {percent:.2} % rms (heat)"),
            });
        }
        if let Some(z) = self.z_at_equal_r_um {
            parts.push(format!(
                "z at equal resistance by {z:.2} um rms (curvature, shape, memory or sensor)"
            ));
        }
        if !parts.is_empty() {
            sentences.push(format!("by stage: {}", parts.join(", ")));
        }
        sentences.extend(self.heat_trend());
        sentences
    }

    /// What the resistance at equal power does between cold and hot.
    fn heat_trend(&self) -> Option<String> {
        let course = self.heat_course.iter();
        let values: Vec<_> = course
            .map(|(kelvin, percent)| format!("{percent:+.2} % at {kelvin:.0} K"))
            .collect();
        (!values.is_empty()).then(|| {
            format!(
                "the resistance at equal power is off by {} of warming",
                values.join(", ")
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_is_the_means_over_thirds_of_the_range_where_they_differ() {
        let points: Vec<(f64, f64)> = (0..9).map(|k| (f64::from(k), f64::from(k / 3))).collect();
        // Up to 8 K: thirds end below 2.67 K and 5.33 K.
        assert_eq!(thirds(&points), [(1.0, 0.0), (4.0, 1.0), (7.0, 2.0)]);
        assert!(thirds(&[(1.0, 0.5), (5.0, 0.55)]).is_empty());
    }
}
