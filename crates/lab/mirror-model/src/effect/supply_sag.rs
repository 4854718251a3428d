//! The drivers share a resistance: a supply, a ground, a cable's return.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct SupplySag;

// 1 ohm is 2.4 m of ribbon cable there and back: copper of 17.2 nohm m, AWG 28 of 0.080 mm^2. 20 ohm, a third of what four
// heaters of 250 ohm have side by side, is a choice.
static PARAMETERS: [Parameter; 1] = [parameter("R_c", "ohm", 1.0, 0.0, 20.0)];

static INFO: Info = Info {
    id: Cow::Borrowed("supply-sag"),
    title: Cow::Borrowed("a resistance that the drivers share"),
    stage: Stage::Drive,
    acts: Acts::Voltage,
    equation: Cow::Borrowed("V_i' = V_i - R_c (the other actuators' currents)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("current and z of an actuator fall as others are driven, at once"),
    separates: Cow::Borrowed("drive one actuator, switch the others, watch its current"),
    source: Cow::Borrowed(
        "Kirchhoff's voltage law; of its own current's part a lead of each heater takes",
    ),
};

impl Effect for SupplySag {
    fn info(&self) -> &Info {
        &INFO
    }

    fn looks_at_other_actuators(&self) -> bool {
        true
    }

    /// A driver that is off is held at its ground.
    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        if x > 0.0 {
            (x - p[0] * m.others_current_a).max(0.0)
        } else {
            x
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::effect::{Active, find};
    use crate::simulate::{Interval, simulate};
    use crate::{Model, Preset};

    /// Currents after a minute, by which every pole is at rest.
    fn currents(effects: &[(&str, f64)], volts: [f64; 4]) -> [f64; 4] {
        let mut model = Model::from(Preset::Paper);
        for &(id, strength) in effects {
            let mut active = Active::usual(find(id).expect("an effect"));
            active.values[0] = strength;
            model.effects.push(active);
        }
        let held = [Interval::held(volts, 60.0)];
        simulate(&model, &held, 0.5).expect("a finite answer")[0].current_a
    }

    #[test]
    fn four_alike_lose_three_currents_and_one_alone_loses_none() {
        let sag = [("supply-sag", 2.0)];
        assert_eq!(
            currents(&sag, [3.0, 0.0, 0.0, 0.0]),
            currents(&[], [3.0, 0.0, 0.0, 0.0])
        );
        // To each of four alike, three times the shared resistance is a lead of its own.
        let all = currents(&sag, [3.0; 4]);
        let leads = currents(&[("series-resistance", 6.0)], [3.0; 4]);
        for (shared, own) in all.into_iter().zip(leads) {
            // The simulation's fixed points are found to 1e-5 K of some 100 K.
            assert!((shared / own - 1.0).abs() < 1e-6, "{shared} {own}");
        }
    }
}
