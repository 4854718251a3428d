//! Output files: found out to be writable before the work begins, and whole or not there at all.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use crate::error::OutputError;

/// A file that can be written, found out before the work begins. What had its name keeps it
/// until the new content is whole. Nothing is there meanwhile: work that a signal ends leaves nothing behind.
pub(crate) struct NewFile {
    path: PathBuf,
    replace: bool,
}

/// Files that one command makes must have names of their own, however they are spelled: the second would be refused, or replace the
/// first, once the work is done.
///
/// # Errors
/// Where two are the same.
pub(crate) fn apart(paths: &[&Option<PathBuf>]) -> Result<(), OutputError> {
    let asked: Vec<&PathBuf> = paths.iter().copied().flatten().collect();
    let places: Vec<PathBuf> = asked.iter().map(|path| place(path)).collect();
    let same = (0..asked.len()).find(|index| places[..*index].contains(&places[*index]));
    match same {
        Some(index) => Err(OutputError::SameName {
            path: asked[index].clone(),
        }),
        None => Ok(()),
    }
}

/// Where a file is to be, whatever way leads there: a link in its own place would be replaced, those on the way are followed.
fn place(path: &Path) -> PathBuf {
    let folder = folder(path).canonicalize();
    match folder.ok().zip(path.file_name()) {
        Some((folder, name)) => folder.join(name),
        None => path.to_owned(),
    }
}

/// The folder that a file is in, or is to be in.
fn folder(path: &Path) -> &Path {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

impl NewFile {
    /// A file at `path`; one that is there already is kept, unless it may be replaced.
    pub(crate) fn create(path: PathBuf, replace: bool) -> Result<Self, OutputError> {
        if path.exists() && !path.is_file() {
            return Err(OutputError::NotAFile { path });
        }
        if path.exists() && !replace {
            return Err(OutputError::FileExists { path });
        }
        // What would be a file for the draft and a folder for the system fails now, and not once the work is done.
        if path.as_os_str().as_encoded_bytes().ends_with(b"/") {
            let source = io::ErrorKind::NotADirectory.into();
            return Err(OutputError::Write { path, source });
        }
        match draft(&path).and_then(|draft| has_room(draft.as_file())) {
            Ok(()) => Ok(Self { path, replace }),
            Err(source) => Err(OutputError::Write { path, source }),
        }
    }

    /// The same, where it takes the place of none of these files or of those in these folders, which are measurements: whatever may be
    /// replaced, they cannot be made again.
    pub(crate) fn beside(self, read: &[PathBuf]) -> Result<Self, OutputError> {
        let resolved = |path: &Path| path.canonicalize().ok();
        let Some(own) = resolved(&self.path) else {
            return Ok(self);
        };
        let is_csv = own
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
        let is_read = |read: &PathBuf| {
            resolved(read).is_some_and(|read| read == own || is_csv && own.parent() == Some(&read))
        };
        match read.iter().any(is_read) {
            true => Err(OutputError::IsRead { path: self.path }),
            false => Ok(self),
        }
    }

    /// A picture, whose name must not say that it is of another format than SVG.
    pub(crate) fn picture(path: PathBuf, replace: bool) -> Result<Self, OutputError> {
        match path.extension() {
            Some(extension) if !extension.eq_ignore_ascii_case("svg") => {
                Err(OutputError::PictureName { path })
            }
            _ => Self::create(path, replace),
        }
    }

    /// A page for a browser, which shows one only under a name that says so.
    pub(crate) fn page(path: PathBuf, replace: bool) -> Result<Self, OutputError> {
        let is_html = |extension: &OsStr| {
            ["html", "htm"]
                .iter()
                .any(|one| extension.eq_ignore_ascii_case(one))
        };
        match path.extension() {
            Some(extension) if is_html(extension) => Self::create(path, replace),
            _ if path.is_dir() => Err(OutputError::NotAFile { path }),
            _ => Err(OutputError::PageName { path }),
        }
    }

    /// Gives the file its content and its name.
    pub(crate) fn write(self, text: &str) -> Result<PathBuf, OutputError> {
        let draft = draft(&self.path);
        self.write_by(draft, text)
    }

    fn write_by(
        self,
        draft: io::Result<NamedTempFile>,
        text: &str,
    ) -> Result<PathBuf, OutputError> {
        let written = draft.and_then(|mut draft| {
            // As the file that it is, whose errors do not name the draft, which nobody knows.
            draft.as_file_mut().write_all(text.as_bytes())?;
            let kept = match self.replace {
                true => draft.persist(&self.path),
                false => draft.persist_noclobber(&self.path),
            };
            kept.map(drop).map_err(|error| error.error)
        });
        match written {
            Ok(()) => Ok(self.path),
            // Another tool was done before this one.
            Err(source) if source.kind() == io::ErrorKind::AlreadyExists => {
                Err(OutputError::FileExists { path: self.path })
            }
            Err(source) => Err(OutputError::Write {
                path: self.path,
                source,
            }),
        }
    }
}

/// So much goes onto a disk before the work begins (bytes): as much as a calibration has. A full one takes an empty file nevertheless.
const ROOM: usize = 1 << 14;

/// Whether a disk has room, found out in a file that goes again.
fn has_room(mut file: &File) -> io::Result<()> {
    file.write_all(&[0; ROOM])
}

/// An empty file beside `path`, which goes again unless it is given that name.
fn draft(path: &Path) -> io::Result<NamedTempFile> {
    Builder::new().make_in(folder(path), |name| File::create_new(name))
}

/// A file that has a name while its content grows, so that what is there outlives this process.
#[derive(Debug)]
pub(crate) struct GrowingFile {
    /// The name that it has in the end.
    path: PathBuf,
    /// The name that it has meanwhile, where another file has that one until then.
    beside: Option<PathBuf>,
}

impl NewFile {
    /// Gives the file a name before it has its content: its own, or, where a file has it that is to be replaced, that with
    /// `.new` behind it. Who writes such a file has it locked; one that is not is what a tool has left that was killed, and goes.
    pub(crate) fn grow(self) -> Result<(GrowingFile, File), OutputError> {
        let draft = draft(&self.path).map_err(|source| OutputError::Write {
            path: self.path.clone(),
            source,
        })?;
        // A file that came there since this was asked for is another tool's.
        let beside = (self.replace && self.path.exists()).then(|| {
            let mut name = self.path.clone().into_os_string();
            name.push(".new");
            PathBuf::from(name)
        });
        if let Some(beside) = &beside {
            remove_left(beside)?;
        }
        let growing = GrowingFile {
            path: self.path,
            beside,
        };
        // Where there are no locks, a file of this name is taken for another's.
        let _ = draft.as_file().try_lock();
        match draft.persist_noclobber(growing.name()) {
            Ok(file) => Ok((growing, file)),
            Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => {
                Err(OutputError::FileExists {
                    path: growing.name().to_owned(),
                })
            }
            Err(error) => Err(OutputError::Write {
                path: growing.name().to_owned(),
                source: error.error,
            }),
        }
    }
}

/// Removes a file that nobody writes any more.
///
/// # Errors
/// Where somebody does, or it cannot be removed.
fn remove_left(path: &Path) -> Result<(), OutputError> {
    let path = path.to_owned();
    let removed = match File::open(&path).map(|left| left.try_lock()) {
        Ok(Ok(())) => fs::remove_file(&path),
        Ok(Err(TryLockError::WouldBlock)) => return Err(OutputError::BeingWritten { path }),
        Ok(Err(TryLockError::Error(_))) => return Ok(()),
        Err(error) => Err(error),
    };
    match removed {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(OutputError::Write { path, source })
        }
        _ => Ok(()),
    }
}

impl GrowingFile {
    /// The name that it has now.
    pub(crate) fn name(&self) -> &Path {
        self.beside.as_ref().unwrap_or(&self.path)
    }

    /// Takes it away.
    pub(crate) fn discard(&self) -> Result<(), OutputError> {
        fs::remove_file(self.name()).map_err(|source| OutputError::Write {
            path: self.name().to_owned(),
            source,
        })
    }

    /// Puts a whole file with this text at the name that it has in the end, and takes it away.
    pub(crate) fn replace(&self, text: &str) -> Result<PathBuf, OutputError> {
        let path = NewFile::create(self.path.clone(), true)?.write(text)?;
        if let Some(beside) = &self.beside {
            fs::remove_file(beside).map_err(|source| OutputError::Write {
                path: beside.clone(),
                source,
            })?;
        }
        Ok(path)
    }

    /// Makes sure that it has its name still.
    ///
    /// # Errors
    /// Where somebody has removed or renamed it.
    pub(crate) fn stays(&self) -> Result<(), OutputError> {
        let path = self.name().to_owned();
        match fs::metadata(&path).map_err(|error| error.kind()) {
            Err(io::ErrorKind::NotFound) => Err(OutputError::Gone { path }),
            _ => Ok(()),
        }
    }

    /// Gives it the name that it has in the end.
    pub(crate) fn finish(self) -> Result<PathBuf, OutputError> {
        self.stays()?;
        match self.beside.map(|beside| fs::rename(beside, &self.path)) {
            None | Some(Ok(())) => Ok(self.path),
            Some(Err(source)) => Err(OutputError::Write {
                path: self.path,
                source,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What goes wrong is told as the system tells it, and of the file that was asked for.
    fn tells(error: &OutputError, asked: &Path, system: &io::Error) {
        let OutputError::Write { path, source } = error else {
            panic!("{error}");
        };
        assert_eq!(path, asked);
        assert_eq!(source.to_string(), system.to_string());
    }

    #[test]
    fn a_page_has_a_name_that_browsers_show() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["report.html", "REPORT.HTM"] {
            assert!(NewFile::page(folder.path().join(name), false).is_ok());
        }
        for name in ["report.txt", "report", "report.pdf"] {
            let said = NewFile::page(folder.path().join(name), false).err();
            assert!(matches!(said, Some(OutputError::PageName { .. })), "{name}");
        }
        let itself = NewFile::page(folder.path().to_owned(), false).err();
        assert!(matches!(itself, Some(OutputError::NotAFile { .. })));
    }

    #[test]
    fn one_file_under_two_spellings_is_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let [plain, other] = ["x.toml", "y.toml"].map(|name| folder.path().join(name));
        let winding = folder.path().join(".").join("x.toml");
        let refused = apart(&[&Some(plain.clone()), &None, &Some(winding)]);
        assert!(matches!(refused, Err(OutputError::SameName { .. })));
        assert!(apart(&[&Some(plain), &Some(other)]).is_ok());
        let here = ["x.toml", "./x.toml"].map(|name| Some(PathBuf::from(name)));
        assert!(apart(&[&here[0], &here[1]]).is_err());
    }

    #[test]
    fn a_file_that_came_meanwhile_is_kept_and_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("proposed.toml");
        let [first, second] = [(); 2].map(|()| NewFile::create(path.clone(), false));
        first.expect("free").write("first").expect("written");
        let refused = second.expect("free").write("second").expect_err("taken");
        assert!(
            matches!(refused, OutputError::FileExists { .. }),
            "{refused}"
        );
        assert_eq!(fs::read_to_string(&path).expect("kept"), "first");
    }

    #[test]
    fn no_error_names_the_draft() {
        let folder = tempfile::tempdir().expect("a folder");
        let asked = folder.path().join("missing").join("page.html");
        let error = NewFile::create(asked.clone(), false).err();
        let missing = fs::metadata(&asked).expect_err("it is not there");
        tells(&error.expect("no such folder"), &asked, &missing);

        let asked = folder.path().join("page.html");
        let file = NewFile::create(asked.clone(), false).expect("it can be written");
        let mut draft = draft(&asked).expect("it can be written");
        let read_only = File::open(draft.path()).expect("it is there");
        let refused = (&read_only).write(b"x").expect_err("for reading only");
        *draft.as_file_mut() = read_only;
        tells(
            &file.write_by(Ok(draft), "x").expect_err("for reading only"),
            &asked,
            &refused,
        );
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
    }

    /// A signal that ends the tool while it computes would leave behind whatever is there then.
    #[test]
    fn before_it_is_written_nothing_is_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = NewFile::create(folder.path().join("page.html"), false).expect("a file");
        let count = || fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(count(), 0);
        file.write("x").expect("it is written");
        assert_eq!(count(), 1);
    }

    #[test]
    fn a_full_disk_is_found_out_before_the_work_begins() {
        let full = File::options().write(true).open("/dev/full");
        let told = has_room(&full.expect("a device")).expect_err("no room");
        assert_eq!(told.kind(), io::ErrorKind::StorageFull);
    }

    /// Both asked for it while it was not there.
    #[test]
    fn of_two_that_make_the_same_file_the_second_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("r.csv");
        let [first, second] =
            [(); 2].map(|()| NewFile::create(path.clone(), false).expect("it is not there"));
        let (growing, _file) = first.grow().expect("it is not there");
        let said = second.grow().expect_err("it is there");
        assert!(matches!(said, OutputError::FileExists { .. }), "{said}");
        assert_eq!(growing.finish().expect("it is the first one's"), path);
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }

    #[test]
    fn others_may_do_with_it_what_they_may_do_with_any_new_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let any = File::create_new(folder.path().join("any")).expect("a file");
        let file = NewFile::create(folder.path().join("page.html"), false).expect("a file");
        let written = file.write("x").expect("it is written");
        let permissions =
            |metadata: io::Result<fs::Metadata>| metadata.expect("it is there").permissions();
        assert_eq!(
            permissions(fs::metadata(written)),
            permissions(any.metadata())
        );
    }
}
