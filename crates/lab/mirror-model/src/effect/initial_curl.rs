//! Residual stress bends the released beams before any heat does.

use super::{Acts, Effect, Info, Moment, Parameter, Stage, parameter};
use std::borrow::Cow;

pub(super) struct InitialCurl;

// A plate that stands 220 um up by the curl of its beams alone has a curvature of -1.8e-3 /um (the displacement of eqs. 5, 8
// and 9; `ranges.rs`). Nearly three times that is the lowest; the other way, down into a pit, half of that. To start at, some
// quarter of it, a choice.
static PARAMETERS: [Parameter; 1] = [parameter("k0", "1/um", -5e-4, -5e-3, 1e-3)];

static INFO: Info = Info {
    id: Cow::Borrowed("initial-curl"),
    title: Cow::Borrowed("the beams are curled when cold"),
    stage: Stage::Curvature,
    acts: Acts::Curvature,
    equation: Cow::Borrowed("1/rho' = 1/rho + k0; z is counted from the cold position"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("z grows faster or slower towards the top, at equal R"),
    separates: Cow::Borrowed("a microscope: the cold shape"),
    source: Cow::Borrowed("the paper's mirror stands 220 um above its substrate when cold"),
};

impl Effect for InitialCurl {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], _: &Moment) -> f64 {
        x + p[0]
    }
}
