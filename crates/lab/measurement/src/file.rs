//! A measurement file in memory.

use crate::Keys;
use std::cmp::Ordering;

/// How many actuators a mirror has.
pub const ACTUATORS: usize = 4;

/// One experiment: what its file says in comments, and its rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasurementFile {
    /// The `# key=value` comments.
    pub keys: Keys,
    /// Other comments, in their order.
    pub notes: Vec<String>,
    /// The measurement, in the order of time.
    pub rows: Vec<Row>,
}

/// One instant. The drive is what was applied from the previous row's time up to this one's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Time from the file's start; says nothing in a file of settled readings ([`Keys::is_steady`]).
    pub t_s: f64,
    /// Time from the session's start.
    pub t_global_s: Option<f64>,
    /// Voltage at each actuator's driver.
    pub voltage_v: [f64; ACTUATORS],
    /// Current of each actuator.
    pub current_a: [Option<f64>; ACTUATORS],
    /// Displacement of the mirror's centre from its first 0 V reading, positive towards the substrate.
    pub z_um: Option<f64>,
    /// Rotation about the x axis.
    pub tilt_x_deg: Option<f64>,
    /// Rotation about the y axis.
    pub tilt_y_deg: Option<f64>,
    /// Temperature of the surroundings.
    pub ambient_c: Option<f64>,
    /// How far a stage had moved the sensor's target, the whole mirror, towards the substrate; not at all where it says
    /// nothing.
    pub reference_um: Option<f64>,
    /// Where a controller was asked to bring the mirror.
    pub asked_um: Option<f64>,
    /// Half the width of the interval about [`Self::asked_um`] that holds the mirror in 95 of 100 cases, by what the controller
    /// knows.
    pub uncertainty_um: Option<f64>,
    /// Rotation about the x axis that a controller was asked for.
    pub asked_tilt_x_deg: Option<f64>,
    /// Rotation about the y axis that a controller was asked for.
    pub asked_tilt_y_deg: Option<f64>,
    /// What has begun since the row before, as bits: 1 a frame, 2 a line.
    pub trigger: Option<u8>,
}

impl Row {
    /// The highest of the actuators' drives (V), 0 where none is driven.
    pub fn highest_v(&self) -> f64 {
        self.voltage_v.into_iter().fold(0.0, f64::max)
    }

    /// What the drives heat by, up to the resistance: the sum of their squares (V^2).
    pub(crate) fn heating(&self) -> f64 {
        self.voltage_v.iter().map(|volts| volts * volts).sum()
    }
}

impl MeasurementFile {
    /// Whether any row has a displacement.
    pub fn has_displacement(&self) -> bool {
        self.rows.iter().any(|row| row.z_um.is_some())
    }

    /// Whether any row has a current.
    pub fn has_current(&self) -> bool {
        self.rows
            .iter()
            .any(|row| row.current_a.iter().any(Option::is_some))
    }

    /// The first temperature of the surroundings that it states (degC).
    pub fn ambient_c(&self) -> Option<f64> {
        self.rows.iter().find_map(|row| row.ambient_c)
    }

    /// Whether both count `t_global_s` from one instant.
    pub fn shares_clock(&self, other: &Self) -> bool {
        let on_a_clock = |file: &Self| {
            file.rows
                .first()
                .is_some_and(|row| row.t_global_s.is_some())
        };
        on_a_clock(self) && on_a_clock(other) && self.keys.session() == other.keys.session()
    }

    /// Brings the rows into an order that does not depend on the one they came in: by drive, and at equal drives by what was
    /// read.
    pub(crate) fn sort_by_drive(&mut self) {
        let number = |row: &Row| {
            let read = row.current_a.into_iter().chain([row.z_um, row.ambient_c]);
            let read = read.map(|value| value.unwrap_or(f64::NEG_INFINITY));
            row.voltage_v.into_iter().chain(read).collect::<Vec<f64>>()
        };
        self.rows.sort_by(|a, b| {
            let pairs = number(a).into_iter().zip(number(b));
            let orders = pairs.map(|(a, b)| a.total_cmp(&b));
            orders.fold(Ordering::Equal, Ordering::then)
        });
    }

    /// The `experiment` key, or `experiment` where there is none.
    pub fn experiment(&self) -> &str {
        self.keys.get("experiment").unwrap_or("experiment")
    }
}
