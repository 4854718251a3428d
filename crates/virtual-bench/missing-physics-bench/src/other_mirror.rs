//! A mirror by another author: fins in a chain of cells, integrated by the classical Runge-Kutta method, with laws at every stage,
//! most of which no list of effects has. It shares nothing with the virtual mirror or the model but the experiments that are driven.

use experiments::Experiment;
use identification::Dataset;
use mirror_model::effect::Stage;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt;
use virtual_mirror::MirrorConfig;
use virtual_sessions::{Instruments, measure};

const ACTUATORS: usize = 4;
/// Cells of a beam, from the substrate to the plate.
const CELLS: usize = 5;
/// Longest step (s): the fastest mode of a beam's chain decays with 1e4 /s, where Runge-Kutta's method is stable up to 2.8e-4 s.
const STEP_S: f64 = 2e-4;

/// What this mirror may do; each says its law where it acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Law {
    /// The drivers' common supply has a resistance.
    SupplySag,
    /// The heater's insulation leaks, by an activated law.
    Leakage,
    /// Where the beam is hot, the air's loss rises by a smooth step: it begins to flow.
    FlowOnset,
    /// The solid's conduction to the substrate falls with the temperature, exponentially.
    FadingConduction,
    /// A polymer on the beam softens at its glass transition: the curvature's coefficient falls by a logistic step.
    GlassTransition,
    /// The hinges stiffen with the cube of their angle.
    Stiffening,
    /// Every kelvin of turning warms and cools the joint, which slips a little: the displacement shrinks with the way travelled.
    Fatigue,
    /// The film of air under the plate damps it more, the narrower it is.
    SqueezeFilm,
    /// A step in the sensor's scale where two ranges meet.
    RangeStep,
    /// The sensor's gain follows the power in the chip, with a delay.
    WarmSensor,
}

impl Law {
    pub(crate) const ALL: [Self; 10] = [
        Self::SupplySag,
        Self::Leakage,
        Self::FlowOnset,
        Self::FadingConduction,
        Self::GlassTransition,
        Self::Stiffening,
        Self::Fatigue,
        Self::SqueezeFilm,
        Self::RangeStep,
        Self::WarmSensor,
    ];

    /// The listed effect that it is a form of.
    pub(crate) fn is_a(self) -> Option<&'static str> {
        match self {
            Self::SupplySag => Some("supply-sag"),
            Self::SqueezeFilm => Some("squeeze-film"),
            _ => None,
        }
    }

    /// The stage that it belongs to.
    pub(crate) fn stage(self) -> Stage {
        match self {
            Self::SupplySag => Stage::Drive,
            Self::Leakage => Stage::Resistance,
            Self::FlowOnset | Self::FadingConduction => Stage::Heat,
            Self::GlassTransition => Stage::Curvature,
            Self::Stiffening => Stage::Shape,
            Self::Fatigue => Stage::Memory,
            Self::SqueezeFilm => Stage::Motion,
            Self::RangeStep | Self::WarmSensor => Stage::Sensor,
        }
    }
}

/// One mirror of this kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OtherMirror {
    /// What it has, and how strong: 1 is a size that happens.
    pub(crate) law: Option<(Law, f64)>,
    pub(crate) seed: u64,
}

impl fmt::Display for OtherMirror {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.law {
            Some((law, strength)) => write!(f, "{law:?} {strength} other {}", self.seed),
            None => write!(f, "nothing other {}", self.seed),
        }
    }
}

/// A beam's numbers.
#[derive(Clone, Copy)]
struct Beam {
    cold_ohm: f64,
    /// Of the film's resistance (1/K).
    tcr_per_k: f64,
    /// Heat capacity of a cell (J/K).
    heat_j_k: f64,
    /// From a cell to the next, to the air, and from the first to the substrate (W/K).
    along_w_k: f64,
    air_w_k: f64,
    base_w_k: f64,
    /// Curvature of a kelvin (1/(um K)) and length of a cell (um).
    bend_per_um_k: f64,
    cell_um: f64,
}

/// A mirror while it runs.
struct Running {
    beams: [Beam; ACTUATORS],
    law: Option<(Law, f64)>,
    /// Temperature rises of the cells (K).
    kelvin: [[f64; CELLS]; ACTUATORS],
    time_s: f64,
    /// Where the plate is (um), and where it was at rest.
    plate_um: f64,
    /// Way travelled by each beam's end (um).
    way_um: [f64; ACTUATORS],
    ends_um: [f64; ACTUATORS],
    /// Power in the chip behind its delay (W).
    warm_w: f64,
}

impl OtherMirror {
    /// A session on it, by the bench's usual instruments.
    ///
    /// # Errors
    /// Where it runs away, as a leak that heats itself does.
    pub(crate) fn session(&self, drives: &[Experiment]) -> Result<Dataset, Box<dyn Error>> {
        // The files' frame: keys, clocks and drives.
        let mut session = measure(
            &MirrorConfig::bench(),
            drives,
            Instruments::PositionAndCurrents,
        )?;
        let noise_um = 1e-3 * MirrorConfig::bench().sensor.position_noise_nm;
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ 0x07e4);
        let mut running = Running::new(self, &mut rng);
        for (experiment, (_, file)) in drives.iter().zip(&mut session.files) {
            running.hold([0.0; ACTUATORS], experiment.rest_s);
            if let Some(prehold) = experiment.prehold {
                running.hold([prehold.volts; ACTUATORS], prehold.seconds);
            }
            let dwells = experiment.dwells().expect("an experiment of drives");
            let mut last = [experiment.prehold.map_or(0.0, |prehold| prehold.volts); ACTUATORS];
            for (dwell, row) in dwells.iter().zip(&mut file.rows) {
                if dwell.rest_s > 0.0 {
                    running.hold([0.0; ACTUATORS], dwell.rest_s);
                }
                let from = if experiment.is_curved() {
                    last
                } else {
                    dwell.to_v
                };
                running.run(from, dwell.to_v, dwell.duration_s);
                last = dwell.to_v;
                let z_um = running.read_um();
                if !z_um.is_finite() {
                    return Err(format!("{self} runs away at {:.1} s", running.time_s).into());
                }
                row.z_um = Some(z_um + noise_um * normal(&mut rng));
                let currents = running.currents(dwell.to_v);
                // As good an ammeter as the bench's: 2 uA and 1e-4.
                row.current_a = currents
                    .map(|a| Some(a * (1.0 + 1e-4 * normal(&mut rng)) + 2e-6 * normal(&mut rng)));
            }
        }
        Ok(Dataset::new(&session))
    }
}

impl Running {
    fn new(mirror: &OtherMirror, rng: &mut ChaCha8Rng) -> Self {
        let mut spread = |part: f64| (part * normal(rng)).exp();
        let typical = Beam {
            cold_ohm: 350.0 * spread(0.05),
            tcr_per_k: 2.8e-3 * spread(0.03),
            heat_j_k: 3.2e-7 * spread(0.15),
            along_w_k: 8e-4 * spread(0.1),
            air_w_k: 3.2e-5 * spread(0.1),
            base_w_k: 4e-5 * spread(0.15),
            bend_per_um_k: 4.3e-6 * spread(0.05),
            cell_um: 160.0,
        };
        // As alike as four beams of one chip.
        let mut like = |value: f64| value * spread(0.01);
        let beam = |_| Beam {
            cold_ohm: like(typical.cold_ohm),
            air_w_k: like(typical.air_w_k),
            base_w_k: like(typical.base_w_k),
            bend_per_um_k: like(typical.bend_per_um_k),
            ..typical
        };
        Self {
            beams: std::array::from_fn(beam),
            law: mirror.law,
            kelvin: [[0.0; CELLS]; ACTUATORS],
            time_s: 0.0,
            plate_um: 0.0,
            way_um: [0.0; ACTUATORS],
            ends_um: [0.0; ACTUATORS],
            warm_w: 0.0,
        }
    }

    fn strength(&self, law: Law) -> f64 {
        match self.law {
            Some((present, strength)) if present == law => strength,
            _ => 0.0,
        }
    }

    fn hold(&mut self, volts: [f64; ACTUATORS], duration_s: f64) {
        self.run(volts, volts, duration_s);
    }

    fn run(&mut self, from: [f64; ACTUATORS], to: [f64; ACTUATORS], duration_s: f64) {
        let steps = (duration_s / STEP_S).ceil().max(1.0);
        let h = duration_s / steps;
        for step in 0..steps as u64 {
            let at = |share: f64| {
                let share = (step as f64 + share) / steps;
                std::array::from_fn(|i| from[i] + share * (to[i] - from[i]))
            };
            self.step([at(0.0), at(0.5), at(1.0)], h);
        }
    }

    /// The classical Runge-Kutta method, with the drives at start, middle and end.
    fn step(&mut self, volts: [[f64; ACTUATORS]; 3], h: f64) {
        let start = self.kelvin;
        let mut sum = [[0.0; CELLS]; ACTUATORS];
        let mut at = start;
        for (volts, weight, next) in [
            (volts[0], 1.0, 0.5),
            (volts[1], 2.0, 0.5),
            (volts[1], 2.0, 1.0),
            (volts[2], 1.0, 0.0),
        ] {
            let rate = self.rate(&at, volts);
            sum = sum_of(&sum, &rate, weight);
            at = sum_of(&start, &rate, next * h);
        }
        self.kelvin = sum_of(&start, &sum, h / 6.0);
        self.time_s += h;
        self.remember(volts[2], h);
    }

    fn remember(&mut self, volts: [f64; ACTUATORS], h: f64) {
        for i in 0..ACTUATORS {
            let end = self.end_um(i);
            self.way_um[i] += (end - self.ends_um[i]).abs();
            self.ends_um[i] = end;
        }
        let shrunk = |i: usize| {
            let worn = self.strength(Law::Fatigue) * 4e-6 * self.way_um[i];
            self.ends_um[i] * (1.0 - worn / (1.0 + 20.0 * worn))
        };
        let target = (0..ACTUATORS).map(shrunk).sum::<f64>() / ACTUATORS as f64;
        let damped = self.strength(Law::SqueezeFilm);
        self.plate_um = if damped > 0.0 {
            let gap = (1.0 - self.plate_um / 260.0).max(0.15);
            let lag_s = 1.2e-4 * damped / gap.powi(3);
            target + (self.plate_um - target) * (-h / lag_s).exp()
        } else {
            target
        };
        let power: f64 = self
            .currents(volts)
            .iter()
            .zip(volts)
            .map(|(a, v)| a * v)
            .sum();
        self.warm_w += (power - self.warm_w) * (1.0 - (-h / 4.0).exp());
    }

    fn mean_k(kelvin: &[f64; CELLS]) -> f64 {
        kelvin.iter().sum::<f64>() / CELLS as f64
    }

    fn ohm(&self, i: usize, kelvin: &[f64; CELLS]) -> f64 {
        let beam = &self.beams[i];
        let mean = Self::mean_k(kelvin);
        let film = beam.cold_ohm * (1.0 + beam.tcr_per_k * mean);
        let leak = 4e-8 * self.strength(Law::Leakage) * (mean / 17.0).exp();
        film / (1.0 + film * leak)
    }

    /// Voltages at the heaters: the drivers' less what their common supply loses.
    fn at_heaters(&self, volts: [f64; ACTUATORS], ohm: [f64; ACTUATORS]) -> [f64; ACTUATORS] {
        let sag = 2.0 * self.strength(Law::SupplySag);
        let conductance: f64 = ohm.iter().map(|r| 1.0 / r).sum();
        let drawn: f64 = volts.iter().zip(ohm).map(|(v, r)| v / r).sum();
        let lost = sag * drawn / (1.0 + sag * conductance);
        volts.map(|v| if v > 0.0 { (v - lost).max(0.0) } else { 0.0 })
    }

    fn currents(&self, volts: [f64; ACTUATORS]) -> [f64; ACTUATORS] {
        let ohm = std::array::from_fn(|i| self.ohm(i, &self.kelvin[i]));
        let at = self.at_heaters(volts, ohm);
        std::array::from_fn(|i| at[i] / ohm[i])
    }

    fn rate(
        &self,
        kelvin: &[[f64; CELLS]; ACTUATORS],
        volts: [f64; ACTUATORS],
    ) -> [[f64; CELLS]; ACTUATORS] {
        let ohm = std::array::from_fn(|i| self.ohm(i, &kelvin[i]));
        let at = self.at_heaters(volts, ohm);
        let flow = self.strength(Law::FlowOnset);
        let fading = self.strength(Law::FadingConduction);
        std::array::from_fn(|i| {
            let (beam, t) = (&self.beams[i], &kelvin[i]);
            let each = at[i] * at[i] / ohm[i] / CELLS as f64;
            std::array::from_fn(|k| {
                let onset = 0.5 * (1.0 + ((t[k] - 70.0) / 12.0).tanh());
                let air = beam.air_w_k * (1.0 + 0.06 * flow * onset) * t[k];
                let before = if k == 0 {
                    let fades = (-1.5e-3 * fading * t[0]).exp();
                    -beam.base_w_k * fades * t[0]
                } else {
                    beam.along_w_k * (t[k - 1] - t[k])
                };
                let after = if k + 1 < CELLS {
                    beam.along_w_k * (t[k + 1] - t[k])
                } else {
                    0.0
                };
                (each - air + before + after) / beam.heat_j_k
            })
        })
    }

    /// Where a beam alone would hold its end (um).
    fn end_um(&self, i: usize) -> f64 {
        let beam = &self.beams[i];
        let glass = self.strength(Law::GlassTransition);
        let (mut angle, mut um) = (0.0, 0.0);
        for t in self.kelvin[i] {
            let softened = 0.02 * glass / (1.0 + ((75.0 - t) / 7.0).exp());
            let turned = beam.bend_per_um_k * (1.0 - softened) * t * beam.cell_um;
            um += beam.cell_um * (angle + 0.5 * turned).sin();
            angle += turned;
        }
        let stiff = self.strength(Law::Stiffening);
        um * (1.0 - 0.015 * stiff * (um / 150.0).powi(3))
    }

    /// What the sensor reads (um), but for its noise.
    fn read_um(&self) -> f64 {
        let step = 0.4 * self.strength(Law::RangeStep) * f64::from(u8::from(self.plate_um > 85.0));
        let gain = 0.05 * self.strength(Law::WarmSensor) * self.warm_w;
        self.plate_um * (1.0 + gain) + step
    }
}

/// One more so many times another.
fn sum_of(
    one: &[[f64; CELLS]; ACTUATORS],
    other: &[[f64; CELLS]; ACTUATORS],
    times: f64,
) -> [[f64; CELLS]; ACTUATORS] {
    std::array::from_fn(|i| std::array::from_fn(|k| one[i][k] + times * other[i][k]))
}

/// Box and Muller's transform.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (a, b): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - a).ln()).sqrt() * (TAU * b).cos()
}
