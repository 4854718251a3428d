//! The acceptance checks: on emulated boards, or on one that is connected.

use std::ffi::OsStr;
use std::{fs, io};

use anyhow::Result;
use serde_json::Value;

use crate::cargo::{run, workspace};
use crate::images::{self, Board};
use crate::setup;
use crate::test_programs::{self, TestProgram};
use crate::tool;

/// The checks. They need an emulated board's image, or a board.
pub(crate) const PACKAGE: &str = "hil";

/// Everything, each check on an emulated board of its own.
pub(crate) fn on_emulated_boards() -> Result<()> {
    setup::qemu()?;
    tool::build()?;
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
    name_real_boards()
}

/// Builds the checks with these names.
fn checks(names: &[String]) -> Result<Vec<TestProgram>> {
    let targets = names
        .iter()
        .flat_map(|name| ["--test".to_owned(), name.clone()]);
    let mut programs = test_programs::build(&targets.collect::<Vec<_>>())?;
    programs.retain(|program| program.package == PACKAGE);
    Ok(programs)
}

/// Says which boards are connected, and how they are checked: that drives their mirrors.
pub(crate) fn name_real_boards() -> Result<()> {
    let real = boards()?.into_iter().filter(|board| board["link"] == "usb");
    let names: Vec<String> = real.filter_map(|board| name(&board)).collect();
    if names.is_empty() {
        println!("real board: skipped, none is connected");
    }
    for name in names {
        println!("real board: skipped; `cargo xtask hil --board {name}` drives the mirror on it");
    }
    Ok(())
}

/// What `host-tool list` tells of every board that is there.
fn boards() -> Result<Vec<Value>> {
    let said = tool::json(tool::command().arg("list"))?;
    Ok(said["boards"].as_array().cloned().unwrap_or_default())
}

fn name(board: &Value) -> Option<String> {
    board["name"].as_str().map(str::to_owned)
}

/// What any board must do, on the board `name`; drive and sense too, beside the silicon twin's, where `resistors` are known
/// to be on it.
pub(crate) fn on_board(name: &str, resistors: Option<f64>) -> Result<()> {
    tool::build()?;
    let is_called = |board: &Value| board["name"] == name;
    if !name.contains('/') && !boards()?.iter().any(is_called) {
        println!(
            "skipped: there is no board `{name}`; `host-tool doctor` tells why one is not found"
        );
        return Ok(());
    }
    if resistors.is_some() {
        images::build(Board::Stm32g474)?;
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
