use super::*;
use approx::assert_relative_eq;

const WAVE: Wave = Wave {
    mean: 80.0,
    amplitude: 20.0,
    frequency_hz: 2.0,
};

#[test]
fn a_triangle_goes_up_down_and_back() {
    let triangle = Signal::Triangle(WAVE);
    for (t_s, um) in [
        (0.0, 80.0),
        (0.0625, 90.0),
        (0.125, 100.0),
        (0.25, 80.0),
        (0.375, 60.0),
        (0.5, 80.0),
    ] {
        assert_relative_eq!(triangle.at(t_s), um, max_relative = 1e-12);
    }
    assert_eq!(triangle.range(), (60.0, 100.0));
}

#[test]
fn a_sine_has_its_top_after_a_quarter_of_a_period() {
    assert_relative_eq!(Signal::Sine(WAVE).at(0.125), 100.0, max_relative = 1e-12);
}

#[test]
fn steps_hold_and_lines_connect() {
    let values = vec![0.0, 10.0, 20.0];
    let dwell_s = 2.0;
    let steps = Signal::Steps {
        values: values.clone(),
        dwell_s,
    };
    assert_eq!(
        [0.1, 2.1, 5.9, 6.1].map(|t| steps.at(t)),
        [0.0, 10.0, 20.0, 0.0]
    );
    let lines = Signal::Lines { values, dwell_s };
    assert_relative_eq!(lines.at(3.0), 15.0, max_relative = 1e-12);
    assert_eq!((steps.period_s(), lines.period_s()), (6.0, 4.0));
}
