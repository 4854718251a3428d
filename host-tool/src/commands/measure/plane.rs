//! `measure plane`: the tilt of the plate from a scan of points over it, the paper's second procedure.

use std::fmt;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use measurement::Plane;
use measurement::Row;
use quantities::{Span, Voltage};
use serde::Serialize;

use super::header::header;
use super::keyboard::Keyboard;
use super::point::Points;
use super::possible::{check_drive, make_directory};
use super::run::{Ended, attended, partial, whole};
use super::spots::{Spots, check_one_scan, parse, possible};
use crate::board::Board;
use crate::cli;
use crate::commands::interrupt::Interrupt;
use crate::error::{OutputError, ToolError, UnusableInput};
use crate::new_file::{GrowingFile, NewFile};
use crate::report::{self, decimal};
use crate::verbosity::say;

/// Reads a scan and prints the plane through it.
pub(crate) fn of_file(path: &Path, json: bool) -> Result<(), ToolError> {
    let text = input_file::read_text(path, input_file::MOST_MADE)?;
    let unusable = |reason: String| {
        ToolError::from(UnusableInput::Scan {
            path: path.to_owned(),
            reason,
        })
    };
    check_one_scan(&text).map_err(unusable)?;
    let points = parse(&text).map_err(unusable)?;
    possible(&points).map_err(unusable)?;
    let plane = Plane::through(&points).ok_or_else(|| unusable(no_plane(points.len())))?;
    let report = Level {
        drive_v: None,
        points: points.len(),
        plane,
    };
    report::print(&report, json);
    Ok(())
}

fn no_plane(points: usize) -> String {
    format!("its {points} points span no plane; scan a square, such as 5 by 5 points over 100 um")
}

/// Scans the plate at each voltage, and leaves the channels off.
pub(crate) async fn run(board: &Board, ask: cli::Plane, json: bool) -> Result<(), ToolError> {
    let status = board.status().await?;
    let max = Voltage {
        v: decimal(status.max_drive_v),
    };
    for volts in &ask.volts {
        check_drive(*volts, max)?;
    }
    let points = Points::open(board, &ask.instruments).await?;
    let spots = Spots::new(ask.points.as_deref())?;
    if let Some(folder) = ask.output.parent() {
        make_directory(folder)?;
    }
    let force = ask.instruments.force;
    let file = NewFile::create(ask.output.clone(), force)?;
    // Not measurement files: a session's folder may hold them.
    let scan_name = |level: usize| ask.output.with_extension(format!("{level}.xyz"));
    let scan_files = (1..=ask.volts.len())
        .map(|level| NewFile::create(scan_name(level), force))
        .collect::<Result<Vec<_>, _>>()?;

    let interrupt = Interrupt::listen()?;
    let mut scan = PlateScan {
        board,
        points: points.begin().await?,
        spots,
        settle: ask.settle,
        levels: Vec::new(),
    };
    let ended = attended(board, &interrupt, scan.perform(&ask.volts, scan_files)).await;
    let off = board.off().await.map(drop);
    let ended = ended.and_then(|ended| off.map(|()| ended));

    let partial = partial(&ended);
    let mut report = PlaneReport {
        levels: Vec::new(),
        files: Vec::new(),
        interrupted: matches!(ended, Ok(Ended::Interrupted)),
    };
    let mut measured = header(board, "plane", scan.points.session());
    if let Some(partial) = &partial {
        measured.keys.set("partial", partial);
    }
    let rest_um = scan.rest_um();
    for scanned in &mut scan.levels {
        scanned.finish(partial.as_deref())?;
        report.files.extend(scanned.kept.clone());
        if let (Some(row), Some(plane)) = (scanned.row, Plane::through(&scanned.points)) {
            measured.rows.push(Row {
                tilt_x_deg: Some(plane.tilt_x_deg),
                tilt_y_deg: Some(plane.tilt_y_deg),
                z_um: rest_um.map(|rest_um| plane.z_um - rest_um),
                ..row
            });
            report.levels.push(Level {
                drive_v: Some(scanned.drive_v),
                points: scanned.points.len(),
                plane,
            });
        }
    }
    // Rows are read in pairs: one alone would be no measurement.
    if measured.rows.len() > 1 {
        report.files.push(file.write(&measured.to_string())?);
    }
    report::print(&report, json);
    match ended {
        Ok(Ended::Complete) if report.levels.len() < ask.volts.len() => Err(UnusableInput::Scan {
            path: scan_name(1),
            reason: no_plane(scan.levels[0].points.len()),
        }
        .into()),
        other => whole(other),
    }
}

/// A scan as it goes on.
struct PlateScan<'a> {
    board: &'a Board,
    points: Points<'a>,
    spots: Spots,
    settle: Span,
    levels: Vec<Scanned>,
}

/// What was read at one voltage.
struct Scanned {
    drive_v: f64,
    /// x, y and z (um).
    points: Vec<[f64; 3]>,
    /// Time, drives and currents, once all points are read.
    row: Option<Row>,
    /// Takes every point at once, so that it outlives this process.
    file: GrowingFile,
    output: File,
    /// The file, once it is whole.
    kept: Option<PathBuf>,
}

impl PlateScan<'_> {
    async fn perform(&mut self, volts: &[Voltage], files: Vec<NewFile>) -> Result<(), ToolError> {
        let mut keyboard = Keyboard::new();
        for (volts, file) in volts.iter().zip(files) {
            self.levels.push(Scanned::begin(volts.v, file)?);
            let held = self.points.drive(*volts).await?;
            say(format_args!("at {volts} on all actuators"));
            self.board.wait(held.tick, self.settle).await?;
            self.scan(&mut keyboard).await?;
        }
        Ok(())
    }

    /// Reads all points at the present voltage.
    async fn scan(&mut self, keyboard: &mut Keyboard) -> Result<(), ToolError> {
        let mut row = None;
        let mut index = 0;
        while let Some([x, y]) = self.spots.reach(index, keyboard).await? {
            let (z, read) = self.points.read().await?;
            if let Some(level) = self.levels.last_mut() {
                level.append([x, y, z])?;
            }
            row = Some(read);
            index += 1;
        }
        if let Some(level) = self.levels.last_mut() {
            level.row = row;
            level.finish(None)?;
        }
        Ok(())
    }

    /// Height of the plate at the first 0 V that was scanned (um).
    fn rest_um(&self) -> Option<f64> {
        let rest = self.levels.iter().find(|level| level.drive_v == 0.0)?;
        Plane::through(&rest.points).map(|plane| plane.z_um)
    }
}

/// What a scan's file says until the scan has ended.
const BEGUN: &str = "the scan did not end";

impl Scanned {
    /// A scan without a point yet, and its file.
    fn begin(drive_v: f64, file: NewFile) -> Result<Self, ToolError> {
        let (file, output) = file.grow()?;
        let mut this = Self {
            drive_v,
            points: Vec::new(),
            row: None,
            file,
            output,
            kept: None,
        };
        this.write(&this.head(Some(BEGUN)))?;
        Ok(this)
    }

    fn append(&mut self, point: [f64; 3]) -> Result<(), OutputError> {
        self.points.push(point);
        self.write(&line(point))
    }

    fn write(&mut self, text: &str) -> Result<(), OutputError> {
        let written = self.output.write_all(text.as_bytes());
        written.map_err(|source| OutputError::Write {
            path: self.file.name().to_owned(),
            source,
        })
    }

    /// Leaves a file that `measure plane --from` reads, where there is a point; `partial` says why it is not whole.
    fn finish(&mut self, partial: Option<&str>) -> Result<(), OutputError> {
        if self.kept.is_some() {
            return Ok(());
        }
        if self.points.is_empty() {
            return self.file.discard();
        }
        let lines: String = self.points.iter().copied().map(line).collect();
        self.kept = Some(self.file.replace(&(self.head(partial) + &lines))?);
        Ok(())
    }

    fn head(&self, partial: Option<&str>) -> String {
        let partial = partial.map_or(String::new(), |partial| format!("# partial={partial}\n"));
        format!("# V_V={}\n{partial}x_um,y_um,z_um\n", self.drive_v)
    }
}

fn line([x, y, z]: [f64; 3]) -> String {
    format!("{x},{y},{z:.4}\n")
}

#[derive(Serialize)]
struct PlaneReport {
    levels: Vec<Level>,
    files: Vec<PathBuf>,
    interrupted: bool,
}

/// The plane at one voltage.
#[derive(Serialize)]
struct Level {
    drive_v: Option<f64>,
    points: usize,
    #[serde(flatten)]
    plane: Plane,
}

impl fmt::Display for PlaneReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for level in &self.levels {
            write!(f, "{level}")?;
        }
        for file in &self.files {
            writeln!(f, "kept       in {}", file.display())?;
        }
        Ok(())
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Plane {
            tilt_x_deg,
            tilt_y_deg,
            z_um,
            rms_um,
        } = self.plane;
        if let Some(drive_v) = self.drive_v {
            writeln!(f, "drive      {drive_v:.3} V")?;
        }
        writeln!(
            f,
            "tilt       {tilt_x_deg:+.4} deg about x, {tilt_y_deg:+.4} deg about y"
        )?;
        writeln!(
            f,
            "height     {z_um:.3} um, {} points {rms_um:.3} um rms off the plane",
            self.points
        )
    }
}
