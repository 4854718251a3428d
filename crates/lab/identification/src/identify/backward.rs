//! What a search has taken in, and the data no longer tell beside what came later.
//!
//! A slow pole that was found as creep is one again once creep is there, in hours or not at all: its weight and its time then say only how
//! fast the mirror drifts, and a calibration would wait for the rest.

use mirror_model::Model;

use super::candidate::Candidate;
use super::{Search, Tried};
use crate::fit::{Fitted, fit_parameters};
use crate::parameter::FreeParameter;

impl Search<'_> {
    /// Gives a candidate up that was kept, if the data do not tell it any more. `None` if they do.
    pub(super) fn reconsider(&mut self, candidate: Candidate) -> Option<Tried> {
        let added = candidate.parameters_in(&self.best.model)?;
        let because = self.doubt(&self.best, candidate, &added)?;
        let (model, free) = candidate.taken_out_of(&self.best);
        let best = fit_parameters(&model, self.data, &self.data.values(), &free).ok()?;
        self.cost = best.cost(self.data);
        self.best = best;
        Some(Tried {
            what: candidate.name(),
            kept: false,
            because: format!("beside what was found later, {because}"),
            shown_by: None,
        })
    }
}

impl Candidate {
    /// Its parameters in a model that has it.
    fn parameters_in(self, model: &Model) -> Option<Vec<FreeParameter>> {
        match self {
            Self::Pole(pole, _) => Some(pole.parameters().to_vec()),
            Self::Effect(id, _) => {
                let index = model.effects.iter().position(|active| active.id() == id)?;
                let count = model.effects[index].values.len();
                let parameters = (0..count).map(|value| FreeParameter::Effect(index, value));
                Some(parameters.collect())
            }
        }
    }

    /// A model without it, and what is fitted then.
    fn taken_out_of(self, fitted: &Fitted) -> (Model, Vec<FreeParameter>) {
        let mut model = fitted.model.clone();
        let free = fitted.free.iter().copied();
        match self {
            Self::Pole(pole, _) => {
                model.parameters.set(pole.weight, 0.0);
                let others = free.filter(|it| !pole.parameters().contains(it));
                (model, others.collect())
            }
            Self::Effect(id, _) => {
                let taken = model.effects.iter().position(|active| active.id() == id);
                let taken = taken.unwrap_or(model.effects.len());
                model.effects.retain(|active| active.id() != id);
                let others = free.filter_map(|parameter| match parameter {
                    FreeParameter::Effect(index, _) if index == taken => None,
                    FreeParameter::Effect(index, value) if index > taken => {
                        Some(FreeParameter::Effect(index - 1, value))
                    }
                    other => Some(other),
                });
                (model, others.collect())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use experiments::Experiment;
    use mirror_model::effect::{Active, find};
    use mirror_model::{Preset, Symbol};
    use virtual_mirror::MirrorConfig;
    use virtual_sessions::{Instruments, measure};

    use super::super::candidate::{CANDIDATES, SLOW};
    use super::*;
    use crate::Dataset;

    fn slow_pole() -> Candidate {
        let is_slow = |candidate: &Candidate| matches!(candidate, Candidate::Pole(pole, _) if pole.time == SLOW.time);
        CANDIDATES.into_iter().find(is_slow).expect("a candidate")
    }

    /// As a fit left it on mirrors that creep: most of the heat comes in hours, and the rest is as warm as all of it was.
    #[test]
    fn a_slow_pole_whose_heat_never_comes_is_given_up() {
        let experiments = [
            Experiment::sweep(3.5, 14, 1.0, 1),
            Experiment::step(2.0, 6.0, 5e3).after(5.0),
        ];
        let instruments = Instruments::PositionAndCurrents;
        let session = measure(&MirrorConfig::bench(), &experiments, instruments).expect("possible");
        let data = Dataset::new(&session);
        let mut search =
            Search::new(&Model::from(Preset::Reconciled), &data).expect("a finite answer");
        let (without, weight) = (search.cost, 0.75_f64);
        let model = &mut search.best.model;
        for parameter in &search.best.free {
            if matches!(parameter, FreeParameter::Base(base) if base.symbol() == Symbol::ThermalResistance)
            {
                parameter.shift(model, -(1.0 - weight).ln());
            }
        }
        model.parameters.set(SLOW.weight, weight);
        model.parameters.set(SLOW.time, 2e4);
        search.best.free.extend(SLOW.parameters());
        let tried = search.reconsider(slow_pole()).expect("nothing tells it");
        assert!(!tried.kept, "{tried:?}");
        assert_eq!(search.best.model.parameters.get(SLOW.weight), 0.0);
        assert!(!search.best.free.contains(&SLOW.parameters()[0]));
        // What it stood for is found without it, to where a fit ends.
        assert!(
            search.cost < (1.0 + 1e-3) * without,
            "{} of {without}",
            search.cost
        );
    }

    #[test]
    fn those_behind_an_effect_that_is_taken_out_move_up() {
        let mut model = Model::from(Preset::Paper);
        let usual = |id: &str| Active::usual(find(id).expect("built in"));
        model.effects = ["substrate-warming", "creep", "hysteresis"]
            .map(usual)
            .into();
        let of = |effect: usize| {
            [
                FreeParameter::Effect(effect, 0),
                FreeParameter::Effect(effect, 1),
            ]
        };
        let fitted = Fitted {
            model,
            free: [of(0), of(1), of(2)].concat(),
            residuals: Vec::new(),
        };
        let (model, free) = Candidate::Effect("creep", &[]).taken_out_of(&fitted);
        let left: Vec<&str> = model.effects.iter().map(Active::id).collect();
        assert_eq!(left, ["substrate-warming", "hysteresis"]);
        assert_eq!(free, [of(0), of(1)].concat());
    }
}
