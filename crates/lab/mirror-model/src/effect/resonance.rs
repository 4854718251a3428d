//! The plate is a mass on four springs.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step, parameter};
use std::borrow::Cow;

pub(super) struct Resonance;

// Sessions are read every 0.2 ms at best, and show what is faster as if it were slower: 2500 Hz is the Nyquist frequency. 60 Hz is
// well below the lowest of such mirrors, 0.2 to 0.5 kHz, with a heavy plate on long beams; what is slower is told from beams that are slow by its
// overshoot alone. a is 1 where the whole plate rings; its 1.5, and Q up to 300, are choices. A broad line is a start
// for narrow ones, too; from a narrow one a broad one is not found.
static PARAMETERS: [Parameter; 3] = [
    parameter("a", "1", 1.0, 0.0, 1.5),
    parameter("f", "Hz", 1500.0, 60.0, 2500.0),
    parameter("Q", "1", 5.0, 1.0, 300.0),
];

static INFO: Info = Info {
    id: Cow::Borrowed("resonance"),
    title: Cow::Borrowed("mechanical resonance"),
    stage: Stage::Motion,
    acts: Acts::Motion,
    equation: Cow::Borrowed("z' = z + a (y - z); y'' + 2 pi f/Q y' + (2 pi f)^2 (y - z) = 0"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z rings after a step, R does not"),
    separates: Cow::Borrowed("a step sampled fast, a chirp"),
    source: Cow::Borrowed("0.5 to 7 kHz in this family of mirrors"),
};

use std::f64::consts::TAU;

impl Effect for Resonance {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, state: &[f64], _: &Moment) -> f64 {
        x + p[0] * state[0]
    }

    fn states(&self) -> usize {
        2
    }

    /// The states are how far the plate is off its input, and its speed. Exact for a straight input.
    fn advance(&self, p: &[f64], state: &mut [f64], step: &Step) {
        let (omega, damping) = (TAU * p[1], std::f64::consts::PI * p[1] / p[2]);
        let slope = (step.to - step.from) / step.duration_s;
        let behind = -2.0 * damping / (omega * omega) * slope;
        let (off, rate) = (state[0] - behind, state[1] - slope);
        let ringing = (omega * omega - damping * damping)
            .max(0.0)
            .sqrt()
            .max(1e-9);
        let (sin, cos) = (ringing * step.duration_s).sin_cos();
        let decay = (-damping * step.duration_s).exp();
        let quadrature = (rate + damping * off) / ringing;
        let now = decay * (off * cos + quadrature * sin);
        state[0] = now + behind;
        state[1] = decay * ringing * (quadrature * cos - off * sin) - damping * now + slope;
    }
}
