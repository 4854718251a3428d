//! What is written beside the effects' ranges, where it can be computed.

use super::*;
use crate::bimorph::Deflection;
use crate::{Parameters, PistonModel, Preset};
use approx::assert_abs_diff_eq;

/// The highest drive of the paper (V).
const HIGHEST_V: f64 = 3.5;

fn parameter_of(effect: &dyn Effect, symbol: &str) -> Parameter {
    let parameters = &effect.info().parameters;
    let found = parameters.iter().find(|p| p.symbol == symbol);
    found.expect("a parameter of this symbol").clone()
}

#[test]
fn every_range_holds_its_start() {
    let effects = built_in();
    let forms = effects.iter().flat_map(|effect| forms(effect));
    for effect in forms {
        for p in effect.info().parameters.iter() {
            let id = (&effect.info().id, &p.symbol);
            assert!(p.low < p.high, "{id:?}");
            assert!((p.low..=p.high).contains(&p.start), "{id:?}");
        }
    }
}

#[test]
fn a_curl_that_lifts_the_plate_220_um_is_within_its_range() {
    let curl_per_um = -1.8e-3;
    // The curvature has two digits: half of the last, 0.05e-3 /um, is 6 um.
    let lifted_um = -Deflection::of(&Parameters::PAPER, curl_per_um).z_um;
    assert_abs_diff_eq!(lifted_um, 220.0, epsilon = 6.0);
    let k0 = parameter_of(&*find("initial-curl").expect("an effect"), "k0");
    assert!(k0.low < 2.0 * curl_per_um && k0.high < -curl_per_um);
}

#[test]
fn no_gap_is_closed_by_a_preset() {
    let highest_um = Preset::ALL
        .map(|preset| {
            let parameters = preset.parameters();
            PistonModel { parameters }.displacement_at_voltage_um(HIGHEST_V)
        })
        .into_iter()
        .fold(0.0, f64::max);
    for id in ["gap-heat-loss", "electrostatic-pull"] {
        let gap = parameter_of(&*find(id).expect("an effect"), "gap");
        assert!(gap.low > highest_um, "{id}: {highest_um} um");
    }
}

#[test]
fn at_150_degc_a_hundredth_of_the_power_is_radiated() {
    let k = parameter_of(&*find("radiation").expect("an effect"), "k");
    let radiated_w = k.start * (423.0_f64.powi(4) - 295.0_f64.powi(4));
    // 22.6 mW, as docs/theory/model.md has it. The start is one digit: 1.08 % of the power.
    assert_abs_diff_eq!(radiated_w / 22.6e-3, 0.01, epsilon = 1e-3);
}

/// The largest height between two branches of a cycle that moves all plays.
#[test]
fn the_loop_of_all_plays_is_as_high_as_told() {
    let effect = find("hysteresis").expect("an effect");
    let [w, r] = ["w", "r"].map(|symbol| parameter_of(&*effect, symbol).start);
    let values = [w, r];
    let mut state = vec![0.0; effect.states()];
    let mut go = |to: f64| {
        let step = Step {
            from: to,
            to,
            duration_s: 1.0,
            moment: Moment::default(),
        };
        effect.advance(&values, &mut state, &step);
        effect.output(&values, to, &state, &Moment::default())
    };
    let middle_um = 3.0 * r;
    go(0.0);
    let up = go(middle_um);
    go(2.0 * middle_um);
    let down = go(middle_um);
    // Rounding alone.
    assert_abs_diff_eq!(down - up, 4.0 / 3.0 * w * r, epsilon = 1e-12);
}
