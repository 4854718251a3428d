//! What can be seen of a mirror.

/// Everything that can be seen of a mirror at one moment, without noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Displacement of the plate's centre from its 0 V rest position, positive towards the substrate (um).
    pub z_um: f64,
    /// Where the displacement sensor's target seems to be (um): the displacement and what a stage adds, behind the
    /// sensor's output filter if it has one.
    pub seen_z_um: f64,
    /// Tilt about the x axis (deg): positive when the +y edge, actuator 2's, is nearer to the substrate than actuator
    /// 4's.
    pub tilt_x_deg: f64,
    /// Tilt about the y axis (deg): positive when the +x edge, actuator 1's, is nearer than actuator 3's.
    pub tilt_y_deg: f64,
    /// Current of each actuator (A), with the drive's sign.
    pub current_a: [f64; 4],
    /// Hottest temperature anywhere in the mirror (K above ambient).
    pub hottest_k: f64,
    /// Mean temperature of each heater (K above ambient): what its resistance tells.
    pub heater_mean_k: [f64; 4],
    /// Temperature of the room (degC).
    pub ambient_c: f64,
}
