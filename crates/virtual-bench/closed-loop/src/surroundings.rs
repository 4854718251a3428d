//! What positioning makes of other surroundings than those of the calibration.

use calibration::{RoomPoint, with_ambient_ratio};
use control_core::{Calibration, Estimate, Limit, Limits, Setpoint};
use emulated_board::{Device, Mirror};
use virtual_mirror::ConfigError;

use crate::{Loop, TICK_S};

/// Positions that are asked for (um), in a way that goes up and down.
pub const POSITIONS_UM: [f64; 5] = [60.0, 160.0, 20.0, 120.0, 60.0];
/// So long each is held (s): three times the slowest quick pole.
const STAY_S: f64 = 1.5;
/// How much warmer the other room is in which what a room is worth is measured (K).
const OTHER_ROOM_K: f64 = 10.0;

/// What is around a mirror, against its calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Around {
    /// How much warmer it is (K).
    pub rise_k: f64,
    /// By what the air takes more of the heat.
    pub air: f64,
}

impl Around {
    /// As at calibration.
    pub const CALIBRATION: Self = Self {
        rise_k: 0.0,
        air: 1.0,
    };
}

/// A position that was asked for there.
#[derive(Clone, Copy, Debug)]
pub struct Reached {
    /// Where to (um).
    pub asked_um: f64,
    /// How far from there it came to rest (um).
    pub error_um: f64,
    /// What acted in the end.
    pub limits: Limits,
    /// What the core knew of its surroundings then.
    pub known: Option<Estimate>,
}

impl Reached {
    /// Whether the surroundings leave it within reach.
    pub fn is_within_reach(&self) -> bool {
        !is_held_back(self.limits)
    }
}

/// Whether an end of the range or a bound holds the mirror where it was not asked to be.
pub(crate) fn is_held_back(limits: Limits) -> bool {
    let ends = [
        Limit::RoomWarm,
        Limit::DriveHigh,
        Limit::PowerHigh,
        Limit::TemperatureHigh,
    ];
    ends.into_iter().any(|end| limits.contains(end))
}

/// The static errors there, at the positions of [`POSITIONS_UM`] that the mirror has.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn errors(
    calibration: &mut Calibration,
    config: &impl Device,
    around: Around,
    compensates: bool,
) -> Result<Vec<Reached>, ConfigError> {
    let top_um = f64::from(calibration.max_position().0);
    let mut mirror = Loop::new(calibration, config)?;
    mirror.compensate_surroundings(compensates);
    mirror.surround(around);
    let positions = POSITIONS_UM.into_iter().filter(|um| *um < top_um);
    Ok(positions.map(|um| mirror.reach(um)).collect())
}

/// The calibration that knows what a room is worth to this mirror, by what a sensor sees of it in another room.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn calibrated_in_another_room(
    calibration: &Calibration,
    config: &impl Device,
) -> Result<Calibration, ConfigError> {
    let mut found = *calibration;
    let around = Around {
        rise_k: OTHER_ROOM_K,
        air: 1.0,
    };
    let reached = errors(&mut found, config, around, true)?;
    let within = reached.iter().filter(|reached| reached.is_within_reach());
    let points: Vec<RoomPoint> = within
        .filter_map(|reached| {
            Some(RoomPoint {
                asked_um: reached.asked_um,
                reached_um: reached.asked_um + reached.error_um,
                rise_k: f64::from(reached.known?.rise.0),
            })
        })
        .collect();
    Ok(with_ambient_ratio(calibration, &points).unwrap_or(*calibration))
}

/// How a mirror comes back after its surroundings have become warmer at once.
#[derive(Clone, Debug)]
pub struct Recovery {
    /// Its error, tick by tick, from the step on (um).
    pub errors_um: Vec<f64>,
    /// Until it stays within this of where it was asked to be (s).
    pub within_s: f64,
}

/// What the error must stay within after a step of the surroundings (um).
pub const RECOVERED_UM: f64 = 0.5;

/// A step of the surroundings by `rise_k` while a position is held that the mirror has been at for some seconds.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn recovery(
    calibration: &mut Calibration,
    config: &impl Device,
    (asked_um, rise_k): (f64, f64),
    compensates: bool,
) -> Result<Recovery, ConfigError> {
    let mut mirror = Loop::new(calibration, config)?;
    mirror.compensate_surroundings(compensates);
    for z_um in [0.3 * asked_um, asked_um] {
        mirror.hold(z_um, STAY_S);
    }
    mirror.set_ambient(rise_k);
    let setpoint = Setpoint::position(control_core::Micrometre(asked_um as f32));
    let errors_um: Vec<f64> = (0..(1.0 / TICK_S) as usize)
        .map(|_| mirror.tick(setpoint).0 - asked_um)
        .collect();
    let out = errors_um.iter().rposition(|um| um.abs() > RECOVERED_UM);
    Ok(Recovery {
        within_s: out.map_or(0.0, |last| (last + 1) as f64 * TICK_S),
        errors_um,
    })
}

impl<M: Mirror> Loop<'_, M> {
    pub(crate) fn surround(&mut self, around: Around) {
        self.set_ambient(around.rise_k);
        self.set_air_loss(around.air);
    }

    /// Holds a position for so long that a mirror has settled, and tells where it is.
    pub fn reach(&mut self, asked_um: f64) -> Reached {
        let error_um = self.hold(asked_um, STAY_S) - asked_um;
        let setpoint = Setpoint::position(control_core::Micrometre(asked_um as f32));
        Reached {
            asked_um,
            error_um,
            limits: self.tick(setpoint).1,
            known: self.surroundings(),
        }
    }
}
