//! Whether a mirror is one of those that its owner's description draws.

use std::fmt;

use identification::base::identifiable;
use identification::dataset::Dataset;
use identification::parameter::FreeParameter;
use mirror_model::{Model, Symbol};

use super::NullEnsemble;

/// Of the described mirrors' whole spread: a mirror that is further beyond them is another one. An effect that is missing moves these parameters
/// by some percent, and a description within 2 to 5 % spreads them by a third to ten times.
const BEYOND: f64 = 0.1;
/// What films and dimensions tell whatever is missing: how far the beams bend, and how warm a watt makes them.
const TOLD: [Symbol; 2] = [Symbol::CurvatureCoefficient, Symbol::ThermalResistance];

/// A parameter that no described mirror has.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Misdescribed {
    /// Which.
    parameter: String,
    /// As fitted, over that of the described mirror that is nearest.
    times: f64,
}

impl fmt::Display for Misdescribed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameter, times } = self;
        write!(
            f,
            "`[device]` describes other mirrors: {parameter} as fitted is {times:.2} times what the nearest of them has, so all mirrors are taken for \
             possible; look at films, thicknesses and lengths"
        )
    }
}

impl NullEnsemble {
    /// The first parameter of a model fitted to a session that none of the mirrors has.
    pub(crate) fn misdescribed(&self, model: &Model, data: &Dataset) -> Option<Misdescribed> {
        let rows = self.coordinates.row_iter().zip(identifiable(data));
        let mut told = rows.filter(|(_, parameter)| TOLD.contains(&parameter.symbol()));
        told.find_map(|(row, parameter)| {
            let at = FreeParameter::Base(parameter).coordinate(model);
            let (low, high) = (row.min(), row.max());
            let beyond = at - at.clamp(low, high);
            (beyond.abs() > BEYOND * (high - low)).then(|| Misdescribed {
                parameter: parameter.name(),
                // Coordinates of the base are logarithms.
                times: beyond.exp(),
            })
        })
    }
}
