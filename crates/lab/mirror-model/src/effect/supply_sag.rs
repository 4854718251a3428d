//! The drivers share a resistance: of their supply, which only those feel that are driven, or of a ground or a cable's return, which
//! lifts the ground of those that are not: current flows backwards through them.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

/// In the supply.
pub(super) struct SupplySag;
/// In the way back.
struct InTheReturn;

// 1 ohm is 2.4 m of ribbon cable there and back: copper of 17.2 nohm m, AWG 28 of 0.080 mm^2. 20 ohm, a third of what four
// heaters of 250 ohm have side by side, is a choice.
static PARAMETERS: [Parameter; 1] = [parameter("R_c", "ohm", 1.0, 0.0, 20.0)];

const fn info(equation: &'static str, shows: &'static str) -> Info {
    Info {
        id: Cow::Borrowed("supply-sag"),
        title: Cow::Borrowed("a resistance that the drivers share"),
        stage: Stage::Drive,
        acts: Acts::Voltage,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(&PARAMETERS),
        shows: Cow::Borrowed(shows),
        separates: Cow::Borrowed("drive one actuator, switch the others, watch its current"),
        source: Cow::Borrowed(
            "Kirchhoff's voltage law; of its own current's part a lead of each heater takes",
        ),
    }
}

static OF_THE_SUPPLY: Info = info(
    "V_i' = V_i - R_c (the other actuators' currents), 0 where V_i = 0",
    "current and z of an actuator fall as others are driven, at once",
);
static OF_THE_RETURN: Info = info(
    "V_i' = V_i - R_c (the other actuators' currents), at V_i = 0 too",
    "current and z of an actuator fall as others are driven, at once, and of one that is not driven the current is negative",
);

static OTHERS: [&dyn Effect; 1] = [&InTheReturn];

impl Effect for SupplySag {
    fn info(&self) -> &Info {
        &OF_THE_SUPPLY
    }

    fn form(&self) -> &str {
        "supply"
    }

    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        &OTHERS
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

impl Effect for InTheReturn {
    fn info(&self) -> &Info {
        &OF_THE_RETURN
    }

    fn form(&self) -> &str {
        "return"
    }

    fn looks_at_other_actuators(&self) -> bool {
        true
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x - p[0] * m.others_current_a
    }
}

#[cfg(test)]
mod tests {
    use crate::effect::{Active, find, forms};
    use crate::simulate::{Interval, simulate};
    use crate::{Model, Preset};

    fn with(effects: &[(&str, f64)]) -> Model {
        let mut model = Model::from(Preset::Paper);
        for &(id, strength) in effects {
            let mut active = Active::usual(find(id).expect("an effect"));
            active.values[0] = strength;
            model.effects.push(active);
        }
        model
    }

    /// Currents after a minute, by which every pole is at rest.
    fn settled(model: &Model, volts: [f64; 4]) -> [f64; 4] {
        let held = [Interval::held(volts, 60.0)];
        simulate(model, &held, 0.5).expect("a finite answer")[0].current_a
    }

    fn currents(effects: &[(&str, f64)], volts: [f64; 4]) -> [f64; 4] {
        settled(&with(effects), volts)
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

    #[test]
    fn through_a_shared_return_current_flows_backwards_where_nothing_drives() {
        let mut model = with(&[("supply-sag", 4.0)]);
        let shared = model.effects[0].effect.clone();
        model.effects[0].effect = forms(&shared).swap_remove(1);
        let [driven, idle @ ..] = settled(&model, [3.0, 0.0, 0.0, 0.0]);
        // Cold but for what the milliwatts of the driven one are beside its own: V = 0 - R_c (I_1 + I_3 + I_4) = R I_2.
        let expected = -4.0 * driven / (360.0 + 2.0 * 4.0);
        for current in idle {
            assert!(
                (current / expected - 1.0).abs() < 1e-3,
                "{current} {expected}"
            );
        }
        let alike = settled(&model, [3.0; 4]);
        assert_eq!(alike, currents(&[("supply-sag", 4.0)], [3.0; 4]));
    }
}
