//! Output files: found out to be writable before the work begins, and whole or not there at all.

use std::fs::Permissions;
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use crate::error::ToolError;

/// A file that can be written, found out before the work begins. What had its name keeps it
/// until the new content is whole.
pub(crate) struct NewFile {
    path: PathBuf,
    replace: bool,
    draft: NamedTempFile,
}

impl NewFile {
    /// A file at `path`; one that is there already is kept, unless it may be replaced.
    pub(crate) fn create(path: PathBuf, replace: bool) -> Result<Self, ToolError> {
        if path.exists() && !path.is_file() {
            return Err(ToolError::NotAFile { path });
        }
        if path.exists() && !replace {
            return Err(ToolError::FileExists { path });
        }
        let directory = path
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty());
        match draft(directory.unwrap_or(Path::new("."))) {
            Ok(draft) => Ok(Self {
                path,
                replace,
                draft,
            }),
            Err(source) => Err(ToolError::Write { path, source }),
        }
    }

    /// Gives the file its content and its name.
    pub(crate) fn write(mut self, text: &str) -> Result<PathBuf, ToolError> {
        let written = self.draft.write_all(text.as_bytes()).and_then(|()| {
            let kept = if self.replace {
                self.draft.persist(&self.path)
            } else {
                self.draft.persist_noclobber(&self.path)
            };
            kept.map_err(|error| error.error)
        });
        match written {
            Ok(_) => Ok(self.path),
            Err(source) => Err(ToolError::Write {
                path: self.path,
                source,
            }),
        }
    }
}

/// A file without a name that is seen, with the permissions that any new file has.
fn draft(directory: &Path) -> io::Result<NamedTempFile> {
    let permissions = Permissions::from_mode(0o666);
    Builder::new()
        .permissions(permissions)
        .tempfile_in(directory)
}
