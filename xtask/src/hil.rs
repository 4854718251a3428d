//! The acceptance checks: on emulated boards, or on one that is connected.

use std::ffi::OsStr;
use std::{fs, io};

use anyhow::Result;
use host_tool::board::{Found, find};

use crate::cargo::{run, workspace};
use crate::images::{self, Board};
use crate::test_programs::{self, TestProgram};
use crate::tool;

/// The checks. They need an emulated board's image, or a board.
pub(crate) const PACKAGE: &str = "hil";

/// Everything, each check on an emulated board of its own.
pub(crate) fn on_emulated_boards() -> Result<()> {
    images::build(Board::Mps2)?;
    let names: Vec<String> = fs::read_dir(workspace().join(PACKAGE).join("tests"))?
        .map(|entry| Ok(entry?.path().file_stem().map(OsStr::to_owned)))
        .collect::<io::Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    for check in checks(&names)? {
        run(&mut check.command())?;
    }
    name_real_boards();
    Ok(())
}

/// Builds the tool, and the checks with these names.
fn checks(names: &[String]) -> Result<Vec<TestProgram>> {
    tool::build()?;
    let targets = names
        .iter()
        .flat_map(|name| ["--test".to_owned(), name.clone()]);
    let mut programs = test_programs::build(&targets.collect::<Vec<_>>())?;
    programs.retain(|program| program.package == PACKAGE);
    Ok(programs)
}

/// Says which boards are connected, and how they are checked: that drives their mirrors.
pub(crate) fn name_real_boards() {
    let real: Vec<String> = find()
        .into_iter()
        .filter(Found::is_usb)
        .map(|board| board.name)
        .collect();
    if real.is_empty() {
        println!("real board: skipped, none is connected");
    }
    for name in real {
        println!("real board: skipped; `cargo xtask hil --board {name}` drives the mirror on it");
    }
}

/// What any board must do, on the board `name`; drive and sense too, where `resistors` are known to be on it.
pub(crate) fn on_board(name: &str, resistors: Option<f64>) -> Result<()> {
    let is_there = name.contains('/') || find().iter().any(|board| board.name == name);
    if !is_there {
        println!(
            "skipped: there is no board `{name}`; `host-tool doctor` tells why one is not found"
        );
        return Ok(());
    }
    // What a mirror must do, resistors do not.
    let (test, ohm) = match resistors {
        None => ("acceptance", String::new()),
        Some(ohm) => ("resistors", ohm.to_string()),
    };
    for check in checks(&[test.to_owned()])? {
        let mut command = check.command();
        command.env("MIRROR_BOARD", name);
        if resistors.is_some() {
            command.env("MIRROR_RESISTORS", &ohm);
        }
        run(&mut command)?;
    }
    Ok(())
}
