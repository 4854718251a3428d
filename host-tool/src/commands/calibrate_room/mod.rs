//! `calibrate-room`: what a kelvin of the surroundings is worth to this mirror, from where it stood in one room and where it
//! stands in another.
//!
//! The first time it reads the sensor at a few positions and keeps that in a file; the second time, in another room, it reads
//! them again. The sensor's zero is in both readings, and is gone from their difference.

mod readings;
mod report;

use std::path::Path;

use calibration::with_ambient_ratio;
use control_core::Calibration;
use mirror_protocol::{CalibrationUse, Compensate, Position};
use quantities::Span;

use self::readings::{
    ANY_ROOM_UM, RoomReading, RoomReadings, compared, largest_um, mean_rise_k, off_um,
};
use self::report::RoomReport;
use super::calibrate::fall_back;
use super::calibration_file::load_in_use;
use super::interrupt::Interrupt;
use super::kept_files::KeptFiles;
use super::measure::sensor::Sensor;
use super::moving::{Pace, UNTIL_THE_NEXT, read_settled};
use crate::board::Board;
use crate::cli::CalibrateRoom;
use crate::error::{NotImproved, SensorFault, ToolError, UnusableInput};
use crate::names::limit_names;
use crate::new_file::NewFile;
use crate::report::{decimal, print};

/// Of the range: where a room 20 K warmer leaves the lowest within reach, and one 20 K colder the highest.
const PARTS_OF_RANGE: [f64; 3] = [0.4, 0.6, 0.8];
/// Two positions tell room and loss apart, so they are gone through once before they are read.
const ROUNDS: usize = 2;
/// By so much a room may be worse than before by the sensor's noise alone (um); what is asked of positions in any room is ten
/// times as much (`docs/requirements.md`).
const NOISE_UM: f64 = 0.05;

/// Reads the positions, and keeps what was read or compares it with what was kept.
pub(super) async fn run(board: &Board, ask: CalibrateRoom, json: bool) -> Result<(), ToolError> {
    let calibration = load_in_use(board, &ask.calibration).await?;
    let kept = RoomReadings::load(&ask.readings)?;
    if let Some(kept) = &kept
        && !kept.are_under(&calibration)
    {
        return Err(UnusableInput::OtherRoomReadings { file: ask.readings }.into());
    }
    let output = ask.output.map(|path| NewFile::create(path, ask.force));
    let output = output.transpose()?;
    let room = InRoom::open(board, &ask.displacements.sensor, ask.settle).await?;
    let mut files = KeptFiles::new();
    let report = match kept {
        None => first(&room, &calibration, &ask.readings).await,
        Some(kept) => second(&room, &calibration, &kept, (output, &mut files)).await,
    };
    room.leave().await?;
    print(&report?, json);
    Ok(files.ended()?)
}

/// Keeps what is read in the first room.
async fn first(
    room: &InRoom<'_>,
    calibration: &Calibration,
    file: &Path,
) -> Result<RoomReport, ToolError> {
    let file = NewFile::create(file.to_owned(), false)?;
    let reach_um = decimal(room.board.status().await?.max_position_um);
    let points = room
        .read(&PARTS_OF_RANGE.map(|part| part * reach_um))
        .await?;
    let readings = RoomReadings::under(calibration, points);
    Ok(RoomReport::First {
        readings: file.write(&readings.to_json())?,
        points: readings.points,
    })
}

/// Finds the ratio, tries it, and keeps the calibration with it where the mirror is nearer to where it was.
async fn second(
    room: &InRoom<'_>,
    calibration: &Calibration,
    kept: &RoomReadings,
    (output, files): (Option<NewFile>, &mut KeptFiles),
) -> Result<RoomReport, ToolError> {
    let asked_um: Vec<f64> = kept.points.iter().map(|then| then.asked_um).collect();
    let now = room.read(&asked_um).await?;
    let found = with_ambient_ratio(calibration, &compared(&kept.points, &now))?;
    let before_um = off_um(&kept.points, &now);
    let on_trial = room.board.use_calibration(&found, CalibrationUse::OnTrial);
    on_trial.await?;
    // In the first room, too, the mirror would have stood elsewhere.
    let then = kept.read_under(calibration, &found);
    let after_um = match nearer(room, &then, &before_um).await {
        Ok(after_um) => after_um,
        Err(error) => return Err(fall_back(room.board, error).await),
    };
    let for_good = room.board.use_calibration(&found, CalibrationUse::ForGood);
    for_good.await?;
    Ok(RoomReport::Second {
        rise_then_k: mean_rise_k(&kept.points),
        rise_now_k: mean_rise_k(&now),
        asked_um,
        before_um,
        after_um,
        ratio_before: decimal(calibration.parts().ambient_ratio),
        ratio: decimal(found.parts().ambient_ratio),
        ratio_deviation: decimal(found.parts().residual.ambient_ratio),
        calibration: files.write_calibration(output, &calibration::to_toml(&found)),
    })
}

/// How far the mirror is from where it stands in the first room, with the calibration that is on trial.
async fn nearer(
    room: &InRoom<'_>,
    then: &[RoomReading],
    before_um: &[f64],
) -> Result<Vec<f64>, ToolError> {
    let asked_um: Vec<f64> = then.iter().map(|then| then.asked_um).collect();
    let after_um = off_um(then, &room.read(&asked_um).await?);
    is_nearer(largest_um(before_um), largest_um(&after_um))?;
    Ok(after_um)
}

/// Whether what was found has brought the mirror to where it stood.
fn is_nearer(before_um: f64, after_um: f64) -> Result<(), NotImproved> {
    if after_um > before_um + NOISE_UM {
        if before_um <= NOISE_UM {
            return Err(NotImproved::RoomAsGood {
                before_um,
                after_um,
            });
        }
        return Err(NotImproved::RoomNotBetter {
            before_um,
            after_um,
        });
    }
    if after_um > ANY_ROOM_UM {
        return Err(NotImproved::RoomUnexplained { after_um });
    }
    Ok(())
}

/// A board in a room, with a sensor on its mirror.
struct InRoom<'a> {
    board: &'a Board,
    sensor: Sensor,
    pace: Pace,
    interrupt: Interrupt,
    /// Whether the board compensated the room before.
    was_compensated: bool,
}

impl<'a> InRoom<'a> {
    /// Has the board compensate the room, whose ratio is asked for.
    async fn open(board: &'a Board, sensor: &str, settle: Span) -> Result<Self, ToolError> {
        let sensor = Sensor::at_any_time(board, sensor).await?;
        let interrupt = Interrupt::listen()?;
        let was_compensated = board.status().await?.health.compensates_room;
        board.compensate(Compensate { is_wanted: true }).await?;
        Ok(Self {
            board,
            sensor,
            pace: Pace {
                settle,
                hold: UNTIL_THE_NEXT,
            },
            interrupt,
            was_compensated,
        })
    }

    /// Turns the channels off, and has the board compensate the room where it did before.
    async fn leave(&self) -> Result<(), ToolError> {
        self.board.off().await?;
        let is_wanted = self.was_compensated;
        self.board.compensate(Compensate { is_wanted }).await?;
        Ok(())
    }

    /// What the sensor reads at the positions, in their order, from rest on.
    async fn read(&self, positions_um: &[f64]) -> Result<Vec<RoomReading>, ToolError> {
        let unkept = || ToolError::InterruptedUnkept { next: "" };
        self.interrupt
            .or_else(self.read_all(positions_um), unkept)
            .await
    }

    async fn read_all(&self, positions_um: &[f64]) -> Result<Vec<RoomReading>, ToolError> {
        self.board.off().await?;
        let mut points = Vec::new();
        for _ in 0..ROUNDS {
            points.clear();
            for &asked_um in positions_um {
                points.push(self.read_at(asked_um).await?);
            }
        }
        Ok(points)
    }

    async fn read_at(&self, asked_um: f64) -> Result<RoomReading, ToolError> {
        let lease_ms = self.pace.lease_ms();
        let z_um = asked_um as f32;
        let commanded = self.board.set_position(Position { z_um, lease_ms }).await?;
        let (readings, _) = read_settled(self.board, &commanded, self.pace.settle).await?;
        let serial_um = self.sensor.read_now().await?;
        let status = self.board.status().await?;
        // What held it back on its way is over.
        let limits = limit_names(status.telemetry.limits);
        if let Some(limit) = limits.first() {
            return Err(NotImproved::RoomLimited { asked_um, limit }.into());
        }
        let room = status.telemetry.room.ok_or(NotImproved::RoomUnknown)?;
        Ok(RoomReading {
            asked_um,
            read_um: serial_um
                .or(readings.sensor_z_um)
                .ok_or(SensorFault::NoSensor)?,
            rise_k: f64::from(room.rise_ck) / 100.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_is_kept_where_it_explains_what_has_moved_the_mirror() {
        assert!(is_nearer(1.8, 0.2).is_ok());
        assert!(is_nearer(0.02, 0.06).is_ok());
        let refused = |before_um, after_um| is_nearer(before_um, after_um).expect_err("not kept");
        assert!(matches!(
            refused(0.02, 0.08),
            NotImproved::RoomAsGood { .. }
        ));
        assert!(matches!(
            refused(0.06, 0.21),
            NotImproved::RoomNotBetter { .. }
        ));
        // A sensor that has moved by 3 um.
        assert!(matches!(
            refused(2.6, 0.95),
            NotImproved::RoomUnexplained { .. }
        ));
    }
}
