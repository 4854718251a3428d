//! What is told of a board: who it is and what it is doing.

use std::fmt;

use control_core::Calibration;
use control_core::design::COLD_RESISTANCE_TOLERANCE;
use mirror_protocol::{
    CalibrationInfo, Identity, Kept, LEASE_FOREVER_MS, Lever, OptionBytes, Status, Text,
};
use serde::{Serialize, Serializer};

use crate::board::{Owner, View, level_um};
use crate::commands::history::History;
use crate::commands::moving::Readings;
use crate::commands::pose::{PlateReport, from_um};
use crate::commands::room::{self, Room};
use crate::commands::uncertainty::Uncertainty;
use crate::error::ToolError;
use crate::names::{limit_names, limited_line, state_name};
use crate::option_bytes::option_flaws;
use crate::report::{decimal, row, row_of_known};

/// A board's status.
#[derive(Serialize)]
pub(super) struct StatusReport {
    identity: Identity,
    /// Another process that has the board, or had it when it was asked and has let go of it since.
    pub(super) owner: Option<Owner>,
    /// Whether it has it still.
    pub(super) is_in_use: bool,
    #[serde(with = "CalibrationReport")]
    calibration: CalibrationInfo,
    /// What flows for each ampere that a board as designed reads; 1 where nobody has calibrated it.
    sense_gain: [f64; 4],
    up_s: f64,
    #[serde(flatten)]
    readings: Readings,
    /// Where the plate is asked to be on its way, or where the drives take it.
    pose: PlateReport,
    /// How far it may be from there.
    uncertainty: Uncertainty,
    limited_by: Vec<&'static str>,
    /// What each channel is doing.
    states: [String; 4],
    /// What is left of the lease of what is driven, if anything is.
    lease: Option<LeaseLeft>,
    /// V / I of each heater, where it is driven enough to tell.
    resistance_ohm: [Option<f64>; 4],
    /// Of each heater without any rise: what it told at calibration, where the board keeps a calibration that knows that, and else where the
    /// straight line begins by which temperatures are read.
    cold_ohm: [f64; 4],
    /// What that is worth in temperature: how far the rises may be off for want of a cold resistance that was
    /// measured; `None` where it was.
    uncertainty_k: Option<[f64; 4]>,
    /// What is known of the surroundings; `None` where the calibration cannot tell.
    room: Option<Room>,
    supply_v: f64,
    /// Where the mirror rests in its present surroundings: a heater cannot cool.
    lowest_position_um: f64,
    max_position_um: f64,
    max_drive_v: f64,
    missed_ticks: u32,
    late_ticks: u32,
    option_bytes: Option<OptionBytes>,
    /// What the firmware said when it stopped before this start.
    last_stop: String,
    dropped_samples: u32,
    /// The fault log, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    history: Option<History>,
}

/// A calibration as JSON: readers of JSON keep 53 bits of a number, so the hash is text, as in calibration files.
#[derive(Serialize)]
#[serde(remote = "CalibrationInfo")]
struct CalibrationReport {
    device: Text,
    date: Text,
    #[serde(serialize_with = "hexadecimal")]
    model_hash: u64,
    max_position_um: f32,
    max_drive_v: f32,
    cold_resistance_ohm: [f32; 4],
    tcr_per_k: [f32; 4],
    levers: [Lever; 4],
    kept: Kept,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn hexadecimal<S: Serializer>(hash: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{hash:016x}"))
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum LeaseLeft {
    Seconds(f64),
    Forever,
}

impl StatusReport {
    /// What a board tells, with its fault log where that is wanted.
    pub(super) async fn read(board: &View, history: bool) -> Result<Self, ToolError> {
        let status = board.status().await?;
        let calibration = board.calibration().await?;
        let settled = match calibration.kept {
            Kept::Yes => board.settled_calibration().await?,
            _ => None,
        };
        let begins_ohm = calibration.cold_resistance_ohm.map(decimal);
        let sense = board.sense().await?.sense;
        let history = match history {
            true => Some(History::new(board.fault_log().await?)),
            false => None,
        };
        Ok(Self {
            history,
            sense_gain: sense.gain.map(decimal),
            cold_ohm: settled.as_ref().map_or(begins_ohm, cold_ohm),
            ..Self::new(board.identity().clone(), calibration, &status)
        })
    }

    /// One word where all channels do the same.
    fn channels(&self) -> String {
        if self.states.iter().all(|state| *state == self.states[0]) {
            format!("all {}", self.states[0])
        } else {
            self.states.join(", ")
        }
    }

    fn new(identity: Identity, calibration: CalibrationInfo, status: &Status) -> Self {
        let readings = Readings::mean(&[status.telemetry]);
        let rises = readings.temperature_rise_k;
        let resistance = |i: usize| rises[i].map(|_| readings.drive_v[i] / readings.current_a[i]);
        Self {
            resistance_ohm: std::array::from_fn(resistance),
            uncertainty_k: uncertainty_k(&calibration, rises),
            cold_ohm: calibration.cold_resistance_ohm.map(decimal),
            up_s: f64::from(status.telemetry.tick) / f64::from(identity.tick_hz),
            identity,
            owner: None,
            is_in_use: false,
            calibration,
            sense_gain: [1.0; 4],
            readings,
            pose: PlateReport::from(&status.telemetry.pose),
            uncertainty: Uncertainty::from(&status.telemetry),
            limited_by: limit_names(status.telemetry.limits),
            states: status.telemetry.states.map(state_name),
            lease: status.health.lease_left_ms.map(|ms| match ms {
                LEASE_FOREVER_MS => LeaseLeft::Forever,
                ms => LeaseLeft::Seconds(f64::from(ms) * 1e-3),
            }),
            room: Room::of(status),
            supply_v: decimal(status.health.supply_v),
            missed_ticks: status.health.missed_ticks,
            late_ticks: status.health.late_ticks,
            option_bytes: status.option_bytes,
            last_stop: status.last_stop.as_str().to_owned(),
            lowest_position_um: level_um(status).0,
            max_position_um: decimal(status.max_position_um),
            max_drive_v: decimal(status.max_drive_v),
            dropped_samples: status.dropped_samples,
            history: None,
        }
    }
}

impl fmt::Display for StatusReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let identity = &self.identity;
        writeln!(f, "board      {}", identity.board)?;
        writeln!(
            f,
            "firmware   {} ({}), protocol {}, {} control ticks/s",
            identity.firmware_version, identity.build, identity.protocol_version, identity.tick_hz
        )?;
        match &self.owner {
            Some(owner) if self.is_in_use => writeln!(f, "in use     by {owner}")?,
            Some(owner) => writeln!(f, "owner      {owner}, until just now")?,
            None => {}
        }
        writeln!(f, "up         {:.1} s", self.up_s)?;
        writeln!(f, "calibrated {}", calibrated_words(&self.calibration))?;
        if self.sense_gain != [1.0; 4] {
            let percent = self.sense_gain.map(|gain| 100.0 * (gain - 1.0));
            writeln!(
                f,
                "sense      {}  from the gains as designed",
                row(percent, 2, "%")
            )?;
        }
        writeln!(
            f,
            "range      {} to {:.1} um, 0 to {:.2} V",
            from_um(self.lowest_position_um),
            self.max_position_um,
            self.max_drive_v
        )?;
        writeln!(f, "room       {}", room::line(self.room.as_ref()))?;
        writeln!(f, "supply     {:.2} V", self.supply_v)?;
        writeln!(f, "channels   {}", self.channels())?;
        writeln!(f, "pose       {}", self.pose)?;
        writeln!(f, "uncertain  {}", self.uncertainty)?;
        if let Some(z_um) = self.readings.sensor_z_um {
            let off_um = z_um - self.pose.z_um;
            writeln!(
                f,
                "sensor     {z_um:>9.3} um, {off_um:+.3} um from the pose"
            )?;
        }
        write!(f, "{}", self.readings)?;
        writeln!(
            f,
            "resistance {}",
            row_of_known(self.resistance_ohm, 1, "Ω")
        )?;
        writeln!(f, "cold       {}", row(self.cold_ohm, 1, "Ω"))?;
        if let Some(uncertainty_k) = self.uncertainty_k {
            let most = uncertainty_k.into_iter().fold(0.0, f64::max);
            writeln!(
                f,
                "           known to {:.0} ohm, so temperatures to {most:.1} K, until `host-tool calibrate` measures it",
                COLD_RESISTANCE_TOLERANCE.0
            )?;
        }
        writeln!(f, "{}", limited_line(&self.limited_by))?;
        match self.lease {
            Some(LeaseLeft::Seconds(left)) => {
                writeln!(f, "held for   {left:.1} s more, then ramped to zero")?;
            }
            Some(LeaseLeft::Forever) => writeln!(f, "held       until told otherwise")?,
            None => {}
        }
        if !self.last_stop.is_empty() {
            writeln!(f, "stopped    before this start: {}", self.last_stop)?;
        }
        if self.missed_ticks > 0 {
            writeln!(
                f,
                "missed     {} control ticks since start",
                self.missed_ticks
            )?;
        }
        if self.late_ticks > 0 {
            writeln!(
                f,
                "late       {} control ticks since start, driven one later",
                self.late_ticks
            )?;
        }
        for flaw in self.option_bytes.iter().flat_map(option_flaws) {
            writeln!(f, "options    {}", flaw.what)?;
        }
        if self.dropped_samples > 0 {
            writeln!(f, "dropped    {} samples since start", self.dropped_samples)?;
        }
        match &self.history {
            Some(history) => write!(f, "{history}"),
            None => Ok(()),
        }
    }
}

/// What each heater's resistance was at calibration without any rise: R0 (1 + xi dT), with the dT that its line told then.
fn cold_ohm(calibration: &Calibration) -> [f64; 4] {
    calibration.actuators().each_ref().map(|actuator| {
        let begins_ohm = decimal(actuator.cold_resistance.0);
        let told_k = match actuator.sensed_rises.is_known() {
            true => decimal(actuator.sensed_rises.knots[0]),
            false => 0.0,
        };
        begins_ohm * (1.0 + decimal(actuator.tcr.0) * told_k)
    })
}

/// By how much a rise is off where the cold resistance is the factory's, and off by its tolerance: dT = (R / R0 - 1) / xi,
/// and so (1 + xi dT) / xi for the whole of R0. `None` where the cold resistance was measured.
pub(crate) fn uncertainty_k(
    calibration: &CalibrationInfo,
    rises_k: [Option<f64>; 4],
) -> Option<[f64; 4]> {
    let is_factorys = matches!(calibration.kept, Kept::Factory | Kept::FactoryAsStoredIsBad);
    let of = |i: usize| {
        let tcr = decimal(calibration.tcr_per_k[i]);
        let part = f64::from(COLD_RESISTANCE_TOLERANCE.0 / calibration.cold_resistance_ohm[i]);
        part * (1.0 + tcr * rises_k[i].unwrap_or(0.0)) / tcr
    };
    is_factorys.then(|| std::array::from_fn(of))
}

/// Of which device and day a calibration is, and whether it is kept.
pub(crate) fn calibrated_words(calibration: &CalibrationInfo) -> String {
    let CalibrationInfo { device, date, .. } = calibration;
    let kept = kept_words(calibration.kept);
    let device = match (device.as_str(), calibration.kept) {
        // The factory's is of no device, and of no day.
        ("", Kept::Factory | Kept::FactoryAsStoredIsBad) => "",
        ("", _) => "an unnamed mirror",
        (named, _) => named,
    };
    let mut words = vec![device, date.as_str(), kept];
    words.retain(|word| !word.is_empty());
    words.join(", ")
}

pub(crate) fn kept_words(kept: Kept) -> &'static str {
    match kept {
        Kept::Yes => "kept in flash",
        Kept::Factory => "as the factory left it",
        Kept::FactoryAsStoredIsBad => {
            "the factory's, since the stored one is bad: calibrate the board again"
        }
        Kept::No => "not kept: a reset forgets it; its flash did not take it",
        Kept::OnTrial => "on trial: a reset or the next tool brings the one before back",
        Kept::Outdated => {
            "the one before the newest, which has rotted: calibrate again, or `clear` to go on with this one"
        }
    }
}

#[cfg(test)]
mod tests;
