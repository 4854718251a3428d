//! Variable projection (Golub and Pereyra 1973): the residuals as a function of the unknowns that enter nonlinearly alone. In every trial of
//! these the linear stages are the best there are.

use std::cell::RefCell;
use std::rc::Rc;

use least_squares::{DifferenceStep, Problem};
use nalgebra::DVector;

use super::films::Films;
use super::heaters;
use super::linear::{Displacements, LinearStages, MemoryTerms};
use super::thermal::Thermal;
use super::timeline::TimeStep;
use super::unknowns::Unknowns;

/// Difference step of a coordinate: far above the rounding of thousands of time steps, and far below one.
const DIFFERENCE: f64 = 1e-4;

/// What a round of the fit takes as known from the one before: readings without the plate's own motion, and what drives memory.
pub(super) struct Estimate {
    pub(super) held: Vec<TimeStep>,
    pub(super) memory: Displacements,
    pub(super) films: Films,
}

/// The thermal stages forward, at the end of every time step.
pub(super) struct Heated {
    pub(super) places_um: Vec<f64>,
    /// Standardised residuals of the resistances.
    resistances: Vec<f64>,
}

/// All stages forward, at the end of every time step.
pub(super) struct Forward {
    pub(super) heated: Rc<Heated>,
    pub(super) memory: Rc<MemoryTerms>,
    pub(super) linear: LinearStages,
}

impl Forward {
    pub(super) fn displacements_um(&self) -> impl Iterator<Item = f64> {
        self.linear.predict(&self.heated.places_um, &self.memory)
    }
}

/// The standardised residuals of all readings, predicted less measured: of the displacement, and of the resistances.
pub(super) fn residuals(held: &[TimeStep], forward: &Forward) -> Vec<f64> {
    let steps = held.iter().zip(forward.displacements_um());
    let displacement = steps.filter_map(|(step, z_um)| {
        let read = step.displacement?;
        Some((z_um - read.z_um) / read.standard_deviation_um)
    });
    let resistances = forward.heated.resistances.iter().copied();
    displacement.chain(resistances).collect()
}

/// What was computed last, and of which unknowns.
struct Last<T>(Option<(Unknowns, Rc<T>)>);

impl<T> Default for Last<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> Last<T> {
    /// What was computed last, if it was of unknowns alike in what it depends on; else what `compute` makes now.
    fn or_compute(
        &mut self,
        unknowns: &Unknowns,
        are_alike: impl Fn(&Unknowns, &Unknowns) -> bool,
        compute: impl FnOnce() -> T,
    ) -> Rc<T> {
        if let Some((of, last)) = &self.0
            && are_alike(of, unknowns)
        {
            return last.clone();
        }
        let computed = Rc::new(compute());
        self.0 = Some((*unknowns, computed.clone()));
        computed
    }
}

/// The residuals of a round of the fit as a function of its coordinates. Most columns of a Jacobian change either heat or memory: the other
/// is as it was.
pub(super) struct Projection<'a> {
    thermal: &'a Thermal,
    estimate: &'a Estimate,
    heated: RefCell<Last<Heated>>,
    memory: RefCell<Last<MemoryTerms>>,
}

impl<'a> Projection<'a> {
    pub(super) fn new(thermal: &'a Thermal, estimate: &'a Estimate) -> Self {
        Self {
            thermal,
            estimate,
            heated: RefCell::default(),
            memory: RefCell::default(),
        }
    }

    /// The stages forward with these unknowns and the linear stages that are best with them.
    pub(super) fn forward(&self, unknowns: &Unknowns) -> Option<Forward> {
        let Estimate {
            held,
            memory,
            films,
        } = self.estimate;
        let Thermal {
            top_um, highest_v, ..
        } = *self.thermal;
        let mut heated = self.heated.borrow_mut();
        let heated = heated.or_compute(unknowns, Unknowns::heats_like, || {
            let rises = self.thermal.rises(unknowns);
            Heated {
                places_um: self.thermal.places_um(unknowns, &rises),
                resistances: heaters::residuals(held, &rises),
            }
        });
        let mut terms = self.memory.borrow_mut();
        let memory = terms.or_compute(unknowns, Unknowns::remembers_like, || {
            MemoryTerms::new(held, (top_um, highest_v), unknowns, memory)
        });
        let linear = LinearStages::fit(held, top_um, &heated.places_um, &memory, *films)?;
        Some(Forward {
            heated,
            memory,
            linear,
        })
    }
}

impl Problem for Projection<'_> {
    fn residuals(&self, coordinates: &DVector<f64>) -> Option<DVector<f64>> {
        let forward = self.forward(&Unknowns::at(coordinates))?;
        Some(DVector::from_vec(residuals(&self.estimate.held, &forward)))
    }

    fn difference_step(&self) -> DifferenceStep {
        DifferenceStep::Absolute(DIFFERENCE)
    }
}
