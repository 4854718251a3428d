//! The stop of an emulated board: a byte into a FIFO, which comes back from another once a control tick has carried it out.

use std::fs::File;
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

use board_sockets::stop_fifos;
use rustix::fs::OFlags;
use tokio::io::AsyncReadExt;
use tokio::net::unix::pipe;
use tokio::time::timeout;

/// What a stop is, of a board that takes any byte for one.
const STOP: u8 = 0x18;
/// A board answers within a tick; after this long another tool has taken the answer, and the board is told again.
const REPEAT: Duration = Duration::from_millis(100);

/// An answer may be another tool's, which asked at the same time: it tells as well that the board has stopped, and what was
/// written here stops it again within a tick.
pub(super) async fn by_fifo(socket: &Path) -> io::Result<()> {
    let [to_board, from_board] = stop_fifos(socket);
    let mut answers = pipe::Receiver::from_file(emptied(&from_board)?)?;
    let stops = pipe::OpenOptions::new().open_sender(to_board)?;
    loop {
        match stops.try_write(&[STOP]) {
            // So many stops wait that there is no room for one more.
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            written => drop(written?),
        }
        if let Ok(answer) = timeout(REPEAT, answers.read_u8()).await {
            return answer.map(drop);
        }
    }
}

/// The FIFO of answers, without those that nobody waited for any more.
fn emptied(from_board: &Path) -> io::Result<File> {
    let nonblocking = OFlags::NONBLOCK.bits() as i32;
    let mut options = File::options();
    let mut answers = options
        .read(true)
        .custom_flags(nonblocking)
        .open(from_board)?;
    let mut old = [0; 64];
    loop {
        match answers.read(&mut old) {
            Ok(1..) => {}
            Ok(0) => return Ok(answers),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(answers),
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Write;
    use std::path::PathBuf;
    use std::thread;

    use rustix::fs::{CWD, Mode, mkfifoat};
    use tempfile::TempDir;

    use super::super::find::{Found, Place};
    use super::super::stop::stop;
    use super::*;

    /// A board's FIFOs, open at the board's end as QEMU opens them.
    fn fifos(directory: &TempDir) -> (Found, File, File) {
        let path = directory.path().join("a.sock");
        let [to_board, from_board] = stop_fifos(&path).map(|fifo: PathBuf| {
            mkfifoat(CWD, &fifo, Mode::RUSR | Mode::WUSR).expect("a new FIFO");
            let both = File::options().read(true).write(true).open(fifo);
            both.expect("it opens")
        });
        let found = Found {
            name: "a".to_owned(),
            place: Place::Socket { path },
        };
        (found, to_board, from_board)
    }

    #[tokio::test]
    async fn an_old_answer_is_none_and_a_board_that_gives_none_is_told_again() {
        let directory = tempfile::tempdir().expect("a directory");
        let (found, mut to_board, mut from_board) = fifos(&directory);
        // Left behind by a tool that was killed.
        from_board.write_all(&[STOP; 100]).expect("room");
        let board = thread::spawn(move || {
            let mut byte = [0];
            // The answer to the first is taken by somebody else; the tool tells the board again.
            for _ in 0..2 {
                to_board.read_exact(&mut byte).expect("a stop");
                assert_eq!(byte, [STOP]);
            }
            from_board.write_all(&byte).expect("room");
            from_board
        });
        assert!(stop(&found).await.expect("it answers"));
        board.join().expect("it was told twice");
    }

    #[tokio::test]
    async fn a_full_fifo_is_a_stop_that_waits() {
        let directory = tempfile::tempdir().expect("a directory");
        let (found, mut to_board, mut from_board) = fifos(&directory);
        let [path, _] = stop_fifos(&directory.path().join("a.sock"));
        let flood = pipe::OpenOptions::new().open_sender(path).expect("a FIFO");
        let mut waiting = 0;
        while let Ok(written) = flood.try_write(&[0; 4096]) {
            waiting += written;
        }
        let board = thread::spawn(move || {
            let mut bytes = vec![0; waiting + 1];
            to_board.read_exact(&mut bytes).expect("stops");
            let own = bytes[waiting];
            from_board.write_all(&[own]).expect("room");
            (to_board, from_board)
        });
        assert!(stop(&found).await.expect("it answers"));
        board.join().expect("it was told");
    }

    #[tokio::test]
    async fn without_a_board_behind_it_a_fifo_is_no_way_and_a_file_is_none() {
        let directory = tempfile::tempdir().expect("a directory");
        let (found, to_board, from_board) = fifos(&directory);
        drop((to_board, from_board));
        assert!(!stop(&found).await.expect("nobody is there"));
        for fifo in stop_fifos(&directory.path().join("a.sock")) {
            fs::remove_file(&fifo).expect("it goes");
            fs::write(&fifo, "precious").expect("a file");
        }
        assert!(!stop(&found).await.expect("nobody is there"));
        let [file, _] = stop_fifos(&directory.path().join("a.sock"));
        assert_eq!(fs::read(file).expect("it is still there"), b"precious");
    }
}
