//! The columns of a measurement file.

use crate::{ACTUATORS, Row};

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// `t_s`, time from the file's start.
    Time,
    /// `t_global_s`, time from the session's start.
    GlobalTime,
    /// `V_V`, the voltage of all four actuators.
    VoltageOfAll,
    /// `V1_V` to `V4_V`.
    Voltage(usize),
    /// `I_A`, the current of each of the four actuators.
    CurrentOfEach,
    /// `I1_A` to `I4_A`.
    Current(usize),
    /// `z_um`.
    Displacement,
    /// `tilt_x_deg`.
    TiltX,
    /// `tilt_y_deg`.
    TiltY,
    /// `T_ambient_C`.
    Ambient,
    /// `reference_um`.
    Reference,
    /// `z_asked_um`.
    Asked,
    /// `z_uncertainty_um`.
    Uncertainty,
    /// `tilt_x_asked_deg`.
    AskedTiltX,
    /// `tilt_y_asked_deg`.
    AskedTiltY,
    /// `trigger`.
    Trigger,
}

/// Every column with its name, in the order in which files are written.
pub const COLUMNS: [(&str, Column); 22] = [
    ("t_global_s", Column::GlobalTime),
    ("t_s", Column::Time),
    ("V_V", Column::VoltageOfAll),
    ("V1_V", Column::Voltage(0)),
    ("V2_V", Column::Voltage(1)),
    ("V3_V", Column::Voltage(2)),
    ("V4_V", Column::Voltage(3)),
    ("z_um", Column::Displacement),
    ("I_A", Column::CurrentOfEach),
    ("I1_A", Column::Current(0)),
    ("I2_A", Column::Current(1)),
    ("I3_A", Column::Current(2)),
    ("I4_A", Column::Current(3)),
    ("tilt_x_deg", Column::TiltX),
    ("tilt_y_deg", Column::TiltY),
    ("T_ambient_C", Column::Ambient),
    ("reference_um", Column::Reference),
    ("z_asked_um", Column::Asked),
    ("z_uncertainty_um", Column::Uncertainty),
    ("tilt_x_asked_deg", Column::AskedTiltX),
    ("tilt_y_asked_deg", Column::AskedTiltY),
    ("trigger", Column::Trigger),
];

impl Column {
    /// The column of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        COLUMNS
            .iter()
            .find(|(known, _)| *known == name)
            .map(|&(_, column)| column)
    }

    /// Whether a row may leave it empty.
    pub fn may_be_empty(self) -> bool {
        self != Self::Time && !self.is_drive()
    }

    /// Whether it is a voltage that an actuator is driven with.
    pub(crate) fn is_drive(self) -> bool {
        matches!(self, Self::VoltageOfAll | Self::Voltage(_))
    }

    /// The column that may stand for this one in all four actuators.
    pub(crate) fn of_all(self) -> Self {
        match self {
            Self::Voltage(_) => Self::VoltageOfAll,
            Self::Current(_) => Self::CurrentOfEach,
            other => other,
        }
    }

    /// Stores a value of this column in a row.
    pub fn store(self, row: &mut Row, value: f64) {
        match self {
            Self::Time => row.t_s = value,
            Self::GlobalTime => row.t_global_s = Some(value),
            Self::VoltageOfAll => row.voltage_v = [value; ACTUATORS],
            Self::Voltage(actuator) => row.voltage_v[actuator] = value,
            Self::CurrentOfEach => row.current_a = [Some(value); ACTUATORS],
            Self::Current(actuator) => row.current_a[actuator] = Some(value),
            Self::Displacement => row.z_um = Some(value),
            Self::TiltX => row.tilt_x_deg = Some(value),
            Self::TiltY => row.tilt_y_deg = Some(value),
            Self::Ambient => row.ambient_c = Some(value),
            Self::Reference => row.reference_um = Some(value),
            Self::Asked => row.asked_um = Some(value),
            Self::Uncertainty => row.uncertainty_um = Some(value),
            Self::AskedTiltX => row.asked_tilt_x_deg = Some(value),
            Self::AskedTiltY => row.asked_tilt_y_deg = Some(value),
            Self::Trigger => row.trigger = Some(value as u8),
        }
    }

    /// The value of this column in a row, for the columns that files are written with.
    pub fn value(self, row: &Row) -> Option<f64> {
        match self {
            Self::Time => Some(row.t_s),
            Self::GlobalTime => row.t_global_s,
            Self::Voltage(actuator) => Some(row.voltage_v[actuator]),
            Self::Current(actuator) => row.current_a[actuator],
            Self::Displacement => row.z_um,
            Self::TiltX => row.tilt_x_deg,
            Self::TiltY => row.tilt_y_deg,
            Self::Ambient => row.ambient_c,
            Self::Reference => row.reference_um,
            Self::Asked => row.asked_um,
            Self::Uncertainty => row.uncertainty_um,
            Self::AskedTiltX => row.asked_tilt_x_deg,
            Self::AskedTiltY => row.asked_tilt_y_deg,
            Self::Trigger => row.trigger.map(f64::from),
            Self::VoltageOfAll | Self::CurrentOfEach => None,
        }
    }
}

/// What to write instead of a column name that is not known: the same quantity in the file's own unit.
pub fn suggestion(unknown: &str) -> String {
    if unknown.contains([';', '\t']) {
        return "this is another program's table; `host-tool import` makes a measurement file of it"
            .into();
    }
    let quantity = unknown.to_ascii_lowercase();
    let starts = |prefixes: &[&str]| prefixes.iter().any(|prefix| quantity.starts_with(prefix));
    let meant = if starts(&["tilt_x", "theta_x", "rx"]) {
        "tilt_x_deg, in degrees"
    } else if starts(&["tilt_y", "theta_y", "ry"]) {
        "tilt_y_deg, in degrees"
    } else if starts(&["t_amb", "ambient", "temp"]) {
        "T_ambient_C, in degrees Celsius"
    } else if starts(&["ref", "stage"]) {
        "reference_um, in micrometres"
    } else if starts(&["t_global", "time_global"]) {
        "t_global_s, in seconds"
    } else if starts(&["t"]) {
        "t_s, in seconds"
    } else if starts(&["z", "d", "pos"]) {
        "z_um, in micrometres"
    } else if starts(&["i", "current"]) {
        "I1_A to I4_A or I_A, in amperes"
    } else if starts(&["v", "u", "volt"]) {
        "V1_V to V4_V or V_V, in volts"
    } else {
        let known: Vec<_> = COLUMNS.iter().map(|(name, _)| *name).collect();
        return format!(
            "the columns are {}; write other information in a # comment",
            known.join(", ")
        );
    };
    format!(
        "if it is that quantity, call it {meant}, and convert its values, as `host-tool import` does"
    )
}
