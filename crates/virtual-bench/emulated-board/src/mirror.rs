//! A mirror, whoever's equations move it: what a plant and its benches need of one.

use foreign_mirror::{ForeignConfig, ForeignMirror};
use virtual_mirror::{ConfigError, Effect, MirrorConfig, State, VirtualMirror};

/// A mirror being driven.
pub trait Mirror: Clone + Send + 'static {
    /// So many seconds (s) at four voltages (V). In no time the currents are those of the voltages, and nothing moves.
    fn step(&mut self, drive_v: [f64; 4], seconds: f64);

    /// What can be seen of it.
    fn state(&self) -> State;

    /// Its room is so much warmer than the one that it was made in from now on (K).
    fn set_ambient(&mut self, rise_k: f64);

    /// The air takes so many times the heat from now on that it took when the mirror was made.
    fn set_air_loss(&mut self, factor: f64);
}

/// What a mirror is made from.
pub trait Device: Clone + Send + Sync + 'static {
    /// What is made.
    type Mirror: Mirror;

    /// The mirror at rest.
    ///
    /// # Errors
    /// Where a number is out of range.
    fn make(&self) -> Result<Self::Mirror, ConfigError>;

    /// The same mirror without its inertia, which no drive of a tick holds.
    ///
    /// # Errors
    /// Where a number is out of range.
    fn without_inertia(&self) -> Result<Self::Mirror, ConfigError>;

    /// What it is called.
    fn name(&self) -> &str;

    /// What the tolerances of its board, and the noise of its instruments, are drawn from.
    fn seed(&self) -> u64;
}

impl Mirror for VirtualMirror {
    fn step(&mut self, drive_v: [f64; 4], seconds: f64) {
        self.advance(drive_v, seconds);
    }

    fn state(&self) -> State {
        Self::state(self)
    }

    fn set_ambient(&mut self, rise_k: f64) {
        Self::set_ambient(self, rise_k);
    }

    fn set_air_loss(&mut self, factor: f64) {
        Self::set_air_loss(self, factor);
    }
}

impl Device for MirrorConfig {
    type Mirror = VirtualMirror;

    fn make(&self) -> Result<VirtualMirror, ConfigError> {
        VirtualMirror::new(self)
    }

    fn without_inertia(&self) -> Result<VirtualMirror, ConfigError> {
        let mut config = self.clone().with_effect(Effect::Resonance, 0.0);
        config.motion = None;
        VirtualMirror::new(&config)
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn seed(&self) -> u64 {
        self.seed
    }
}

impl Mirror for ForeignMirror {
    fn step(&mut self, drive_v: [f64; 4], seconds: f64) {
        Self::step(self, drive_v, seconds);
    }

    fn state(&self) -> State {
        let [tilt_x_deg, tilt_y_deg] = self.tilts_deg();
        let heater_mean_k = self.heater_k();
        State {
            z_um: self.z_um(),
            seen_z_um: self.z_um(),
            tilt_x_deg,
            tilt_y_deg,
            current_a: self.current_a(),
            hottest_k: heater_mean_k.into_iter().fold(0.0, f64::max),
            heater_mean_k,
            ambient_c: self.ambient_c(),
        }
    }

    fn set_ambient(&mut self, rise_k: f64) {
        Self::set_ambient(self, rise_k);
    }

    fn set_air_loss(&mut self, factor: f64) {
        Self::set_air_loss(self, factor);
    }
}

impl Device for ForeignConfig {
    type Mirror = ForeignMirror;

    fn make(&self) -> Result<ForeignMirror, ConfigError> {
        Ok(ForeignMirror::new(self))
    }

    fn without_inertia(&self) -> Result<ForeignMirror, ConfigError> {
        Ok(ForeignMirror::new(self).without_inertia())
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn seed(&self) -> u64 {
        self.seed
    }
}
