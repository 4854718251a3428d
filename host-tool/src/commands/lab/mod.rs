//! The model lab: where a model fails, which physics is missing, and the error after adding it.

mod effects;
mod found;
mod import;
mod loaded;
mod page;
mod picture;
mod positioning;

use diagnosis::Asked;
use identification::prediction::predict;
use lab_view::Curves;

pub(super) use effects::{run as effect, shown_effect};
pub(super) use found::Identified;
pub(super) use import::run as import;
pub(super) use loaded::{model, warn};
pub(super) use page::{replay, report};

pub(crate) use self::found::Diagnosed;
use self::loaded::{Loaded, cache_directory, own_effect};
use crate::cli::{Compare, Diagnose, LabInput, ModelOutput};
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::report as printed;
use crate::verbosity::note;
use crate::working::while_working;

/// `fit`: the parameters that the measurements can tell.
pub(super) fn fit(input: &LabInput, output: ModelOutput, json: bool) -> Result<(), ToolError> {
    let lab = Loaded::load_to_fit(input)?;
    let file = NewFile::create(output.output, output.force)?.beside(&input.files)?;
    let (model, fitted) = while_working("fitting", json, || {
        identification::fit_and_report(&lab.model, &lab.data, &lab.files)
    })?;
    file.write(&model.to_toml())?;
    printed::print(&fitted, json);
    Ok(())
}

/// `identify`: what a calibration needs, as far as the measurements support it.
pub(super) fn identify(input: &LabInput, output: ModelOutput, json: bool) -> Result<(), ToolError> {
    let lab = Loaded::load_to_fit(input)?;
    let file = NewFile::create(output.output, output.force)?.beside(&input.files)?;
    let (model, found) = while_working("identifying", json, || {
        identification::identify(&lab.model, &lab.data, &lab.files)
    })?;
    file.write(&model.to_toml())?;
    printed::print(&Identified(&found), json);
    Ok(())
}

/// `compare`: where the model fails, as it is.
pub(super) fn compare(ask: Compare, json: bool) -> Result<(), ToolError> {
    let create = |path| NewFile::picture(path, ask.force)?.beside(&ask.lab.files);
    let picture = ask.picture.map(create).transpose()?;
    let lab = Loaded::load(&ask.lab)?;
    let comparison = identification::compare(&lab.model, &lab.data)?;
    printed::print(&comparison, json);
    if json && picture.is_none() {
        return Ok(());
    }
    let predicted = predict(&lab.model, &lab.data)?;
    let curves = Curves::new(&lab.data, &predicted);
    if !json {
        printed::write(&picture::in_the_terminal(&curves));
    }
    if let Some(file) = picture {
        let drawn = file.write(&picture::as_svg(&curves))?;
        note(format_args!("drawn in {}", drawn.display()));
    }
    Ok(())
}

/// `diagnose`: which effect is missing.
pub(super) fn diagnose(ask: Diagnose, json: bool) -> Result<(), ToolError> {
    let create = |path| NewFile::create(path, ask.force)?.beside(&ask.lab.files);
    let propose = ask.propose.map(create).transpose()?;
    let lab = Loaded::load_to_fit(&ask.lab)?;
    let own = ask.effect.iter().map(|path| own_effect(path));
    let own = own.collect::<Result<Vec<_>, _>>()?;
    let asked = Asked {
        facts: ask.facts,
        measurements: ask.measurements,
    };
    let cache = cache_directory();
    let what = "trying every effect, and mirrors that lack nothing (kept for the next time)";
    let (found, gains) = while_working(what, json, || {
        diagnosis::diagnose_with_gains(&lab.model, &lab.data, &own, Some(&cache), asked)
    })?;
    printed::print(&Diagnosed::new(&found, gains), json);
    match (propose, &found.proposal) {
        (Some(file), Some(proposal)) => {
            let written = file.write(&proposal.text)?;
            note(format_args!("proposed in {}", written.display()));
        }
        (Some(_), None) => note("no formula is proposed, and none is written"),
        (None, _) => {}
    }
    Ok(())
}
