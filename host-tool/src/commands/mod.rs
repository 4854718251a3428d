//! The commands, one file each.

mod calibrate;
mod calibrate_pose;
mod calibrate_room;
mod calibrate_sense;
mod calibration_file;
mod condition;
mod doctor;
mod explain;
mod following;
mod history;
pub(crate) mod interrupt;
mod kept_files;
mod lab;
mod list;
mod load_calibration;
mod measure;
mod monitor;
mod moving;
mod off;
pub(crate) mod pose;
mod range;
mod range_end;
mod record;
mod room;
mod same_mirror;
mod scan;
mod set_drive;
mod set_pose;
mod set_z;
mod status;
mod uncertainty;
mod update;

pub(crate) use lab::Diagnosed;
pub(crate) use status::kept_words;
pub(crate) use uncertainty::Uncertainty;

use tokio::runtime::Builder;

use crate::board::{Board, choose};
use crate::cli::{Arguments, Command, Measure, Plane};
use crate::commands::calibrate_sense::Gains;
use crate::commands::interrupt::computed;
use crate::commands::moving::Pace;
use crate::completion;
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::report;
use crate::serve;
use crate::tilted_pose::TiltedPose;

/// Carries out one command.
pub(crate) fn run(arguments: Arguments) -> Result<(), ToolError> {
    let runtime = Builder::new_multi_thread()
        // The link, and whoever looks at the board, are served while a command computes.
        .worker_threads(1)
        .enable_all()
        .build();
    runtime
        .map_err(ToolError::Runtime)?
        .block_on(dispatch(arguments))
}

async fn dispatch(arguments: Arguments) -> Result<(), ToolError> {
    let json = arguments.json;
    let chosen = || choose(arguments.board.as_deref());
    let open = async || Board::open(&chosen()?).await;
    match arguments.command {
        Command::List => list::run(json).await,
        Command::Doctor => doctor::run(json).await,
        Command::Update { firmware } => {
            update::run(&firmware, arguments.board.as_deref(), json).await
        }
        Command::Status { history } => status::look(&chosen()?, history, json).await,
        Command::SetZ { z, settle, hold } => {
            let pace = Pace::new(settle, hold, arguments.longest_hold)?;
            let board = open().await?;
            set_z::run(&board, z, pace, json).await
        }
        Command::Condition => condition::run(&open().await?, arguments.longest_hold, json).await,
        Command::SetPose {
            z,
            tilt_x,
            tilt_y,
            settle,
            hold,
        } => {
            let pace = Pace::new(settle, hold, arguments.longest_hold)?;
            let pose = TiltedPose::new(z, tilt_x, tilt_y);
            let board = open().await?;
            set_pose::run(&board, pose, pace, json).await
        }
        Command::Room { compensate: None } => {
            let found = chosen()?;
            room::show(Board::look(&found).await?.view(&found)?, json).await
        }
        Command::Room {
            compensate: Some(switch),
        } => room::switch(&open().await?, switch, json).await,
        Command::Range { picture, force } => {
            let found = chosen()?;
            let seen = Board::look(&found).await?;
            range::run(seen.view(&found)?, picture, force, json).await
        }
        Command::SetDrive {
            drives,
            settle,
            hold,
        } => {
            let drives = set_drive::for_all_actuators(&drives)?;
            let pace = Pace::new(settle, hold, arguments.longest_hold)?;
            set_drive::run(&open().await?, drives, pace, json).await
        }
        Command::Clear => status::clear(&open().await?, json).await,
        Command::Off => off::run(&chosen()?, json).await,
        Command::Record {
            output,
            duration,
            period,
            force,
        } => {
            let is_piped = output.as_os_str() == "-";
            if is_piped && json {
                return Err(ToolError::OutputTwice);
            }
            let file = (!is_piped).then(|| NewFile::create(output, force));
            let file = file.transpose()?;
            record::run(&open().await?, file, duration, period, json).await
        }
        Command::Monitor {
            period,
            output,
            plotjuggler,
        } => {
            let board = arguments.board.as_deref();
            monitor::run(board, period, output, plotjuggler.as_deref(), json).await
        }
        Command::Serve {
            reference: true, ..
        } => {
            report::write(&serve::reference());
            Ok(())
        }
        Command::Serve {
            listen,
            end_with_input,
            reference: false,
        } => serve::run(&listen, arguments.board, end_with_input, json).await,
        Command::Explain { name } => explain::run(name.as_deref(), json),
        Command::Measure(Measure::Plane(Plane {
            from: Some(scan), ..
        })) => measure::plane::of_file(&scan, json),
        Command::Measure(Measure::Plane(ask)) => {
            measure::plane::run(&open().await?, ask, json).await
        }
        Command::Measure(Measure::Reference(ask)) => {
            measure::reference::run(&open().await?, ask, json).await
        }
        Command::Measure(Measure::Experiment(asked)) => {
            measure::run(&open().await?, asked, json).await
        }
        Command::Scan(scan) => {
            let longest = arguments.longest_hold;
            scan::run(&open().await?, scan, longest, json).await
        }
        Command::Calibrate(ask) => calibrate::run(&open().await?, ask, json).await,
        Command::LoadCalibration { file, other_mirror } => {
            load_calibration::run(&open().await?, &file, other_mirror, json).await
        }
        Command::CalibratePose(ask) => {
            Pace::check_next(ask.settle, arguments.longest_hold)?;
            calibrate_pose::run(&open().await?, ask, json).await
        }
        Command::CalibrateRoom(ask) => {
            Pace::check_next(ask.settle, arguments.longest_hold)?;
            calibrate_room::run(&open().await?, ask, json).await
        }
        Command::CalibrateSense {
            resistor,
            forget_gains,
        } => {
            let gains = match (resistor, forget_gains) {
                (Some(resistor), _) => Gains::By(resistor),
                (None, true) => Gains::Forgotten,
                (None, false) => Gains::Kept,
            };
            calibrate_sense::run(&open().await?, gains, json).await
        }
        Command::Import(ask) => computed(json, || lab::import(ask, json)),
        Command::Fit { lab, output } => computed(json, || lab::fit(&lab, output, json)),
        Command::Identify { lab, output } => computed(json, || lab::identify(&lab, output, json)),
        Command::Compare(ask) => computed(json, || lab::compare(ask, json)),
        Command::Diagnose(ask) => computed(json, || lab::diagnose(ask, json)),
        Command::Report(ask) => computed(json, || lab::report(ask, json)),
        Command::Replay { page } => computed(json, || lab::replay(&page, json)),
        Command::Effect(command) => computed(json, || lab::effect(command, json)),
        Command::Completions { shell } => {
            report::write(&completion::script(shell).map_err(ToolError::Runtime)?);
            Ok(())
        }
    }
}
