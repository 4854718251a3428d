//! Heat is not lost in proportion to the temperature: air conducts and convects better when hot, silicon worse.

use super::{Acts, Effect, Heater, Info, Moment, Parameter, Stage, Strengths, parameter};
use std::borrow::Cow;

/// One law of loss: what is lost beyond a loss in proportion, with the same slope at the start, for a strength of 1 (K).
pub(super) struct HeatLossTemperature {
    form: &'static str,
    info: &'static Info,
    beyond_k: fn(f64) -> f64,
    others: &'static [&'static dyn Effect],
}

/// A room of 22 degC (K).
const ROOM_K: f64 = 295.0;
/// Conductivity of air as a power of the absolute temperature: Incropera and DeWitt, Fundamentals of Heat and Mass Transfer,
/// table A.4, 300 to 1000 K.
const AIR: f64 = 0.8;
/// A temperature rise that free convection's strength is counted at (K): about the paper's mirror's at high drives. Its coefficient grows
/// with the fourth root of the temperature difference: laminar, ibidem, section 9.6.
const CONVECTION_K: f64 = 100.0;
/// Conductivity of silicon above the room as a negative power of the absolute temperature: C. Glassbrenner and G. Slack,
/// Phys. Rev. 134 (1964) A1058, 300 to 1000 K.
const SILICON: f64 = 1.3;

pub(super) static HEAT_LOSS_TEMPERATURE: HeatLossTemperature = HeatLossTemperature {
    form: "linear",
    info: &LINEAR,
    beyond_k: |rise_k| rise_k * rise_k,
    others: &[&BY_AIR, &BY_CONVECTION, &BY_SILICON, &CONVEX],
};

static BY_AIR: HeatLossTemperature = HeatLossTemperature {
    form: "air",
    info: &THROUGH_AIR,
    beyond_k: |rise_k| {
        let power = 1.0 + AIR;
        let ratio = (1.0 + rise_k / ROOM_K).max(0.0);
        ROOM_K / power * (ratio.powf(power) - 1.0) - rise_k
    },
    others: &[],
};

static BY_CONVECTION: HeatLossTemperature = HeatLossTemperature {
    form: "convection",
    info: &FREE_CONVECTION,
    beyond_k: |rise_k| rise_k * (rise_k.abs() / CONVECTION_K).sqrt().sqrt(),
    others: &[],
};

static BY_SILICON: HeatLossTemperature = HeatLossTemperature {
    form: "silicon",
    info: &THROUGH_SILICON,
    beyond_k: |rise_k| {
        let power = 1.0 - SILICON;
        let ratio = (1.0 + rise_k / ROOM_K).max(f64::MIN_POSITIVE);
        ROOM_K / power * (ratio.powf(power) - 1.0) - rise_k
    },
    others: &[],
};

static CONVEX: HeatLossTemperature = HeatLossTemperature {
    form: "convex",
    info: &TO_SECOND_ORDER,
    beyond_k: |rise_k| rise_k.powi(3),
    others: &[],
};

const fn info(
    equation: &'static str,
    source: &'static str,
    strength: &'static [Parameter],
) -> Info {
    Info {
        id: Cow::Borrowed("heat-loss-temperature"),
        title: Cow::Borrowed("heat loss changes with temperature"),
        stage: Stage::Heat,
        acts: Acts::Heating,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(strength),
        shows: Cow::Borrowed(
            "z and R are concave in V where the loss grows, convex where it falls, largest misfit near half of the highest drive; P/dT changes with dT",
        ),
        separates: Cow::Borrowed("a steady ladder of V and I; vacuum"),
        source: Cow::Borrowed(source),
    }
}

// From nothing to two and a half times the largest of the source; the loss at 100 K is doubled there.
static LINEAR_STRENGTH: [Parameter; 1] = [parameter("g", "1/K", 1e-3, 0.0, 1e-2)];
static LINEAR: Info = info(
    "P' = P - g dT^2/R_T",
    "air conducts better when hot: g 2e-3 to 4e-3 /K",
    &LINEAR_STRENGTH,
);
// All of the loss through air is 1. A conductivity of the hot end all along takes twice what the integral does; twice that at most.
static THROUGH_AIR_STRENGTH: [Parameter; 1] = [parameter("s", "1", 1.0, 0.0, 4.0)];
static THROUGH_AIR: Info = info(
    "P' = P - s (T0/1.8 ((T/T0)^1.8 - 1) - dT)/R_T",
    "conduction through air, k as T^0.8 (Incropera and DeWitt, table A.4)",
    &THROUGH_AIR_STRENGTH,
);
// What does not convect is lost in proportion; ten times as much convects at most.
static FREE_CONVECTION_STRENGTH: [Parameter; 1] = [parameter("c", "1", 0.3, 0.0, 10.0)];
static FREE_CONVECTION: Info = info(
    "P' = P - c dT (dT/100 K)^0.25/R_T",
    "laminar free convection, h as dT^0.25 (Incropera and DeWitt, section 9.6)",
    &FREE_CONVECTION_STRENGTH,
);
// All of the loss through silicon is 1; half as much again where it conducts worse than the power law says. Half of it to start
// at.
static THROUGH_SILICON_STRENGTH: [Parameter; 1] = [parameter("s", "1", 0.5, 0.0, 1.5)];
static THROUGH_SILICON: Info = info(
    "P' = P + s (dT - T0/0.3 (1 - (T0/T)^0.3))/R_T",
    "conduction through silicon, k as T^-1.3 (Glassbrenner and Slack 1964)",
    &THROUGH_SILICON_STRENGTH,
);
// Like the linear one: the loss at 100 K, and where a heater on a bench is hottest, is doubled at the most. Without that end it does in every
// lamp what radiation does.
static TO_SECOND_ORDER_STRENGTH: [Parameter; 1] = [parameter("q", "1/K^2", 1e-5, 0.0, 1e-4)];
static TO_SECOND_ORDER: Info = info(
    "P' = P - q dT^3/R_T",
    "whatever begins late: a conductivity's Taylor series to the second order without the first",
    &TO_SECOND_ORDER_STRENGTH,
);

impl Effect for HeatLossTemperature {
    fn info(&self) -> &Info {
        self.info
    }

    fn form(&self) -> &str {
        self.form
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        self.others
    }

    fn strengths_in(&self, heater: &Heater) -> Option<Strengths> {
        let doubled = heater.least_rise_k.powi(-2);
        (self.form == CONVEX.form).then_some(Strengths {
            usual: 0.1 * doubled,
            low: 0.0,
            high: doubled,
        })
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        // A power takes longer than all else of a step, and the room mostly stays.
        let of_room_k = if m.ambient_k == 0.0 {
            0.0
        } else {
            (self.beyond_k)(m.ambient_k)
        };
        x - p[0] * ((self.beyond_k)(m.temperature_rise_k) - of_room_k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_beyond_proportion_are_those_of_their_integrals() {
        // The integral of the conductivity over the room's, by Simpson's rule, less the rise.
        let integral = |conductivity: fn(f64) -> f64, rise_k: f64| {
            let parts = 1000;
            let width = rise_k / f64::from(parts);
            let sum: f64 = (0..parts)
                .map(|part| ROOM_K + f64::from(part) * width)
                .map(|t| {
                    let at = |t: f64| conductivity(t / ROOM_K);
                    (at(t) + 4.0 * at(t + 0.5 * width) + at(t + width)) * width / 6.0
                })
                .sum();
            sum - rise_k
        };
        for rise_k in [10.0, 100.0, 800.0] {
            let air = integral(|ratio| ratio.powf(0.8), rise_k);
            // What Simpson's rule leaves in 1000 parts, and what cancels of 300 K.
            assert!(((BY_AIR.beyond_k)(rise_k) / air - 1.0).abs() < 1e-6);
            let silicon = integral(|ratio| ratio.powf(-1.3), rise_k);
            assert!(((BY_SILICON.beyond_k)(rise_k) / silicon - 1.0).abs() < 1e-6 && silicon < 0.0);
        }
        // 16 times as warm, twice the coefficient.
        let convection = BY_CONVECTION.beyond_k;
        assert!((convection(1600.0) / convection(100.0) - 32.0).abs() < 1e-9);
    }
}
