//! The umask belongs to a whole process, so this is the only test in its own.

use std::fs;
use std::os::unix::fs::PermissionsExt;

#[test]
fn a_folder_is_private_whatever_the_umask() {
    rustix::process::umask(rustix::fs::Mode::empty());
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("boards");
    board_sockets::make_folder(&folder).expect("a new one");
    let mode = fs::metadata(&folder)
        .expect("it is there")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o700);
    board_sockets::make_folder(&folder).expect("the one that is there");
}
