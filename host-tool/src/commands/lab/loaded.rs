//! What the commands of the lab read before they compute.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use identification::Dataset;
use input_file::MOST_WRITTEN;
use measurement::{Device, Session};
use mirror_model::effect::{Effect, Formula};
use mirror_model::{Model, ModelFileError, Preset};

use crate::cli::LabInput;
use crate::error::ToolError;
use crate::names::nearest;
use crate::verbosity::say;
use crate::working::while_working;

/// A model, and a session as it sees it.
pub(super) struct Loaded {
    pub(super) model: Model,
    pub(super) data: Dataset,
    pub(super) files: Vec<String>,
}

impl Loaded {
    pub(super) fn load(input: &LabInput) -> Result<Self, ToolError> {
        Ok(Self::new(model_and_session(input)?))
    }

    /// The same, of a session that something can be fitted to.
    pub(super) fn load_to_fit(input: &LabInput) -> Result<Self, ToolError> {
        let (model, session) = model_and_session(input)?;
        session.check_points()?;
        Ok(Self::new((model, session)))
    }

    fn new((model, session): (Model, Session)) -> Self {
        let files = session.files.iter().map(|(name, _)| name.clone()).collect();
        Self {
            model,
            data: Dataset::new(&session),
            files,
        }
    }
}

/// A model, and the session that is measured on what it describes.
pub(super) fn model_and_session(input: &LabInput) -> Result<(Model, Session), ToolError> {
    let model = model(&input.model)?;
    let device = Device {
        highest_v: model.parameters.drive_limit_v,
        cold_ohm: model.parameters.cold_resistance_ohm,
    };
    let session = while_working("reading", false, || Session::load_of(&input.files, &device))?;
    warn(&session.flaws());
    Ok((model, session))
}

/// The preset of this name, or else the model in the file of this path.
///
/// # Errors
/// Where there is neither, or the file holds no model.
pub(crate) fn model(name_or_path: &str) -> Result<Model, ToolError> {
    Model::load(name_or_path).map_err(|error| match error {
        ModelFileError::NotFound { name } => {
            let presets = Preset::ALL.map(Preset::name);
            ToolError::NoSuchModel {
                nearest: nearest(&name, presets),
                name,
                presets: presets.join(", "),
            }
        }
        error => error.into(),
    })
}

/// Tells which files are not whole.
pub(crate) fn warn(flaws: &[String]) {
    for flaw in flaws {
        say(format_args!("warning: {flaw}"));
    }
}

/// An effect that a user described in a file.
pub(super) fn own_effect(path: &Path) -> Result<Arc<dyn Effect>, ToolError> {
    let text = input_file::read_text(path, MOST_WRITTEN)?;
    Ok(Arc::new(Formula::parse(
        &path.display().to_string(),
        &text,
    )?))
}

/// Where simulated mirrors are kept: `XDG_CACHE_HOME`, else `~/.cache`, else the temporary directory.
pub(super) fn cache_directory() -> PathBuf {
    let home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache"));
    std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(home)
        .unwrap_or_else(std::env::temp_dir)
        .join("mirror-diagnosis")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_is_not_there_is_told_with_the_preset_that_is_meant() {
        for (name, told) in [
            ("pape", "there is no model `pape`; did you mean `paper`?"),
            ("papr-refit", "did you mean `paper-refit`?"),
            ("fitted.toml", "there is no model `fitted.toml`"),
        ] {
            let said = model(name).expect_err(name).to_string();
            assert!(said.ends_with(told), "{said}");
        }
        assert!(model("paper").is_ok());
    }
}
