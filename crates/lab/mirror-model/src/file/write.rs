//! A model as the text of a file.

use super::error::FORMAT;
use crate::device::{Device, Fact, Quantity};
use crate::effect::Active;
use crate::parameter::{Entry, TABLE};
use crate::{Measured, Model};
use std::fmt::Write;

impl Model {
    /// The model as a file's text. [`Model::parse`] gives the same model back, to the last bit.
    pub fn to_toml(&self) -> String {
        let mut text = format!(
            "format = {FORMAT}\npreset = \"{}\"\n\n[parameters]\n",
            self.preset.name()
        );
        for entry in &TABLE {
            self.write_parameter(entry, &mut text)
                .expect("writing to a string cannot fail");
        }
        for effect in &self.effects {
            write_effect(effect, &mut text).expect("writing to a string cannot fail");
        }
        write_device(&self.device, &mut text).expect("writing to a string cannot fail");
        let provenance = toml::to_string(&self.provenance).expect("provenance is plain data");
        text + "\n[provenance]\n" + &provenance
    }

    fn write_parameter(&self, entry: &Entry, text: &mut String) -> std::fmt::Result {
        let value = self.parameters.get(entry.symbol);
        write!(
            text,
            "{} = {{ value = {value:?}, unit = \"{}\"",
            entry.name, entry.unit
        )?;
        if let Some(error) = self.standard_errors.get(&entry.symbol) {
            write!(text, ", standard_error = {error:?}")?;
        }
        if let Some(Measured { value: of, error }) = self.measured.get(&entry.symbol) {
            if *of == value {
                write!(text, ", measured = {error:?}")?;
            } else {
                write!(text, ", measured = {{ value = {of:?}, error = {error:?} }}")?;
            }
        }
        if let Some(values) = self.by_actuator.get(&entry.symbol) {
            write!(text, ", actuators = {values:?}")?;
        }
        writeln!(text, " }} # {}", entry.meaning)
    }
}

fn write_effect(active: &Active, text: &mut String) -> std::fmt::Result {
    let info = active.effect.info();
    writeln!(
        text,
        "\n[[effects]] # {}: {}\nid = {}",
        info.title,
        info.equation,
        quoted(&info.id)
    )?;
    if !active.effect.form().is_empty() {
        writeln!(text, "form = {}", quoted(active.effect.form()))?;
    }
    if let Some(definition) = active.effect.definition() {
        writeln!(text, "definition = {}", quoted(definition))?;
    }
    writeln!(text, "[effects.parameters]")?;
    for ((p, value), error) in info
        .parameters
        .iter()
        .zip(&active.values)
        .zip(&active.standard_errors)
    {
        write!(
            text,
            "{} = {{ value = {value:?}, unit = {}",
            quoted(&p.symbol),
            quoted(&p.unit)
        )?;
        if let Some(error) = error {
            write!(text, ", standard_error = {error:?}")?;
        }
        writeln!(text, " }}")?;
    }
    Ok(())
}

fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// Nothing where nothing is known.
fn write_device(device: &Device, text: &mut String) -> std::fmt::Result {
    if *device == Device::default() {
        return Ok(());
    }
    writeln!(text, "\n[device]")?;
    for (quantity, known) in &device.facts {
        writeln!(text, "{} = {}", quantity.name(), fact(*quantity, known))?;
    }
    for segment in &device.segments {
        writeln!(
            text,
            "\n[[device.segments]]\nname = {}",
            quoted(&segment.name)
        )?;
        writeln!(text, "length = {}", fact(Quantity::Length, &segment.length))?;
        writeln!(text, "width = {}", fact(Quantity::Width, &segment.width))?;
        writeln!(text, "films = [")?;
        for (film, thickness) in &segment.films {
            let thickness = fact(Quantity::Thickness, thickness);
            let film = quoted(film.name());
            writeln!(text, "  {{ film = {film}, thickness = {thickness} }},")?;
        }
        writeln!(text, "]")?;
        if let Some(loss) = &segment.loss {
            writeln!(text, "loss = {}", fact(Quantity::Loss, loss))?;
        }
        writeln!(
            text,
            "heated = {}\nturned = {}",
            segment.heated, segment.turned
        )?;
    }
    Ok(())
}

fn fact(quantity: Quantity, fact: &Fact) -> String {
    let Fact {
        value,
        tolerance,
        source,
    } = fact;
    let (unit, source) = (quoted(quantity.unit()), quoted(source));
    format!("{{ value = {value:?}, unit = {unit}, tolerance = {tolerance:?}, source = {source} }}")
}
