//! The built-in effects.

use super::{
    Effect, Heater, Info, Moment, Step, Strengths, Timing, ambient_drift, creep, crosstalk,
    electrostatic_pull, end_stop, expansion_temperature, film_tcr, gap_heat_loss,
    heat_loss_temperature, hysteresis, initial_curl, quadratic_tcr, radiation, resonance,
    sensor_drift, sensor_gain, sensor_lag, sensor_nonlinearity, sensor_offset, series_resistance,
    softening, squeeze_film, substrate_warming, supply_sag, thermal_lag,
};
use std::sync::Arc;

/// The built-in effects, in the order of the chain.
static BUILT_IN: [&dyn Effect; 25] = [
    &series_resistance::SeriesResistance,
    &supply_sag::SupplySag,
    &film_tcr::FilmTcr,
    &quadratic_tcr::QuadraticTcr,
    &heat_loss_temperature::HEAT_LOSS_TEMPERATURE,
    &radiation::Radiation,
    &gap_heat_loss::GapHeatLoss,
    &crosstalk::Crosstalk,
    &substrate_warming::SubstrateWarming,
    &ambient_drift::AMBIENT_DRIFT,
    &thermal_lag::ThermalLag,
    &expansion_temperature::ExpansionTemperature,
    &softening::Softening,
    &initial_curl::InitialCurl,
    &electrostatic_pull::ElectrostaticPull,
    &end_stop::EndStop,
    &hysteresis::OF_ACTUATORS,
    &creep::Creep,
    &resonance::Resonance,
    &squeeze_film::SqueezeFilm,
    &sensor_offset::SensorOffset,
    &sensor_drift::SENSOR_DRIFT,
    &sensor_gain::SensorGain,
    &sensor_nonlinearity::SensorNonlinearity,
    &sensor_lag::SensorLag,
];

/// Lets the built-in effects, which live for ever, stand where any effect does.
struct BuiltIn(&'static dyn Effect);

impl Effect for BuiltIn {
    fn info(&self) -> &Info {
        self.0.info()
    }
    fn output(&self, parameters: &[f64], input: f64, state: &[f64], moment: &Moment) -> f64 {
        self.0.output(parameters, input, state, moment)
    }
    fn form(&self) -> &str {
        self.0.form()
    }
    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        self.0.other_forms()
    }
    fn states(&self) -> usize {
        self.0.states()
    }
    fn looks_at_displacement(&self) -> bool {
        self.0.looks_at_displacement()
    }
    fn looks_at_other_actuators(&self) -> bool {
        self.0.looks_at_other_actuators()
    }
    fn is_of_time(&self) -> bool {
        self.0.is_of_time()
    }
    fn timing(&self) -> Option<Timing> {
        self.0.timing()
    }
    fn is_course(&self) -> bool {
        self.0.is_course()
    }
    fn is_inverted(&self) -> bool {
        self.0.is_inverted()
    }
    fn strengths_in(&self, heater: &Heater) -> Option<Strengths> {
        self.0.strengths_in(heater)
    }
    fn advance(&self, parameters: &[f64], state: &mut [f64], step: &Step) {
        self.0.advance(parameters, state, step);
    }
}

/// The built-in effects, in the order of the chain.
pub fn built_in() -> Vec<Arc<dyn Effect>> {
    BUILT_IN
        .iter()
        .map(|&effect| Arc::new(BuiltIn(effect)) as Arc<dyn Effect>)
        .collect()
}

/// The built-in effect of this id, in the first of its forms.
pub fn find(id: &str) -> Option<Arc<dyn Effect>> {
    built_in().into_iter().find(|effect| effect.info().id == id)
}

/// An effect in all of its forms, itself first.
pub fn forms(effect: &Arc<dyn Effect>) -> Vec<Arc<dyn Effect>> {
    let others = effect.other_forms().iter();
    let others = others.map(|&form| Arc::new(BuiltIn(form)) as Arc<dyn Effect>);
    std::iter::once(effect.clone()).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page that lists them for whoever writes a model file.
    #[test]
    fn the_page_of_model_files_has_every_effect_with_its_stage_and_forms() {
        let page = include_str!("../../../../../docs/reference/model-files.md");
        for effect in built_in() {
            let id = format!("`{}`", effect.info().id);
            let row = page.lines().find(|line| {
                let mut cells = line.split(" | ");
                line.starts_with("| `") && cells.next().is_some_and(|ids| ids.contains(&id))
            });
            let row = row.unwrap_or_else(|| panic!("no row has {id}"));
            assert!(
                row.contains(&format!(" | {} |", effect.info().stage)),
                "{row}"
            );
            let forms = forms(&effect);
            for form in forms.iter().filter(|_| forms.len() > 1) {
                assert!(
                    row.contains(&format!("`{}`", form.form())),
                    "{}: {row}",
                    form.form()
                );
            }
        }
    }
}
