//! The `# key=value` comments of a file.

/// White noise of a current, one standard deviation: its parts add as squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentNoise {
    /// What is the same at every current.
    pub constant_a: f64,
    /// What is in proportion to the current.
    pub ratio: f64,
}

impl CurrentNoise {
    /// Of a reading.
    pub fn at(&self, current_a: f64) -> f64 {
        self.constant_a.hypot(self.ratio * current_a)
    }
}

/// Keys and values in the order in which they were written. Any key is kept; the known ones have accessors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Keys(Vec<(String, String)>);

impl Keys {
    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.0
            .iter()
            .find(|(name, _)| name == key)
            .map(|(_, value)| value.as_str())
    }

    /// Adds a key, or changes its value. Line breaks and outer blanks do not survive a file, so they are dropped here.
    ///
    /// # Panics
    /// If the key is empty or has anything but letters, digits and underscores: it comes from code, not from users.
    pub fn set(&mut self, key: &str, value: &str) {
        assert!(is_key(key), "'{key}' is no key");
        let value = value
            .split(['\n', '\r'])
            .map(str::trim)
            .collect::<Vec<_>>()
            .join(" ")
            .trim()
            .to_owned();
        match self.0.iter_mut().find(|(name, _)| name == key) {
            Some(entry) => entry.1 = value,
            None => self.0.push((key.into(), value)),
        }
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0
            .iter()
            .map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// White noise of the displacement, one standard deviation (`noise_z_nm`).
    pub fn displacement_noise_um(&self) -> Option<f64> {
        self.number("noise_z_nm").map(|nm| nm * 1e-3)
    }

    /// White noise of the currents (`noise_I_uA`, `noise_I_ratio`).
    pub fn current_noise(&self) -> Option<CurrentNoise> {
        let constant_a = self.number("noise_I_uA").map(|ua| ua * 1e-6);
        let ratio = self.number("noise_I_ratio");
        (constant_a.is_some() || ratio.is_some()).then(|| CurrentNoise {
            constant_a: constant_a.unwrap_or(0.0),
            ratio: ratio.unwrap_or(0.0),
        })
    }

    /// States the white noise of the currents.
    pub fn set_current_noise(&mut self, noise: CurrentNoise) {
        self.set("noise_I_uA", &format!("{:?}", 1e6 * noise.constant_a));
        self.set("noise_I_ratio", &format!("{:?}", noise.ratio));
    }

    /// How far the drives that are stated may be from those that were, one standard deviation (`noise_V_mV`).
    pub fn drive_noise_v(&self) -> Option<f64> {
        self.number("noise_V_mV").map(|mv| mv * 1e-3)
    }

    /// The drive that was held just before t_s = 0, and for how long (`prehold_V`, `prehold_s`); otherwise 0 V.
    pub fn prehold(&self) -> Option<(f64, f64)> {
        Some((self.number("prehold_V")?, self.number("prehold_s")?))
    }

    /// When the clock of `t_global_s` began (`session`): files that say the same share it, and files that say nothing share
    /// one.
    pub fn session(&self) -> Option<&str> {
        self.get("session")
    }

    /// Whether the drive runs straight from row to row (`drive=` says sine or ramp, or that a controller made it for a
    /// position) rather than being held.
    pub fn drive_is_interpolated(&self) -> bool {
        let runs = |drive: &str| drive.contains("sin") || matches!(drive, "position" | "ramp");
        self.get("drive").is_some_and(runs)
    }

    /// Whether each row is a reading of its own, made when everything had settled (`steady`): then its time and the order of
    /// the rows say nothing.
    pub fn is_steady(&self) -> bool {
        self.get("steady").is_some_and(|steady| steady != "no")
    }

    /// What the cold heater roughly is, for a heater that is not this mirror's (`R0_ohm`).
    pub fn nominal_resistance_ohm(&self) -> Option<f64> {
        self.number("R0_ohm")
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.get(key)?.parse().ok()
    }
}

/// Keys whose value must be a number that is not negative.
pub(crate) const NUMERIC: [&str; 7] = [
    "noise_z_nm",
    "noise_I_uA",
    "noise_I_ratio",
    "noise_V_mV",
    "prehold_V",
    "prehold_s",
    "R0_ohm",
];

pub(crate) fn is_key(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}
