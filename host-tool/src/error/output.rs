//! Why a file is not written, or not to its end.

use std::io;
use std::path::PathBuf;

/// Why a file is not written, or not to its end.
#[derive(Debug, thiserror::Error, miette::Diagnostic, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[expect(missing_docs, reason = "each message says what its fields are")]
pub enum OutputError {
    #[error("{} is there and is not a file", path.display())]
    #[diagnostic(help("choose the name of a file"))]
    NotAFile { path: PathBuf },

    #[error("{} is there and is not a folder", path.display())]
    #[diagnostic(help("choose the name of a folder; one that is not there is made"))]
    NotAFolder { path: PathBuf },

    #[error("{} already exists", path.display())]
    #[diagnostic(help("choose another name, or replace it with --force"))]
    FileExists { path: PathBuf },

    #[error("{} is a measurement that this reads, and would be lost", path.display())]
    #[diagnostic(help("choose another name; --force does not replace what is read"))]
    IsRead { path: PathBuf },

    #[error("{} is named twice, for two files that this makes", path.display())]
    #[diagnostic(help("give each a name of its own"))]
    SameName { path: PathBuf },

    #[error("{} cannot be written: {source}", path.display())]
    #[diagnostic(help("{}", remedy(source.kind())))]
    Write { path: PathBuf, source: io::Error },

    #[error("{} cannot be written any further: {source}. It holds {rows} rows or more", path.display())]
    #[diagnostic(help(
        "what it holds can be read, with a warning that it was cut short; make room on the disk before the next one"
    ))]
    CutShort {
        path: PathBuf,
        rows: usize,
        source: io::Error,
    },

    #[error("{} is gone: something removed or renamed it while it was written", path.display())]
    #[diagnostic(help(
        "what was written into it went with it; do it again, and leave the file and its folder until that ends"
    ))]
    Gone { path: PathBuf },

    #[error("{} is being written by another tool", path.display())]
    #[diagnostic(help("wait until that has ended, or choose another name"))]
    BeingWritten { path: PathBuf },

    #[error("the board keeps the new calibration, but {unwritten}")]
    #[diagnostic(help("{}", kept_remedy(calibration)))]
    BesidesKept {
        unwritten: String,
        calibration: CalibrationText,
    },

    #[error("{} would hold SVG under a name that says otherwise", path.display())]
    #[diagnostic(help(
        "name it .svg; browsers show it, and `rsvg-convert` makes other formats of it"
    ))]
    PictureName { path: PathBuf },

    #[error("{} would hold a page that no browser shows under that name", path.display())]
    #[diagnostic(help("name it .html"))]
    PageName { path: PathBuf },
}

/// Where the text of a calibration is that the board keeps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CalibrationText {
    /// Where it was asked for, if it was.
    AsAsked,
    /// In a file that nobody asked for.
    Elsewhere(PathBuf),
    /// In the board alone.
    Nowhere,
}

fn kept_remedy(calibration: &CalibrationText) -> String {
    match calibration {
        CalibrationText::AsAsked => {
            "make room on the disk before the next one; what else was asked for is done, as the report says".to_owned()
        }
        CalibrationText::Elsewhere(path) => format!(
            "the calibration is in {}: make room on the disk, and move it to where it is to stay",
            path.display()
        ),
        CalibrationText::Nowhere => {
            "no command reads it back from the board: make room on the disk, and calibrate again for a file of it".to_owned()
        }
    }
}

fn remedy(kind: io::ErrorKind) -> &'static str {
    match kind {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "make room on the disk, or choose a file on another one"
        }
        _ => "choose a file in a directory that exists and that you may write to",
    }
}

#[cfg(test)]
mod tests {
    use miette::Diagnostic;

    use super::*;

    #[test]
    fn a_full_disk_has_another_remedy_than_a_wrong_name() {
        let help = |kind: io::ErrorKind| {
            let (path, source) = (PathBuf::from("page.html"), kind.into());
            let error = OutputError::Write { path, source };
            error.help().expect("what to do").to_string()
        };
        assert!(help(io::ErrorKind::StorageFull).contains("make room"));
        assert!(help(io::ErrorKind::NotFound).contains("a directory that exists"));
    }
}
