//! A measurement file in memory.

use crate::Keys;

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
    /// Time from the file's start.
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

    /// The `experiment` key, or `experiment` where there is none.
    pub fn experiment(&self) -> &str {
        self.keys.get("experiment").unwrap_or("experiment")
    }
}
