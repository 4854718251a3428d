//! Before and after: error at rest, a step, the errors along two sines, and along a triangle.

use calibration_procedure::{Point, Series as Tried, Trial};
use charts::{Look, Panel, Series};

/// A step is shown so long.
const STEP_S: f64 = 0.6;

/// What was tried, a row each: before on the left, after on the right.
pub(crate) fn before_and_after(before: &Trial, after: &Trial) -> Vec<Vec<Panel>> {
    let (before, after) = (panels(before, "before"), panels(after, "after"));
    before
        .into_iter()
        .zip(after)
        .map(|(before, after)| vec![before, after])
        .collect()
}

fn panels(trial: &Trial, when: &str) -> [Panel; 4] {
    let panel = |what: &str, (x, y): (&str, &str), series| Panel {
        title: format!("{what}, {when}"),
        x: x.into(),
        y: y.into(),
        series,
    };
    let errors = |what, series| panel(what, ("asked (µm)", "error (µm)"), series);
    let shown = || trial.step.points.iter().filter(|point| point.t_s < STEP_S);
    let in_ms = |um: fn(&Point) -> f64| shown().map(|point| (1e3 * point.t_s, um(point))).collect();
    [
        errors(
            "error at rest",
            vec![error("reached less asked", Look::Residual, &trial.rest)],
        ),
        panel(
            "a step",
            ("time (ms)", "z (µm)"),
            vec![
                series("asked", Look::Model, in_ms(|point| point.asked_um)),
                series("reached", Look::Measured, in_ms(|point| point.reached_um)),
            ],
        ),
        errors(
            "error along two sines",
            vec![
                error("20 Hz", Look::Residual, &trial.fast_sine),
                error("1 Hz", Look::Line(0), &trial.slow_sine),
            ],
        ),
        errors(
            "error along a triangle",
            vec![error("20 Hz", Look::Residual, &trial.triangle)],
        ),
    ]
}

/// How far from where it was asked to be the mirror was, over that.
fn error(name: &str, look: Look, tried: &Tried) -> Series {
    let point = |point: &Point| (point.asked_um, point.error_um());
    series(name, look, tried.points.iter().map(point).collect())
}

fn series(name: &str, look: Look, points: Vec<(f64, f64)>) -> Series {
    Series {
        name: name.into(),
        look,
        points,
    }
}
