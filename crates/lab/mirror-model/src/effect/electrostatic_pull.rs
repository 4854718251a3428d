//! The driven heaters attract the substrate below them.
//!
//! The gap that closes is that of each actuator's beams where these are wide and far from the plate, or the plate's where beams
//! hold it from close by; the two differ where the actuators stand at different heights.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

/// Each actuator across its own gap.
pub(super) struct ElectrostaticPull;
/// All of them across the plate's.
struct OfThePlate;

// Of 3.5 V, 0.1 um/V^2 make 1.2 um; more than 2 um/V^2, 25 um of them, would pull such a mirror in. The gap as in
// `gap_heat_loss.rs`; of 3 mm a stroke of 173.7 um takes a seventeenth, and the pull hardly grows.
static PARAMETERS: [Parameter; 2] = [
    parameter("e", "um/V^2", 0.1, 0.0, 2.0),
    parameter("gap", "um", 330.0, 270.0, 3000.0),
];

/// The part of the gap beyond which it counts as closed.
const CLOSED: f64 = 0.95;

const fn info(acts: Acts, equation: &'static str) -> Info {
    Info {
        id: Cow::Borrowed("electrostatic-pull"),
        title: Cow::Borrowed("electrostatic pull towards the substrate"),
        stage: Stage::Shape,
        acts,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(&PARAMETERS),
        shows: Cow::Borrowed("z jumps with the drive, before anything has warmed, and R does not"),
        separates: Cow::Borrowed("a step sampled fast; the substrate at another potential"),
        source: Cow::Borrowed(
            "the force between plates goes as (V/distance)^2 (Senturia, Microsystem Design, chapter 6)",
        ),
    }
}

static OF_EACH: Info = info(Acts::Displacement, "z' = z + e V^2/(1 - z/gap)^2");
static OF_THE_PLATE: Info = info(
    Acts::Motion,
    "z' = z + e mean(V^2)/(1 - z/gap)^2, z of the plate's centre",
);

static OTHERS: [&dyn Effect; 1] = [&OfThePlate];

/// How far a square of the voltage (V^2) pulls what stands at `x` (um).
fn pulled(p: &[f64], x: f64, square_v2: f64) -> f64 {
    let open = 1.0 - (x / p[1]).clamp(0.0, CLOSED);
    x + p[0] * square_v2 / (open * open)
}

impl Effect for ElectrostaticPull {
    fn info(&self) -> &Info {
        &OF_EACH
    }

    fn form(&self) -> &str {
        "actuator"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        pulled(p, x, m.voltage_v * m.voltage_v)
    }
}

impl Effect for OfThePlate {
    fn info(&self) -> &Info {
        &OF_THE_PLATE
    }

    fn form(&self) -> &str {
        "plate"
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        pulled(p, x, m.mean_square_v2)
    }

    fn is_inverted(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use crate::effect::{Active, find, forms};
    use crate::{ACTUATORS, Interval, Model, Preset, simulate};

    /// Where a mirror goes that is pulled in each form, less where it goes without (um).
    fn pulls(drive_v: [f64; ACTUATORS]) -> Vec<f64> {
        let rest = [Interval::held(drive_v, 10.0)];
        let plain = Model::from(Preset::Paper);
        let at = |model: &Model| simulate(model, &rest, 0.3).expect("it settles")[0].z_um;
        let effect = find("electrostatic-pull").expect("built in");
        let pulled = forms(&effect).into_iter().map(|form| {
            let mut active = Active::usual(form);
            active.values = vec![0.1, 400.0];
            let effects = vec![active];
            let with = Model {
                effects,
                ..plain.clone()
            };
            at(&with) - at(&plain)
        });
        pulled.collect()
    }

    #[test]
    fn driven_alike_the_forms_are_one_and_one_actuator_alone_tells_them_apart() {
        let [each, plate] = pulls([2.0; ACTUATORS])[..] else {
            panic!("two forms");
        };
        assert!((each - plate).abs() < 1e-9 && each > 0.4, "{each} {plate}");
        // One at 2 V: alone it stands at z, the plate's centre at a quarter of that.
        let plain = Model::from(Preset::Paper);
        let alone = [2.0, 0.0, 0.0, 0.0];
        let rest = [Interval::held(alone, 10.0)];
        let centre = simulate(&plain, &rest, 0.3).expect("it settles")[0].z_um;
        let expected = |height: f64| 0.1 * 4.0 / 4.0 / (1.0 - height / 400.0).powi(2);
        let found = pulls(alone);
        assert!(
            (found[0] - expected(4.0 * centre)).abs() < 1e-9,
            "{found:?}"
        );
        assert!((found[1] - expected(centre)).abs() < 1e-9, "{found:?}");
    }
}
