//! That nobody else gets at an emulated board: with a umask that forbids nothing, its folders, sockets and FIFOs are the
//! user's alone, and QEMU's monitor is there for those only who ask for it.

use std::fs;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::path::{Path, PathBuf};

use hil::Bench;
use rustix::fs::Mode;

/// Read, write and search for anybody but the user.
const OTHERS: u32 = 0o077;

fn main() {
    rustix::process::umask(Mode::empty());
    for has_monitor in [false, true] {
        let mut bench = Bench::changed(|emulation| {
            // The folder of sockets is the emulation's to make.
            emulation.boards_directory.push("boards");
            emulation.has_monitor = has_monitor;
        });
        let socket = PathBuf::from(bench.board());
        let folder = socket.parent().expect("a folder").to_owned();
        let own = bench.emulated_board().expect("emulated").directory();
        let found: Vec<PathBuf> = [folder.as_path(), own]
            .into_iter()
            .flat_map(|folder| fs::read_dir(folder).expect("ours"))
            .map(|entry| entry.expect("an entry").path())
            .chain([folder.clone(), own.to_owned()])
            .collect();
        let links = found.iter().filter(|path| is_link(path)).count();
        // The tools' socket, two FIFOs to the plant, two for stops.
        assert_eq!(
            links,
            usize::from(has_monitor) + 5,
            "FIFOs and sockets: {found:?}"
        );
        for path in found {
            let mode = fs::metadata(&path)
                .expect("it is there")
                .permissions()
                .mode();
            // Nobody else comes to a file in a folder that is private.
            let is_private = mode & OTHERS == 0 || path.is_file();
            assert!(is_private, "{}: {mode:o}", path.display());
        }
        let said = bench.tool(&["status"]);
        assert_eq!(said.code, 0, "{}", said.err);
    }
    println!("\nnobody else gets at an emulated board");
}

/// Whether somebody could speak to the board through it.
fn is_link(path: &Path) -> bool {
    let kind = fs::symlink_metadata(path).expect("it is there").file_type();
    kind.is_socket() || kind.is_fifo()
}
