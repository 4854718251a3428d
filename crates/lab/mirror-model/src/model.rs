//! A whole mirror's model: shared parameters, what differs between its four actuators, and where it all came from.

use crate::effect::Active;
use crate::{Device, Parameters, PistonModel, Preset, Symbol};
use std::collections::BTreeMap;

/// How many actuators a mirror has.
pub const ACTUATORS: usize = 4;

/// A model as it is stored and handed around.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// The preset that it starts from.
    pub preset: Preset,
    /// The parameters that the four actuators share.
    pub parameters: Parameters,
    /// One standard deviation of each parameter for which it is known, in that parameter's unit.
    pub standard_errors: BTreeMap<Symbol, f64>,
    /// What was measured of parameters apart from any session, as of the cold resistance with an ohmmeter: fits weigh it as
    /// one more reading.
    pub measured: BTreeMap<Symbol, Measured>,
    /// Parameters that are known for each actuator; they take the place of the shared value.
    pub by_actuator: BTreeMap<Symbol, [f64; ACTUATORS]>,
    /// The effects that it has beyond eqs. 1-9, in the order in which they act.
    pub effects: Vec<Active>,
    /// What is known of the mirror apart from any session.
    pub device: Device,
    /// What it was fitted to.
    pub provenance: Provenance,
}

/// A measured value of a parameter, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// What was measured; above 0.
    pub value: f64,
    /// One standard deviation of it; above 0.
    pub error: f64,
}

/// Where a model came from. All of it is for people; nothing is computed from it.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Provenance {
    /// The mirror that was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// When, as the measurement files state it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// The measurement files.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
    /// Root mean square of the displacement left unexplained.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_rms_um: Option<f64>,
    /// How it was made, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

impl From<Preset> for Model {
    fn from(preset: Preset) -> Self {
        let standard_errors = preset
            .identified()
            .map(|(symbol, found)| (symbol, found.standard_error))
            .into_iter()
            .collect();
        Self {
            preset,
            parameters: preset.parameters(),
            standard_errors,
            measured: BTreeMap::new(),
            by_actuator: BTreeMap::new(),
            effects: Vec::new(),
            device: Device::default(),
            provenance: Provenance {
                note: Some(preset.description().into()),
                ..Provenance::default()
            },
        }
    }
}

impl Model {
    /// One actuator's chain.
    ///
    /// # Panics
    /// If `index` is not below [`ACTUATORS`].
    pub fn actuator(&self, index: usize) -> PistonModel {
        let mut parameters = self.parameters;
        for (&symbol, values) in &self.by_actuator {
            parameters.set(symbol, values[index]);
        }
        PistonModel { parameters }
    }

    /// Whether no actuator feels another, and the mirror goes where their displacements take it in the mean: what changes one
    /// actuator changes its own current, and its own share of the displacement, only.
    pub fn has_independent_actuators(&self) -> bool {
        self.effects.iter().all(|active| {
            let effect = &active.effect;
            !effect.info().acts.on_the_mirror() && !effect.looks_at_other_actuators()
        })
    }

    /// The four actuators' chains.
    pub fn actuators(&self) -> [PistonModel; ACTUATORS] {
        std::array::from_fn(|index| self.actuator(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_actuators_own_value_takes_the_place_of_the_shared_one() {
        let mut model = Model::from(Preset::Paper);
        model
            .by_actuator
            .insert(Symbol::ColdResistance, [350.0, 355.0, 365.0, 370.0]);
        let resistances = model
            .actuators()
            .map(|actuator| actuator.resistance_ohm(0.0));
        assert_eq!(resistances, [350.0, 355.0, 365.0, 370.0]);
        assert_eq!(
            model.actuator(2).parameters.thermal_resistance_k_per_w,
            5.7e3
        );
    }

    #[test]
    fn a_refitted_preset_knows_its_standard_error() {
        assert!(Model::from(Preset::Paper).standard_errors.is_empty());
        assert!(Model::from(Preset::PaperRefit).standard_errors[&Symbol::ThermalResistance] > 0.0);
    }
}
