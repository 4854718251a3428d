//! The `# key=value` comments of a file.

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

    /// The drive that was held just before t_s = 0, and for how long (`prehold_V`, `prehold_s`); otherwise 0 V.
    pub fn prehold(&self) -> Option<(f64, f64)> {
        Some((self.number("prehold_V")?, self.number("prehold_s")?))
    }

    /// When the clock of `t_global_s` began (`session`): files that say the same share it, and files that say nothing share
    /// one.
    pub fn session(&self) -> Option<&str> {
        self.get("session")
    }

    /// Whether the drive runs straight from row to row (`drive=` says sine, or that a controller made it for a position)
    /// rather than being held.
    pub fn drive_is_interpolated(&self) -> bool {
        self.get("drive")
            .is_some_and(|drive| drive.contains("sin") || drive == "position")
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
pub(crate) const NUMERIC: [&str; 4] = ["noise_z_nm", "prehold_V", "prehold_s", "R0_ohm"];

pub(crate) fn is_key(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}
