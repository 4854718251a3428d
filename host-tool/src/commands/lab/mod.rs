//! The model lab: where a model fails, which physics is missing, and the error after adding it.

mod effects;
mod picture;
mod positioning;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use identification::Dataset;
use indicatif::ProgressBar;
use measurement::{Device, Session};
use mirror_model::Model;
use mirror_model::effect::{Effect, Formula};

pub(super) use effects::run as effect;

use crate::cli::{LabInput, ModelOutput};
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::report;

/// A model, and a session as it sees it.
struct Lab {
    model: Model,
    data: Dataset,
    files: Vec<String>,
}

impl Lab {
    fn load(input: &LabInput) -> Result<Self, ToolError> {
        let model = Model::load(&input.model)?;
        let device = Device {
            highest_v: model.parameters.drive_limit_v,
            cold_ohm: model.parameters.cold_resistance_ohm,
        };
        let session = Session::load_of(&input.files, &device)?;
        let files = session.files.iter().map(|(name, _)| name.clone()).collect();
        Ok(Self {
            model,
            data: Dataset::new(&session),
            files,
        })
    }
}

/// `fit`: the parameters that the measurements can tell.
pub(super) fn fit(input: &LabInput, output: ModelOutput, json: bool) -> Result<(), ToolError> {
    let lab = Lab::load(input)?;
    let file = NewFile::create(output.output, output.force)?;
    let (model, fitted) = while_working("fitting", json, || {
        identification::fit_and_report(&lab.model, &lab.data, &lab.files)
    })?;
    file.write(&model.to_toml())?;
    report::print(&fitted, json);
    Ok(())
}

/// `identify`: what a calibration needs, as far as the measurements support it.
pub(super) fn identify(input: &LabInput, output: ModelOutput, json: bool) -> Result<(), ToolError> {
    let lab = Lab::load(input)?;
    let file = NewFile::create(output.output, output.force)?;
    let (model, found) = while_working("identifying", json, || {
        identification::identify(&lab.model, &lab.data, &lab.files)
    })?;
    file.write(&model.to_toml())?;
    report::print(&found, json);
    Ok(())
}

/// `compare`: where the model fails, as it is.
pub(super) fn compare(
    input: &LabInput,
    picture: Option<PathBuf>,
    json: bool,
) -> Result<(), ToolError> {
    let lab = Lab::load(input)?;
    let comparison = identification::compare(&lab.model, &lab.data)?;
    report::print(&comparison, json);
    if json && picture.is_none() {
        return Ok(());
    }
    let curves = picture::Curves::new(&lab.model, &lab.data)?;
    if !json {
        report::write(&curves.in_the_terminal());
    }
    if let Some(path) = picture {
        let file = NewFile::create(path, true)?;
        let drawn = file.write(&curves.as_svg()?)?;
        eprintln!("drawn in {}", drawn.display());
    }
    Ok(())
}

/// `diagnose`: which effect is missing.
pub(super) fn diagnose(input: &LabInput, own: &[PathBuf], json: bool) -> Result<(), ToolError> {
    let lab = Lab::load(input)?;
    let own = own
        .iter()
        .map(|path| own_effect(path))
        .collect::<Result<Vec<_>, _>>()?;
    let cache = cache_directory();
    let what = "trying every effect, and mirrors with nothing hidden (kept for the next time)";
    let found = while_working(what, json, || {
        diagnosis::diagnose(&lab.model, &lab.data, &own, Some(&cache))
    })?;
    report::print(&found, json);
    Ok(())
}

/// An effect that a user described in a file.
fn own_effect(path: &Path) -> Result<Arc<dyn Effect>, ToolError> {
    let text = fs::read_to_string(path).map_err(|source| ToolError::Read {
        path: path.to_owned(),
        source,
    })?;
    Ok(Arc::new(Formula::parse(
        &path.display().to_string(),
        &text,
    )?))
}

/// Where simulated mirrors are kept: `XDG_CACHE_HOME`, else `~/.cache`, else the temporary directory.
fn cache_directory() -> PathBuf {
    let home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache"));
    std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(home)
        .unwrap_or_else(std::env::temp_dir)
        .join("mirror-diagnosis")
}

/// Runs `work` while something moves on the screen.
pub(super) fn while_working<T>(what: &'static str, quiet: bool, work: impl FnOnce() -> T) -> T {
    let spinner = spinner(what, quiet);
    let done = work();
    spinner.finish_and_clear();
    done
}

/// Something that moves on the screen.
pub(super) fn spinner(what: &'static str, quiet: bool) -> ProgressBar {
    let spinner = if quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new_spinner()
    };
    spinner.set_message(what);
    spinner.enable_steady_tick(Duration::from_millis(100));
    spinner
}
