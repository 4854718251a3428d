//! A person at a bench with an emulated board: types commands, moves stage and oven when asked, and looks at the mirror
//! itself, which nobody can at a real bench.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread;

use anyhow::{Context, Result, ensure};
use board_on_host::{BoardOnHost, Serving};
use emulated_board::{Connected, Speed, Surroundings};
use measurement::MeasurementFile;
use serde_json::Value;
use tempfile::TempDir;
use virtual_mirror::MirrorConfig;
use xtask::tool;

/// Where the mirror is moved to (um).
const POSITIONS_UM: [f64; 4] = [20.0, 60.0, 120.0, 160.0];
/// The mirror has so long to get there.
const SETTLE: &str = "2s";
/// The mirror is left alone for so long before it is said where it rests.
const REST: &str = "10s";
/// How the tool asks for the stage to be moved; a height in micrometres follows.
const TO_THE_STAGE: &str = "move the stage to ";

/// One `set-z`.
#[derive(Clone, Debug)]
pub(super) struct Move {
    /// Where the mirror was to be, which is where the model in the board predicts it (um).
    pub(super) asked_um: f64,
    /// Where it came to, or why it did not.
    pub(super) came: Result<There, String>,
}

/// Where a mirror is. After a move it counts from where the mirror rested when displacements began to count that the calibration
/// in use was made from: a position is one from rest, and no sensor that was zeroed then knows of an earlier one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct There {
    /// Where the bench's sensor sees it (um).
    pub(super) read_um: f64,
    /// Where it is (um).
    pub(super) plate_um: f64,
}

impl There {
    /// The same, counted from `rest`.
    pub(super) fn from(self, rest: Self) -> Self {
        Self {
            read_um: self.read_um - rest.read_um,
            plate_um: self.plate_um - rest.plate_um,
        }
    }
}

impl Move {
    /// How far the mirror was from where it was to be (um), where it was not refused.
    pub(super) fn error_um(&self) -> Option<f64> {
        let there = self.came.as_ref().ok()?;
        Some(there.plate_um - self.asked_um)
    }
}

/// Who tries a mirror on a board.
pub(crate) struct Person {
    board: BoardOnHost,
    room_c: f64,
    folder: PathBuf,
    _sockets: TempDir,
}

impl Person {
    /// With this mirror on a board that comes from the factory, working in `folder`.
    ///
    /// # Errors
    /// Where the board does not start.
    pub(crate) fn sit_down(mirror: &MirrorConfig, folder: &Path) -> Result<Self> {
        let sockets = emulated_board::private_directory()?;
        let board = BoardOnHost::start(&Serving {
            connected: Connected::Mirror(Box::new(mirror.clone())),
            around: Surroundings::default(),
            boards_directory: sockets.path().to_owned(),
            name: "story".to_owned(),
            flash: None,
            speed: Speed::Awaited,
        })?;
        Ok(Self {
            board,
            room_c: mirror.ambient_c,
            folder: folder.to_owned(),
            _sockets: sockets,
        })
    }

    /// How long it has been, by the board's clock (s).
    pub(super) fn board_time_s(&self) -> f64 {
        self.board.simulated_s()
    }

    /// What the thermometer of the room says, as the tool takes it.
    pub(super) fn thermometer(&self) -> String {
        format!("{:.1}", self.room_c)
    }

    /// The file or folder of this name in the folder of the story.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Types a command, and returns its report. Before it is carried out the room is as warm as it asks for, and afterwards
    /// as it was.
    ///
    /// # Errors
    /// Where the command fails: with its own words.
    pub(crate) fn types(&self, line: &str) -> Result<Value> {
        println!("$ {line}");
        let words: Vec<&str> = line.split(' ').skip(1).collect();
        if let Some(at) = words.iter().position(|word| *word == "--ambient") {
            let celsius = words.get(at + 1).context("a temperature")?.parse()?;
            self.board.controls().set_oven(celsius);
        }
        let report = self.carry_out(&words);
        self.board.controls().set_oven(self.room_c);
        report.with_context(|| format!("`{line}`"))
    }

    fn carry_out(&self, words: &[&str]) -> Result<Value> {
        let mut tool = tool::command()
            .args(words)
            .arg("--json")
            .env("MIRROR_BOARD", self.board.socket())
            .env("NO_COLOR", "1")
            .current_dir(&self.folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .context("the host tool does not run; is it built?")?;
        let mut keys = tool.stdin.take().context("piped")?;
        let mut out = tool.stdout.take().context("piped")?;
        let said = BufReader::new(tool.stderr.take().context("piped")?);
        let report = thread::spawn(move || {
            let mut text = String::new();
            out.read_to_string(&mut text).map(|_| text)
        });
        let mut complaint = String::new();
        for line in said.lines() {
            let line = line?;
            if let Some((_, rest)) = line.split_once(TO_THE_STAGE) {
                let (um, _) = rest.split_once(" um").context("a height")?;
                self.board.controls().move_stage(um.parse()?);
                writeln!(keys)?;
            }
            complaint += &(line + "\n");
        }
        let report = report.join().ok().context("it panicked")??;
        let report: Value = serde_json::from_str(&report)?;
        let failure = report["error"]["message"].as_str();
        ensure!(tool.wait()?.success(), "{}", failure.unwrap_or(&complaint));
        Ok(report)
    }

    /// Leaves the mirror alone, and returns where it rests: by the middle of what the sensor reads meanwhile, and where it is at last.
    ///
    /// # Errors
    /// Where a command fails, or there is no sensor.
    pub(super) fn rests(&self) -> Result<There> {
        const FILE: &str = "rest.csv";
        self.types(&format!(
            "host-tool record --duration {REST} --period 10ms --force -o {FILE}"
        ))?;
        let file = MeasurementFile::parse(FILE, &fs::read_to_string(self.path(FILE))?)?;
        let read: Vec<f64> = file.rows.iter().filter_map(|row| row.z_um).collect();
        ensure!(!read.is_empty(), "no sensor sees the mirror");
        Ok(There {
            read_um: measurement::median(read),
            plate_um: self.board.controls().plate_um(),
        })
    }

    /// Moves the mirror to every position that the board reaches, then turns it off. Positions count from `rest`.
    ///
    /// # Errors
    /// Where a command fails.
    pub(super) fn moves_it(&self, rest: There) -> Result<Vec<Move>> {
        let top_um = number(&self.types("host-tool status")?, "max_position_um")?;
        let mut moves = Vec::new();
        for asked_um in POSITIONS_UM.into_iter().filter(|um| *um <= top_um) {
            let line = format!("host-tool set-z {asked_um}um --settle {SETTLE}");
            let came = match self.types(&line) {
                Ok(moved) => {
                    let there = There {
                        read_um: number(&moved, "sensor_z_um")?,
                        plate_um: self.board.controls().plate_um(),
                    };
                    Ok(there.from(rest))
                }
                // A calibration that is far off makes the mirror too hot, which turns the board off.
                Err(error) => {
                    self.types("host-tool clear")?;
                    Err(format!("{:#}", error.root_cause()))
                }
            };
            moves.push(Move { asked_um, came });
        }
        self.types("host-tool off")?;
        Ok(moves)
    }
}

/// A number of a report.
///
/// # Errors
/// Where it is not there.
pub(super) fn number(report: &Value, key: &str) -> Result<f64> {
    let number = report[key].as_f64();
    number.with_context(|| format!("no `{key}` in {report}"))
}

/// The texts of a list in a report.
pub(super) fn texts(list: &Value) -> Vec<String> {
    let all = list.as_array().into_iter().flatten();
    all.filter_map(|text| text.as_str().map(str::to_owned))
        .collect()
}
