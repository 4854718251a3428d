//! What a file may cost: its size, its lines, and the memory that its rows take.

use std::fs::{self, File};
use std::io::{BufWriter, Write};

use measurement::{InputError, MeasurementFile, Row, Session};
use tempfile::tempdir;

const HEADER: &str = "t_s,V_V,z_um\n";

#[track_caller]
fn refuses(text: &str, message: &str) {
    let said = MeasurementFile::parse("bad.csv", text)
        .unwrap_err()
        .to_string();
    assert!(said.contains(message), "{said}");
}

#[test]
fn lines_that_never_end() {
    let long = "1".repeat(1 << 20);
    refuses(&long, "bad.csv:1: this line is longer than 64 KB");
    refuses(
        &format!("{HEADER}1,0,0\n2,0,{long}\n"),
        "bad.csv:3: this line is longer",
    );
    let comments = format!("# {}\n", "word ".repeat(10_000)).repeat(30);
    refuses(&comments, "the comments are longer");
}

#[test]
fn a_file_of_more_than_is_read() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("huge.csv");
    // No byte of it is on the disk, and none is to be read.
    let file = File::create(&path).unwrap();
    file.set_len(1 << 40).unwrap();
    let error = Session::load(&[&path]).unwrap_err();
    assert!(matches!(error, InputError::TooLarge { .. }), "{error}");
    file.set_len(100_000_000).unwrap();
    let said = Session::load(&[&path]).unwrap_err().to_string();
    assert!(said.contains("this line is longer"), "{said}");
    let said = Session::load(&["/dev/zero"]).unwrap_err().to_string();
    assert!(said.contains("is a device"), "{said}");
}

#[test]
fn a_folder_with_a_pipe_in_it_is_not_waited_for() {
    let folder = tempdir().unwrap();
    let pipe = folder.path().join("a.csv");
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
    let said = Session::load(&[folder.path()]).unwrap_err().to_string();
    assert!(said.contains("a.csv' is a pipe"), "{said}");
}

/// The most memory that this process has had (bytes).
fn most_memory() -> usize {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let kb = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"));
    kb.unwrap().parse::<usize>().unwrap() * 1024
}

#[test]
fn memory_is_that_of_the_rows() {
    const ROWS: usize = 400_000;
    let folder = tempdir().unwrap();
    let path = folder.path().join("long.csv");
    let mut file = BufWriter::new(File::create(&path).unwrap());
    file.write_all(HEADER.as_bytes()).unwrap();
    for row in 0..ROWS {
        let z_um = 80.0 + (row % 7) as f64 * 0.1;
        writeln!(file, "{:.4},{},{z_um:.3}", row as f64 * 1e-4, 2.0).unwrap();
    }
    file.flush().unwrap();
    let before = most_memory();
    let session = Session::load(&[&path]).unwrap();
    let took = most_memory() - before;
    let rows = session.files[0].1.rows.len();
    println!(
        "{rows} rows of a file of {:.1} MB took {:.1} MB, {:.0} bytes each",
        fs::metadata(&path).unwrap().len() as f64 / 1e6,
        took as f64 / 1e6,
        took as f64 / rows as f64
    );
    assert_eq!(rows, ROWS);
    // A list grows by doubling: old and new one, three times the rows, while it moves. The checks' lists of numbers take
    // less.
    assert!(took < 3 * ROWS * size_of::<Row>(), "{took} bytes");
}
