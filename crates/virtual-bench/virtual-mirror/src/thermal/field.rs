//! Temperatures, and the drive that heats.

use crate::per_actuator::PerActuator;

/// Bodies shared by the four beams, in this order in a field's last row.
pub(crate) const PLATE: usize = 0;
pub(crate) const FRAME: usize = 1;
pub(crate) const PACKAGE: usize = 2;

/// Temperatures above ambient (K) or their rates (K/s): one row a cell from the substrate to the plate, each with its
/// four actuators, and a last row for plate, frame and package, so that sums of fields are one loop.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field(Vec<PerActuator>);

impl Field {
    pub(crate) fn zero(cells: usize) -> Self {
        Self(vec![PerActuator::ZERO; cells + 1])
    }

    pub(crate) fn rows(&self) -> &[PerActuator] {
        &self.0
    }

    pub(crate) fn rows_mut(&mut self) -> &mut [PerActuator] {
        &mut self.0
    }

    pub(crate) fn beams(&self) -> &[PerActuator] {
        &self.0[..self.0.len() - 1]
    }

    pub(crate) fn lumps(&self) -> &PerActuator {
        &self.0[self.0.len() - 1]
    }

    /// `base` plus a combination of other fields.
    pub(crate) fn combine<const K: usize>(&mut self, base: &Self, terms: [(f64, &Self); K]) {
        let n = self.0.len();
        let terms = terms.map(|(factor, field)| (factor, &field.0[..n]));
        for (i, (out, base)) in self.0.iter_mut().zip(&base.0).enumerate() {
            *out = terms
                .iter()
                .fold(*base, |sum, (factor, field)| sum + field[i] * *factor);
        }
    }
}

/// The drive during a step: held, or moving in a straight line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drive {
    pub(crate) from: PerActuator,
    pub(crate) to: PerActuator,
}

impl Drive {
    /// The same volts for the whole step.
    pub(crate) fn held(volts: PerActuator) -> Self {
        Self {
            from: volts,
            to: volts,
        }
    }

    /// What it does between two fractions of the step.
    pub(crate) fn part(&self, start: f64, end: f64) -> Self {
        Self {
            from: self.at(start),
            to: self.at(end),
        }
    }

    /// Volts at a fraction of the step.
    pub(crate) fn at(&self, fraction: f64) -> PerActuator {
        self.from + (self.to - self.from) * fraction
    }
}
