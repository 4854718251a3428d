//! `effect`: what there is, and adding it to a model or taking it out.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use diagnosis::{Edit, add, remove};
use mirror_model::effect::{Effect, Info, built_in, find, forms};
use serde::Serialize;

use super::loaded::{Loaded, cache_directory, own_effect};
use super::positioning::Positioning;
use crate::cli::EffectCommand;
use crate::error::ToolError;
use crate::names::nearest;
use crate::new_file::NewFile;
use crate::report;
use crate::verbosity::note;
use crate::working::while_working;

/// What `effect new` writes: an effect that works as it stands, to be changed.
const TEMPLATE: &str = include_str!("template.toml");

const REFITTING: &str =
    "refitting, and doing the same to mirrors that lack nothing (kept for the next time)";

#[derive(Serialize)]
struct Edited {
    #[serde(flatten)]
    edit: Edit,
    /// None of a heater on a bench, which positions nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    positioning: Option<Positioning>,
}

/// An effect of one's own that was begun.
#[derive(Serialize)]
struct Begun {
    effect: PathBuf,
}

#[derive(Serialize)]
struct EffectList {
    effects: Vec<Info>,
}

#[derive(Serialize)]
struct ShownEffect {
    #[serde(flatten)]
    effect: Info,
    forms: Vec<Form>,
}

/// One form of an effect; its name is empty where there is one only.
#[derive(Serialize)]
struct Form {
    name: String,
    #[serde(flatten)]
    info: Info,
}

impl From<Arc<dyn Effect>> for ShownEffect {
    fn from(effect: Arc<dyn Effect>) -> Self {
        let form = |form: Arc<dyn Effect>| Form {
            name: form.form().to_owned(),
            info: form.info().clone(),
        };
        Self {
            effect: effect.info().clone(),
            forms: forms(&effect).into_iter().map(form).collect(),
        }
    }
}

pub(crate) fn run(command: EffectCommand, json: bool) -> Result<(), ToolError> {
    match command {
        EffectCommand::List => {
            let effects = built_in()
                .iter()
                .map(|effect| effect.info().clone())
                .collect();
            report::print(&EffectList { effects }, json);
            Ok(())
        }
        EffectCommand::Show { id } => {
            report::print(&ShownEffect::from(named(&id)?), json);
            Ok(())
        }
        EffectCommand::New { output, force } => {
            let effect = NewFile::create(output, force)?.write(TEMPLATE)?;
            note(format_args!(
                "written to {}; change it, and try it with `effect add`",
                effect.display()
            ));
            if json {
                report::write(&report::line(&Begun { effect }));
            }
            Ok(())
        }
        EffectCommand::Add {
            effect,
            lab,
            output,
        } => {
            let (effect, input) = (named(&effect)?, lab);
            let lab = Loaded::load_to_fit(&input)?;
            let file = NewFile::create(output.output, output.force)?.beside(&input.files)?;
            let changed = while_working(REFITTING, json, || {
                add(
                    &lab.model,
                    effect,
                    &lab.data,
                    &lab.files,
                    Some(&cache_directory()),
                )
            })?;
            file.write(&changed.after.to_toml())?;
            let positioning = (!lab.data.is_of_heaters())
                .then(|| Positioning::new(&changed.before, &changed.after));
            let edited = Edited {
                edit: changed.edit,
                positioning,
            };
            report::print(&edited, json);
            Ok(())
        }
        EffectCommand::Remove {
            effect,
            lab,
            output,
        } => {
            let input = lab;
            let lab = Loaded::load_to_fit(&input)?;
            let file = NewFile::create(output.output, output.force)?.beside(&input.files)?;
            let changed = while_working("refitting", json, || {
                remove(&lab.model, &effect, &lab.data, &lab.files)
            })?;
            file.write(&changed.after.to_toml())?;
            let positioning = (!lab.data.is_of_heaters())
                .then(|| Positioning::new(&changed.after, &changed.before));
            let edited = Edited {
                edit: changed.edit,
                positioning,
            };
            report::print(&edited, json);
            Ok(())
        }
    }
}

/// The built-in effect of this id, or the user's own in this file.
fn named(id: &str) -> Result<Arc<dyn Effect>, ToolError> {
    if id.ends_with(".toml") {
        return own_effect(Path::new(id));
    }
    find(id).ok_or_else(|| ToolError::NoSuchEffect {
        id: id.to_owned(),
        nearest: nearest(id, built_in().iter().map(|effect| effect.info().id.clone())),
    })
}

/// What `effect show` prints of a built-in effect.
pub(in crate::commands) fn shown_effect(id: &str) -> Option<String> {
    find(id).map(|effect| ShownEffect::from(effect).to_string())
}

impl fmt::Display for Edited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.edit)?;
        match &self.positioning {
            Some(positioning) => write!(f, "{positioning}"),
            None => Ok(()),
        }
    }
}

impl fmt::Display for EffectList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for effect in &self.effects {
            writeln!(
                f,
                "{:<22} {:<11} {}",
                effect.id,
                effect.stage.to_string(),
                effect.title
            )?;
        }
        Ok(())
    }
}

impl fmt::Display for ShownEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let effect = &self.effect;
        writeln!(f, "{}: {}", effect.id, effect.title)?;
        writeln!(f, "  stage      {}", effect.stage)?;
        for form in &self.forms {
            if !form.name.is_empty() {
                writeln!(f, "  form       {}", form.name)?;
            }
            writeln!(f, "  equation   {}", form.info.equation)?;
            for parameter in form.info.parameters.iter() {
                writeln!(
                    f,
                    "  {:<10} {} to {} {}, usually {}",
                    parameter.symbol,
                    parameter.low,
                    parameter.high,
                    parameter.unit,
                    parameter.start
                )?;
            }
        }
        writeln!(f, "  shows      {}", effect.shows)?;
        writeln!(f, "  separate   {}", effect.separates)?;
        writeln!(f, "  source     {}", effect.source)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::effect::Formula;

    #[test]
    fn the_template_is_an_effect_as_it_stands() {
        assert!(Formula::parse("template.toml", TEMPLATE).is_ok());
    }
}
