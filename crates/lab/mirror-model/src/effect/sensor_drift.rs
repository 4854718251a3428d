//! The sensor's zero moves during a session, and the mirror does not.

use super::course::{self, Course};
use super::{Acts, Info, Parameter, Stage, Timing, parameter};
use std::borrow::Cow;

/// It drifts in proportion to time; in its other forms it jumps, or warms up.
pub(super) static SENSOR_DRIFT: Course = Course {
    form: "ramp",
    info: &DRIFTS,
    added: course::ramp,
    timing: None,
    others: &[&JUMP, &WARM_UP],
};

/// A jump between two readings, or two files (s): sensors are read once a second where they are to settle.
const JUMP_S: f64 = 0.3;

static JUMP: Course = Course {
    form: "jump",
    info: &JUMPS,
    added: |p, t_s| course::step(p, t_s, JUMP_S),
    timing: Some(Timing::Onset),
    others: &[],
};

static WARM_UP: Course = Course {
    form: "warm-up",
    info: &WARMS_UP,
    added: course::settling,
    timing: None,
    others: &[],
};

const fn info(equation: &'static str, source: &'static str, values: &'static [Parameter]) -> Info {
    Info {
        id: Cow::Borrowed("sensor-drift"),
        title: Cow::Borrowed("the sensor's zero drifts"),
        stage: Stage::Sensor,
        acts: Acts::Reading,
        equation: Cow::Borrowed(equation),
        parameters: Cow::Borrowed(values),
        shows: Cow::Borrowed(
            "z is off by the same amount at every drive and follows the clock, R does not",
        ),
        separates: Cow::Borrowed("the cold resistance; a target that stands still"),
        source: Cow::Borrowed(source),
    }
}

// A holder of 50 mm of aluminium, 23 um/(m K), takes its sensor 1.2 um a kelvin away; 50 um are a tenth of the range of the paper's
// sensor, +-250 um, a choice. Electronics warm up within half a minute to an hour.
static DRIFT_VALUES: [Parameter; 1] = [parameter("g", "um/ks", 2.0, -200.0, 200.0)];
static DRIFTS: Info = info(
    "z' = z + g t",
    "a holder that warms, for much longer than the session",
    &DRIFT_VALUES,
);
static JUMP_VALUES: [Parameter; 2] = [
    parameter("D", "um", 0.5, -50.0, 50.0),
    parameter("t_0", "s", 150.0, 1.0, 1e4),
];
static JUMPS: Info = info(
    "z' = z + D (1 + tanh((t - t_0)/0.3 s))/2",
    "a sensor that is zeroed again between two files, a holder that slips",
    &JUMP_VALUES,
);
static WARM_UP_VALUES: [Parameter; 2] = [
    parameter("D", "um", 1.0, -50.0, 50.0),
    parameter("tau", "s", 200.0, 30.0, 3000.0),
];
static WARMS_UP: Info = info(
    "z' = z + D (1 - exp(-t/tau))",
    "a sensor's electronics or laser that warm up",
    &WARM_UP_VALUES,
);
