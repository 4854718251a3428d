//! The acceptance checks: on emulated boards, or on one that is connected.

use anyhow::Result;
use host_tool::board::{Found, find};

use crate::cargo::{cargo, run};
use crate::images::{self, Board};
use crate::tool;

/// The checks. They need an emulated board's image, or a board.
pub(crate) const PACKAGE: &str = "hil";

/// Everything, each check on an emulated board of its own.
pub(crate) fn on_emulated_boards() -> Result<()> {
    tool::build()?;
    images::build(Board::Mps2)?;
    run(cargo(&["test", "--package", PACKAGE, "--", "--show-output"]).env_remove("MIRROR_BOARD"))?;
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
    Ok(())
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
    tool::build()?;
    // What a mirror must do, resistors do not.
    let (test, ohm) = match resistors {
        None => ("acceptance", String::new()),
        Some(ohm) => ("resistors", ohm.to_string()),
    };
    let mut checks = cargo(&["test", "--package", PACKAGE, "--test", test]);
    checks
        .args(["--", "--show-output"])
        .env("MIRROR_BOARD", name);
    if resistors.is_some() {
        checks.env("MIRROR_RESISTORS", ohm);
    }
    run(&mut checks)
}
