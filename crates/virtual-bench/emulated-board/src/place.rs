//! Where a board's files lie: its socket, its flash, and what goes with it.

use std::ffi::OsStr;
use std::fs::{self, File, Permissions, TryLockError};
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};

use board_sockets::{is_listening, make_folder};
use tempfile::TempDir;

use crate::start_error::StartError;

/// Where Linux keeps files in memory. A board's time stands still while it writes its flash, and a disk that is busy with
/// something else would keep it from answering for a minute.
const IN_MEMORY: &str = "/dev/shm";

/// A new directory that nobody else can look into, whatever the umask; it goes when it is dropped. In memory, where the
/// system has such a place.
///
/// # Errors
/// Where the system makes none.
pub fn private_directory() -> io::Result<TempDir> {
    let make_in = |folder: &Path| {
        tempfile::Builder::new()
            .prefix("emulated-board-")
            .permissions(Permissions::from_mode(0o700))
            .tempdir_in(folder)
    };
    make_in(Path::new(IN_MEMORY)).or_else(|_| make_in(&std::env::temp_dir()))
}

/// The longest path of a socket (bytes): Linux, unix(7), less the zero that ends it.
const LONGEST_SOCKET: usize = 107;

/// The path of a socket that nobody uses, for a board of this name; one that was left behind is removed.
///
/// # Errors
/// Where it is no name, another board has it, or the folder is not to be trusted.
pub fn claim_socket(directory: &Path, name: &str) -> Result<PathBuf, StartError> {
    let no_name = |reason: String| StartError::Name {
        name: name.to_owned(),
        reason,
    };
    // What would be in another folder, and what is hidden.
    if Path::new(name).file_name() != Some(name.as_ref()) || name.starts_with('.') {
        return Err(no_name(
            "take letters, digits and signs, without a slash or a dot in front".to_owned(),
        ));
    }
    make_folder(directory)?;
    // The emulator works in another directory.
    let socket = fs::canonicalize(directory)?.join(format!("{name}.sock"));
    let too_many = socket.as_os_str().len().saturating_sub(LONGEST_SOCKET);
    if too_many > 0 {
        return Err(no_name(format!(
            "leave out {too_many} characters, for a socket's path has {LONGEST_SOCKET} bytes at most: {}",
            socket.display()
        )));
    }
    if is_listening(&socket) {
        return Err(StartError::NameTaken(name.to_owned()));
    }
    remove(&socket)?;
    Ok(socket)
}

/// Removes a file that was left behind, if there is one.
pub(crate) fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Gives the board its flash: the file `flash`, which is claimed, or one of its own.
pub(crate) fn place_flash(
    directory: &Path,
    flash: Option<&Path>,
) -> Result<Option<FlashClaim>, StartError> {
    let claim = flash.map(|file| FlashClaim::take(file, plant_link::FLASH_BYTES));
    let claim = claim.transpose()?;
    let place = directory.join(OsStr::from_bytes(plant_link::FLASH.to_bytes()));
    let file = flash.unwrap_or(&place);
    if !file.exists() {
        fs::write(
            file,
            vec![plant_link::FLASH_ERASED; plant_link::FLASH_BYTES],
        )?;
    }
    if let Some(file) = flash {
        symlink(fs::canonicalize(file)?, place)?;
    }
    Ok(claim)
}

/// A file that is one board's flash until this is dropped, or the process that has it ends: two boards would overwrite each other's
/// calibration and fault log.
#[derive(Debug)]
pub struct FlashClaim {
    _lock: File,
}

impl FlashClaim {
    /// Claims a file as a flash of so many bytes, before anything is written to it. What is locked is a file beside it, since a flash that is
    /// written becomes another file.
    ///
    /// # Errors
    /// Where it is something else, or another board's flash.
    pub fn take(file: &Path, bytes: usize) -> Result<Self, StartError> {
        check_flash(file, bytes)?;
        let mut beside = fs::canonicalize(file)
            .unwrap_or_else(|_| file.to_owned())
            .into_os_string();
        beside.push(".lock");
        let refused = |reason: String| StartError::Flash {
            path: file.to_owned(),
            reason,
        };
        let lock = File::create(&beside).map_err(|error| refused(error.to_string()))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { _lock: lock }),
            Err(TryLockError::WouldBlock) => Err(refused(
                "another board that runs has it; end that one, or name another file".to_owned(),
            )),
            Err(TryLockError::Error(error)) => Err(refused(error.to_string())),
        }
    }
}

/// Makes sure that a file can be a flash of so many bytes, before anything is written to it: it is one, or is not there yet.
///
/// # Errors
/// Where it is something else.
fn check_flash(file: &Path, bytes: usize) -> Result<(), StartError> {
    let reason = match fs::metadata(file) {
        Ok(found) if !found.is_file() => "it is there and is no file".to_owned(),
        Ok(found) if found.len() != bytes as u64 => format!(
            "it has {} bytes, and this board's flash has {bytes}; name another, or one that is not there yet",
            found.len()
        ),
        Ok(_) => return Ok(()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => match folder(file).is_dir() {
            true => return Ok(()),
            false => format!("there is no folder {}", folder(file).display()),
        },
        Err(error) => error.to_string(),
    };
    let path = file.to_owned();
    Err(StartError::Flash { path, reason })
}

/// The folder that a file is in.
fn folder(file: &Path) -> &Path {
    let parent = file.parent();
    parent
        .filter(|parent| !parent.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_flash_is_left_as_it_is() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("notes.txt");
        check_flash(&file, 4).expect("it is not there yet");
        check_flash(Path::new("a.flash"), 4).expect("nor this");
        fs::write(&file, "notes").expect("ours");
        let own = folder.path().join("own");
        fs::create_dir(&own).expect("ours");
        let said = place_flash(&own, Some(&file)).expect_err("no flash");
        assert!(said.to_string().contains("it has 5 bytes"), "{said}");
        assert_eq!(fs::read(&file).expect("still there"), b"notes");
        check_flash(&file, 5).expect("as long as one");
        for (path, reason) in [
            ("/dev/full", "is no file"),
            ("/", "is no file"),
            ("/nowhere/a.flash", "no folder /nowhere"),
        ] {
            let said = check_flash(Path::new(path), 4).expect_err(path).to_string();
            assert!(said.contains(path) && said.contains(reason), "{said}");
        }
    }

    #[test]
    fn a_flash_is_one_board_s_until_it_ends() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("bench.flash");
        let first = FlashClaim::take(&file, 4).expect("nobody has it");
        let other_name = folder.path().join("link.flash");
        fs::write(&file, [0xff; 4]).expect("ours");
        symlink(&file, &other_name).expect("ours");
        for name in [&file, &other_name] {
            let said = FlashClaim::take(name, 4).expect_err("it is taken");
            assert!(
                said.to_string().contains("another board that runs"),
                "{said}"
            );
        }
        drop(first);
        FlashClaim::take(&other_name, 4).expect("it is free again");
    }

    #[test]
    fn a_name_is_that_of_a_file_in_the_folder() {
        let folder = private_directory().expect("a folder");
        let socket = claim_socket(folder.path(), "a b").expect("a name");
        assert_eq!(socket.file_name(), Some("a b.sock".as_ref()));
        let long = "x".repeat(120);
        for (name, reason) in [
            ("", "without a slash"),
            ("../x", "without a slash"),
            ("a/b", "without a slash"),
            ("a/", "without a slash"),
            ("..", "without a slash"),
            (".a", "a dot in front"),
            (&*long, "characters, for a socket's path"),
        ] {
            let said = claim_socket(folder.path(), name)
                .expect_err(name)
                .to_string();
            assert!(said.contains(reason), "{said}");
        }
    }
}
