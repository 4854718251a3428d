//! The table `[device]`: what is known of the mirror.

use super::error::ModelFileError;
use super::reader::ModelReader;
use crate::device::{Device, Fact, Film, Quantity, Segment};
use crate::{Model, Symbol};
use serde::Deserialize;

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StoredDevice {
    leads: Option<StoredFact>,
    rest_height: Option<StoredFact>,
    plate_side: Option<StoredFact>,
    plate_thickness: Option<StoredFact>,
    plate_loss: Option<StoredFact>,
    segments: Option<toml::Spanned<Vec<StoredSegment>>>,
}

#[derive(Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a fact: { value = 6.5, unit = \"ohm\", tolerance = 0.5, source = \"drawing\" }"
)]
struct StoredFact {
    value: toml::Spanned<f64>,
    unit: toml::Spanned<String>,
    tolerance: toml::Spanned<f64>,
    source: toml::Spanned<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredSegment {
    name: String,
    length: StoredFact,
    width: StoredFact,
    films: toml::Spanned<Vec<StoredFilm>>,
    loss: Option<StoredFact>,
    #[serde(default)]
    heated: bool,
    #[serde(default)]
    turned: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredFilm {
    film: toml::Spanned<String>,
    thickness: StoredFact,
}

impl ModelReader<'_> {
    /// What a file states of the mirror whose model it is.
    pub(super) fn device(
        &self,
        stored: &StoredDevice,
        model: &Model,
    ) -> Result<Device, ModelFileError> {
        let of_the_mirror = [
            (Quantity::Leads, &stored.leads),
            (Quantity::RestHeight, &stored.rest_height),
            (Quantity::PlateSide, &stored.plate_side),
            (Quantity::PlateThickness, &stored.plate_thickness),
            (Quantity::PlateLoss, &stored.plate_loss),
        ];
        let stated = of_the_mirror.into_iter().filter_map(|(quantity, fact)| {
            let fact = fact.as_ref()?;
            Some(self.fact(quantity, fact).map(|fact| (quantity, fact)))
        });
        let device = Device {
            facts: stated.collect::<Result<_, _>>()?,
            segments: self.segments(stored.segments.as_ref())?,
        };
        if let Some(stored) = &stored.leads {
            self.are_a_part_of_the_heaters(stored, &device, model)?;
        }
        Ok(device)
    }

    fn segments(
        &self,
        stored: Option<&toml::Spanned<Vec<StoredSegment>>>,
    ) -> Result<Vec<Segment>, ModelFileError> {
        let Some(stored) = stored else {
            return Ok(Vec::new());
        };
        let segments: Vec<Segment> = stored
            .get_ref()
            .iter()
            .map(|segment| self.segment(segment))
            .collect::<Result<_, _>>()?;
        if !(1..=Segment::MOST).contains(&segments.len()) {
            let message = format!("a beam has 1 to {} segments", Segment::MOST);
            let help = "list them from the anchor to the plate, or leave all of them out".into();
            return Err(self.wrong(message, help, stored.span()));
        }
        if !segments.iter().any(|segment| segment.heated) {
            let message = "no segment is heated".into();
            let help = "write heated = true where the heater runs".into();
            return Err(self.wrong(message, help, stored.span()));
        }
        Ok(segments)
    }

    fn segment(&self, stored: &StoredSegment) -> Result<Segment, ModelFileError> {
        let films: Vec<(Film, Fact)> = stored
            .films
            .get_ref()
            .iter()
            .map(|film| self.film(film))
            .collect::<Result<_, _>>()?;
        if !(1..=Segment::MOST_FILMS).contains(&films.len()) {
            let message = format!("a segment has 1 to {} films", Segment::MOST_FILMS);
            let help = "list them from the substrate's side up".into();
            return Err(self.wrong(message, help, stored.films.span()));
        }
        let loss = stored.loss.as_ref();
        Ok(Segment {
            name: stored.name.clone(),
            length: self.fact(Quantity::Length, &stored.length)?,
            width: self.fact(Quantity::Width, &stored.width)?,
            films,
            loss: loss
                .map(|fact| self.fact(Quantity::Loss, fact))
                .transpose()?,
            heated: stored.heated,
            turned: stored.turned,
        })
    }

    fn film(&self, stored: &StoredFilm) -> Result<(Film, Fact), ModelFileError> {
        let name = stored.film.get_ref();
        let film = Film::ALL.into_iter().find(|film| film.name() == name);
        let film = film.ok_or_else(|| {
            let known = Film::ALL.map(Film::name).join(", ");
            let message = format!("there is no film called '{name}'");
            self.wrong(
                message,
                format!("the films are {known}"),
                stored.film.span(),
            )
        })?;
        Ok((film, self.fact(Quantity::Thickness, &stored.thickness)?))
    }

    fn fact(&self, quantity: Quantity, stored: &StoredFact) -> Result<Fact, ModelFileError> {
        let (name, unit) = (quantity.name(), quantity.unit());
        if stored.unit.get_ref() != unit {
            let message = format!("{name} is in {unit}, not in '{}'", stored.unit.get_ref());
            let help = "convert value and tolerance and change the unit".into();
            return Err(self.wrong(message, help, stored.unit.span()));
        }
        let fact = Fact {
            value: *stored.value.get_ref(),
            tolerance: *stored.tolerance.get_ref(),
            source: stored.source.get_ref().clone(),
        };
        let (low, high) = quantity.range();
        if !(low..=high).contains(&fact.value) {
            let message = format!("{name} = {} {unit} is impossible", fact.value);
            let help = format!("it must lie between {low} and {high} {unit}");
            return Err(self.wrong(message, help, stored.value.span()));
        }
        if !(fact.tolerance.is_finite() && fact.tolerance > 0.0) {
            let message = format!("the tolerance of {name} must be a number above 0");
            let help = "write how far the true value may lie from this one at most".into();
            return Err(self.wrong(message, help, stored.tolerance.span()));
        }
        let (lowest, highest) = fact.interval();
        if lowest < low || highest > high {
            let message = format!(
                "{name} may not be {lowest} to {highest} {unit}: it lies between {low} and {high} {unit}"
            );
            let help = "state the middle of the interval that is left, with half its width, or leave it out where it is not known"
                .into();
            return Err(self.wrong(message, help, stored.tolerance.span()));
        }
        if fact.source.trim().is_empty() {
            let message = format!("nothing says how {name} is known");
            let help = "name the source: a drawing, a microscope, an ohmmeter".into();
            return Err(self.wrong(message, help, stored.source.span()));
        }
        Ok(fact)
    }

    /// The cold resistance is that of heater and leads together.
    fn are_a_part_of_the_heaters(
        &self,
        stored: &StoredFact,
        device: &Device,
        model: &Model,
    ) -> Result<(), ModelFileError> {
        let (_, most_ohm) = device.facts[&Quantity::Leads].interval();
        let cold = model.actuators().map(|actuator| actuator.parameters);
        let cold_ohm = cold.map(|parameters| parameters.get(Symbol::ColdResistance));
        let least_ohm = cold_ohm.into_iter().fold(f64::INFINITY, f64::min);
        if most_ohm < least_ohm {
            return Ok(());
        }
        let message = format!(
            "leads of up to {most_ohm} ohm are no part of R0 = {least_ohm} ohm, which is that of heater and leads together"
        );
        let help = "correct the leads, or state R0 in [parameters]".into();
        Err(self.wrong(message, help, stored.value.span()))
    }
}

#[cfg(test)]
mod tests;
