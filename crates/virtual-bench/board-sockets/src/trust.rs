//! Whether other users could stand behind a socket, or have put it there.

use std::fs::{self, DirBuilder, Metadata};
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, PermissionsExt};
use std::path::Path;

use crate::untrusted::{Untrusted, unseen};

/// Read, write and search for the user, nothing for anybody else.
const PRIVATE: u32 = 0o700;
/// Write for the group or for everybody.
const WRITABLE_BY_OTHERS: u32 = 0o022;

/// Number of the user that this process acts for.
pub(crate) fn user() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// Whether what belongs to the user of this number is ours.
pub fn is_ours(owner: u32) -> bool {
    owner == user()
}

/// Makes a folder that nobody else can look into, whatever the umask, or makes sure that the one that is
/// there may be trusted.
///
/// # Errors
/// Where it cannot be made, or is not trusted.
pub fn make_folder(path: &Path) -> Result<(), Untrusted> {
    let made = DirBuilder::new().mode(PRIVATE).recursive(true).create(path);
    made.map_err(|error| unseen(path, error))?;
    check_folder(path)
}

/// Makes sure that a folder is ours, and that nobody else can put anything into it.
///
/// # Errors
/// Where that is not so, or it is not there.
pub fn check_folder(path: &Path) -> Result<(), Untrusted> {
    check(path, "folder", |found| found.is_dir())
}

/// Makes sure that a socket is ours, and that nobody else could have put it there or can write to it.
///
/// # Errors
/// Where that is not so, or it is not there.
pub fn check_socket(path: &Path) -> Result<(), Untrusted> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    check_folder(folder)?;
    check(path, "socket", |found| found.file_type().is_socket())
}

fn check(
    path: &Path,
    wanted: &'static str,
    is_wanted: fn(&Metadata) -> bool,
) -> Result<(), Untrusted> {
    let path = path.to_owned();
    // Of the thing itself, not of what a link leads to.
    let found = match fs::symlink_metadata(&path) {
        Ok(found) => found,
        Err(error) => return Err(unseen(&path, error)),
    };
    let (owner, mode) = (found.uid(), found.permissions().mode() & 0o777);
    if found.is_symlink() {
        Err(Untrusted::Link(path))
    } else if !is_wanted(&found) {
        Err(Untrusted::Kind { wanted, path })
    } else if !is_ours(owner) {
        Err(Untrusted::Foreign { owner, path })
    } else if mode & WRITABLE_BY_OTHERS != 0 {
        Err(Untrusted::Writable { mode, path })
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::Permissions;
    use std::os::unix::fs::{chown, symlink};
    use std::os::unix::net::UnixListener;
    use std::path::PathBuf;
    use tempfile::TempDir;

    /// `nobody`, or any other user that is not root.
    const STRANGER: u32 = 65534;

    fn set_mode(path: &Path, mode: u32) {
        fs::set_permissions(path, Permissions::from_mode(mode)).expect("ours");
    }

    /// A folder of ours with a socket of ours in it.
    fn board() -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        set_mode(folder.path(), PRIVATE);
        let socket = folder.path().join("a.sock");
        UnixListener::bind(&socket).expect("a socket");
        set_mode(&socket, 0o600);
        (folder, socket)
    }

    #[test]
    fn what_is_ours_alone_is_trusted_readable_or_not() {
        let (folder, socket) = board();
        check_socket(&socket).expect("ours");
        set_mode(folder.path(), 0o755);
        check_socket(&socket).expect("others may look, and no more");
    }

    #[test]
    fn what_others_may_write_to_is_not() {
        let (folder, socket) = board();
        for mode in [0o720, 0o702, 0o777] {
            set_mode(folder.path(), mode);
            let refused = check_socket(&socket).expect_err("others may replace the socket");
            let said = refused.to_string();
            assert!(said.contains(&format!("mode {mode:o}")), "{said}");
            assert!(matches!(
                make_folder(folder.path()),
                Err(Untrusted::Writable { .. })
            ));
        }
        set_mode(folder.path(), PRIVATE);
        set_mode(&socket, 0o666);
        let refused = check_socket(&socket);
        assert!(
            matches!(refused, Err(Untrusted::Writable { .. })),
            "{refused:?}"
        );
    }

    #[test]
    fn what_belongs_to_somebody_else_is_not() {
        let (folder, socket) = board();
        if user() == 0 {
            chown(&socket, Some(STRANGER), None).expect("root may");
            let refused = check_socket(&socket);
            assert!(matches!(
                refused,
                Err(Untrusted::Foreign {
                    owner: STRANGER,
                    ..
                })
            ));
            chown(&socket, Some(0), None).expect("root may");
            chown(folder.path(), Some(STRANGER), None).expect("root may");
            let refused = check_socket(&socket);
            assert!(matches!(
                refused,
                Err(Untrusted::Foreign {
                    owner: STRANGER,
                    ..
                })
            ));
        } else {
            let refused = check_folder(Path::new("/"));
            assert!(matches!(refused, Err(Untrusted::Foreign { owner: 0, .. })));
        }
        assert!(is_ours(user()) && !is_ours(user() + 1));
    }

    #[test]
    fn a_link_is_not_followed() {
        let (folder, socket) = board();
        let link = folder.path().join("link.sock");
        symlink(&socket, &link).expect("a link");
        assert!(matches!(check_socket(&link), Err(Untrusted::Link(_))));
        let elsewhere = tempfile::tempdir().expect("a folder");
        let link = elsewhere.path().join("boards");
        symlink(folder.path(), &link).expect("a link");
        assert!(matches!(make_folder(&link), Err(Untrusted::Link(_))));
    }

    #[test]
    fn what_is_no_socket_or_not_there_is_said_to_be_so() {
        let (folder, _socket) = board();
        let file = folder.path().join("b.sock");
        assert!(matches!(check_socket(&file), Err(Untrusted::Unseen { .. })));
        fs::write(&file, "").expect("a file");
        assert!(matches!(check_socket(&file), Err(Untrusted::Kind { .. })));
        assert!(matches!(make_folder(&file), Err(Untrusted::Unseen { .. })));
    }
}
