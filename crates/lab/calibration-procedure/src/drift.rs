//! Whether the mirror does at the end of a calibration what it did at its beginning.
//!
//! Where sensor, stage, room or air change in between, all that is measured later is of what is there then: tables, refinement and trial
//! agree with each other, and contradict only what was measured before. So the same drives are read first and last, each time from rest.

use control_core::design::FILM_TCR_PER_K;
use experiments::calibration::{CHECKED_ALONE, CHECKED_READINGS, CHECKED_SHARES};
use measurement::{MeasurementFile, Row, Session, median};

use crate::heaters::Heaters;

/// Where the mirror stands at the same drive may move by so much (um): as far as it may be off in any room (`docs/requirements.md`), and as
/// much for what still creeps.
const MOST_UM: f64 = 1.0;
/// By so much it moves where nothing disturbs it (um): virtual mirrors of the families A to F and the paper's by 0.02 to 0.06, one that creeps
/// five times as much by 0.08.
const USUAL_UM: f64 = 0.1;
/// It comes back to so far below where it rested (um), and to so far above, as a part of the way up: friction and creep hold it up, creep of 5 % and
/// plays of 1.5 % (`docs/requirements.md`) by no more.
const BELOW_UM: f64 = 0.1;
const ABOVE: f64 = 0.06;
/// Films that relax while they are hot come back by so much lower (um), and go up again within minutes: twice what another author's mirror of
/// relaxing aluminium did. They do it again, which what was moved does not.
const RELAXES_UM: f64 = 0.3;
/// Two readings differ by so many standard deviations of one in 3 of 1000 cases: three of their difference.
const CHANCE: f64 = 4.243;
/// So often it comes to rest anew where it does not come back: films that yield do it once.
pub(crate) const RESTS: usize = 3;
/// What heaters tell of another room (K) and of air that takes another part of their heat, where neither changes: the same mirrors' 0.02 K
/// and 1.3e-4.
const SAME_ROOM_K: f64 = 0.1;
const SAME_LOSS: f64 = 1e-3;

/// What was measured at different times contradicts each other.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Drift {
    /// There is no rest to count from.
    #[error(
        "the mirror does not come back to where it rested: driven all the way up it rests {apart_um:+.2} um from there, the last of {RESTS} times"
    )]
    NoRest {
        /// The last time (um).
        apart_um: f64,
    },
    /// A session is not of the mirror that is on the board.
    #[error(
        "the session is of another mirror: actuator {actuator}, as warm as here, had {there_ohm:.1} ohm there, and has {here_ohm:.1} ohm on this board"
    )]
    OtherMirror {
        /// The actuator that differs most, counted from 1.
        actuator: usize,
        /// Its resistance in the session (ohm).
        there_ohm: f64,
        /// And here (ohm).
        here_ohm: f64,
    },
    /// At the beginning, while the mirror settled.
    #[error(
        "mirror, sensor or room did not stay as they were: at the beginning the sensor's reading moved by {jump_um:+.2} um while the mirror settled"
    )]
    Jump {
        /// By so much (um).
        jump_um: f64,
    },
    /// The room has changed.
    #[error(
        "the room has changed meanwhile: the temperature of the heaters without power by {warmer_k:+.1} K, and at {drive_v:.2} V \
         the mirror is {moved_um:+.2} um from where it was"
    )]
    Room {
        /// By how much the heaters are warmer (K).
        warmer_k: f64,
        /// At which drive the mirror has moved most (V).
        drive_v: f64,
        /// By so much (um).
        moved_um: f64,
    },
    /// The air has changed.
    #[error(
        "the air has changed meanwhile: the heat that it takes for a kelvin by {more_percent:+.1} %, and at {drive_v:.2} V the \
         mirror is {moved_um:+.2} um from where it was"
    )]
    Air {
        /// How much more heat a kelvin takes away (%).
        more_percent: f64,
        /// At which drive the mirror has moved most (V).
        drive_v: f64,
        /// By so much (um).
        moved_um: f64,
    },
    /// The heaters are as warm as they were.
    #[error(
        "mirror or sensor have moved meanwhile: at {drive_v:.2} V the sensor reads {moved_um:+.2} um from what it did at the beginning, where the \
         heaters are as warm"
    )]
    Moved {
        /// At which drive most (V).
        drive_v: f64,
        /// By so much (um).
        moved_um: f64,
    },
}

/// What was read at the drives of [`drift_check`](experiments::calibration::drift_check).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DriftCheck {
    /// At each of its drives, and at the end.
    levels: Vec<Level>,
    heaters: Option<Heaters>,
    /// By which two readings differ by chance (um).
    chance_um: f64,
}

/// What was read at one drive.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Level {
    drive_v: f64,
    /// Of all four actuators.
    is_of_all: bool,
    z_um: Option<f64>,
    /// Of a heater, the mean of those that are driven.
    power_w: f64,
    resistance_ohm: f64,
}

/// What heaters tell of what is around them.
struct Heat {
    /// Their mean resistance without power.
    cold_ohm: f64,
    /// The power that a rise of it takes.
    loss_w_per_ohm: f64,
}

impl DriftCheck {
    /// What a file says of it.
    pub(crate) fn of(file: &MeasurementFile) -> Self {
        let chance_um = CHANCE * file.keys.displacement_noise_um().unwrap_or(0.0);
        let driven = (CHECKED_SHARES.len() + CHECKED_ALONE) * CHECKED_READINGS;
        let (driven, at_rest) = file.rows.split_at(driven.min(file.rows.len()));
        let seconds = || driven.chunks(CHECKED_READINGS);
        let last = at_rest.chunks(CHECKED_READINGS).next_back();
        Self {
            levels: seconds().chain(last).map(Level::of).collect(),
            heaters: Heaters::of(file.rows.iter()),
            chance_um,
        }
    }

    /// Whether a session is of the mirror that this was read of.
    ///
    /// # Errors
    /// Where its heaters have other resistances.
    pub(crate) fn is_of_the_mirror_of(&self, session: &Session) -> Result<(), Drift> {
        let rows = session.files.iter().flat_map(|(_, file)| &file.rows);
        let (Some(there), Some(here)) = (Heaters::of(rows), self.heaters) else {
            return Ok(());
        };
        match there.differ(&here) {
            None => Ok(()),
            Some((actuator, there_ohm, here_ohm)) => Err(Drift::OtherMirror {
                actuator: actuator + 1,
                there_ohm,
                here_ohm,
            }),
        }
    }

    /// What is no matter, of a sensor that scatters by more.
    fn off_um(&self, no_matter_um: f64) -> f64 {
        no_matter_um.max(self.chance_um)
    }

    /// Where the mirror rests at first (um).
    fn rest_um(&self) -> Option<f64> {
        self.levels.first()?.z_um
    }

    /// Where it comes back to (um).
    fn came_um(&self) -> Option<f64> {
        self.levels.last()?.z_um
    }

    /// How far from there it comes back to (um).
    pub(crate) fn apart_um(&self) -> Option<f64> {
        Some(self.came_um()? - self.rest_um()?)
    }

    /// Whether it is somewhere else by so much (um).
    fn is_off(&self, um: f64) -> bool {
        um.abs() > self.off_um(BELOW_UM)
    }

    /// Whether the mirror rests where displacements count from, and comes back no lower than it rested.
    pub(crate) fn holds_still(&self) -> Result<(), Drift> {
        let moved = self.rest_um().filter(|um| self.is_off(*um));
        let lower = |um: &f64| *um < 0.0 && self.is_off(*um);
        moved.or(self.apart_um().filter(lower)).map_or(Ok(()), jump)
    }

    /// Whether it comes back lower than it rested by no more than films do that relax.
    pub(crate) fn may_relax(&self) -> bool {
        let is_little = |um: f64| (-RELAXES_UM..0.0).contains(&um) && self.is_off(um);
        let was_moved = self.rest_um().is_some_and(|um| self.is_off(um));
        !was_moved && self.apart_um().is_some_and(is_little)
    }

    /// Whether it comes back to where it did `once` before.
    pub(crate) fn comes_back_as(&self, once: &Self) -> Result<(), Drift> {
        let further_um = self.came_um().zip(once.came_um());
        let further_um = further_um.map(|(now_um, once_um)| now_um - once_um);
        further_um
            .filter(|um| self.is_off(*um))
            .map_or(Ok(()), jump)
    }

    /// Whether it comes back there.
    pub(crate) fn comes_back(&self) -> bool {
        let up_um = self.levels.iter().filter_map(|level| level.z_um);
        let above_um = ABOVE * up_um.fold(0.0, f64::max);
        self.apart_um().is_none_or(|um| um <= self.off_um(above_um))
    }

    /// Whether the heaters tell the same room as `before`, whose displacements count from elsewhere.
    pub(crate) fn is_in_the_room_of(&self, before: &Self) -> Result<(), Drift> {
        match self.heat_since(before) {
            Some((warmer_k, _)) if warmer_k.abs() > SAME_ROOM_K => Err(Drift::Room {
                warmer_k,
                drive_v: 0.0,
                moved_um: before.apart_um().unwrap_or_default(),
            }),
            _ => Ok(()),
        }
    }

    /// By how much the mirror has moved since `first` (um), 0 where it is no more than any mirror moves.
    pub(crate) fn against(&self, first: &Self) -> Result<f64, Drift> {
        let both = self.levels.iter().zip(&first.levels);
        // At the first rest of all it may never have been driven.
        let moved = both
            .skip(1)
            .filter_map(|(now, then)| Some((then.drive_v, now.z_um? - then.z_um?)));
        let most = moved.max_by(|(_, one), (_, other)| one.abs().total_cmp(&other.abs()));
        let (drive_v, moved_um) = most.unwrap_or_default();
        if moved_um.abs() <= self.off_um(USUAL_UM) {
            return Ok(0.0);
        }
        if moved_um.abs() <= MOST_UM {
            return Ok(moved_um.abs());
        }
        let (warmer_k, more) = self.heat_since(first).unwrap_or_default();
        let (room, air) = (warmer_k.abs() / SAME_ROOM_K, more.abs() / SAME_LOSS);
        Err(match room.max(air) {
            ..=1.0 => Drift::Moved { drive_v, moved_um },
            most if most > air => Drift::Room {
                warmer_k,
                drive_v,
                moved_um,
            },
            _ => Drift::Air {
                more_percent: 100.0 * more,
                drive_v,
                moved_um,
            },
        })
    }

    /// By how much warmer the room is (K), and what part more of the heat is lost.
    fn heat_since(&self, before: &Self) -> Option<(f64, f64)> {
        let (now, then) = (self.heat()?, before.heat()?);
        let warmer_k = (now.cold_ohm / then.cold_ohm - 1.0) / f64::from(FILM_TCR_PER_K);
        Some((warmer_k, now.loss_w_per_ohm / then.loss_w_per_ohm - 1.0))
    }

    /// On the line through the least and the most that is driven.
    fn heat(&self) -> Option<Heat> {
        let is_driven = |level: &&Level| level.is_of_all && level.drive_v > 0.0;
        let driven = || self.levels.iter().filter(is_driven);
        let by_drive = |one: &&Level, other: &&Level| one.drive_v.total_cmp(&other.drive_v);
        let (low, high) = (driven().min_by(by_drive)?, driven().max_by(by_drive)?);
        let loss_w_per_ohm =
            (high.power_w - low.power_w) / (high.resistance_ohm - low.resistance_ohm);
        Some(Heat {
            cold_ohm: low.resistance_ohm - low.power_w / loss_w_per_ohm,
            loss_w_per_ohm,
        })
    }
}

fn jump(jump_um: f64) -> Result<(), Drift> {
    Err(Drift::Jump { jump_um })
}

impl Level {
    /// The later half of its readings: the mirror was on its way at those before.
    fn of(rows: &[Row]) -> Self {
        let late = &rows[rows.len() / 2..];
        let z_um: Vec<f64> = late.iter().filter_map(|row| row.z_um).collect();
        // The others show their resistance by a little where one is driven alone.
        let is_driven = |row: &Row, drive_v: f64| drive_v > 0.5 * row.highest_v();
        let currents = late.iter().flat_map(|row| {
            let each = row.voltage_v.into_iter().zip(row.current_a);
            let driven = each.filter(move |(drive_v, _)| is_driven(row, *drive_v));
            driven.filter_map(|(drive_v, current_a)| Some((drive_v, current_a?)))
        });
        let currents: Vec<(f64, f64)> = currents.collect();
        let mean = |of: fn(&(f64, f64)) -> f64| {
            // A sum of none is below zero.
            currents.iter().map(of).fold(0.0, |sum, of| sum + of) / currents.len().max(1) as f64
        };
        Self {
            drive_v: mean(|(drive_v, _)| *drive_v),
            is_of_all: late
                .iter()
                .all(|row| row.voltage_v.iter().all(|v| is_driven(row, *v))),
            z_um: (!z_um.is_empty()).then(|| median(z_um)),
            power_w: mean(|(drive_v, current_a)| drive_v * current_a),
            resistance_ohm: mean(|(drive_v, current_a)| drive_v / current_a),
        }
    }
}

#[cfg(test)]
mod tests;
