//! Says what is wrong with a mirror file: which key, what it says, what it may say.

use super::{ConfigError, MirrorConfig, Segment};

/// A key's lowest and highest value.
fn within(
    key: impl Into<String>,
    value: f64,
    low: f64,
    high: f64,
    unit: &str,
) -> Result<(), ConfigError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ConfigError::Range {
        key: key.into(),
        value: value.to_string(),
        range: format!("from {low} to {high} {unit}").trim_end().to_owned(),
    })
}

impl MirrorConfig {
    /// Checks every number against what a mirror can have.
    ///
    /// # Errors
    /// [`ConfigError::Range`] for the first one outside.
    pub fn check(&self) -> Result<(), ConfigError> {
        within("ambient_c", self.ambient_c, -60.0, 150.0, "degC")?;
        within("drive_limit_v", self.drive_limit_v, 0.1, 12.0, "V")?;
        within("heater.ohm", self.heater.ohm, 10.0, 1e5, "ohm")?;
        within("heater.tcr_per_k", self.heater.tcr_per_k, 0.0, 1e-2, "1/K")?;
        for ohm in self.heater.leads_ohm {
            within("heater.leads_ohm", ohm, 0.0, 1e4, "ohm")?;
        }
        self.check_materials()?;
        self.check_segments()?;
        within("plate.side_um", self.plate.side_um, 50.0, 5e3, "um")?;
        within("plate.silicon_um", self.plate.silicon_um, 1.0, 500.0, "um")?;
        within(
            "plate.air_loss_uw_k",
            self.plate.air_loss_uw_k,
            0.0,
            1e5,
            "uW/K",
        )?;
        within("plate.lever_um", self.plate.lever_um, 10.0, 1e4, "um")?;
        self.check_frame()?;
        within(
            "shape.rest_height_um",
            self.shape.rest_height_um,
            0.0,
            400.0,
            "um",
        )?;
        within("shape.clamp", self.shape.clamp, 0.0, 1.0, "")?;
        self.check_motion()?;
        for (key, value) in [
            ("spread.ohm", self.spread.ohm),
            ("spread.tcr", self.spread.tcr),
            ("spread.air_loss", self.spread.air_loss),
            ("spread.bend", self.spread.bend),
        ] {
            within(key, value, 0.0, 0.2, "")?;
        }
        for (key, factors) in [
            ("trim.ohm", self.trim.ohm),
            ("trim.tcr", self.trim.tcr),
            ("trim.air_loss", self.trim.air_loss),
            ("trim.bend", self.trim.bend),
        ] {
            for factor in factors {
                within(key, factor, 0.5, 1.5, "")?;
            }
        }
        within("air_to_frame", self.air_to_frame, 0.0, 1.0, "")?;
        for (effect, strength) in self.effects.iter() {
            within(format!("effects.{effect}"), strength, 0.0, 10.0, "")?;
        }
        self.check_sensor()
    }

    fn check_materials(&self) -> Result<(), ConfigError> {
        let m = &self.materials;
        for (name, material) in [("al", m.al), ("sio2", m.sio2), ("pt", m.pt), ("si", m.si)] {
            let key = |what: &str| format!("materials.{name}.{what}");
            within(
                key("conductivity_w_m_k"),
                material.conductivity_w_m_k,
                0.01,
                2e3,
                "W/(m K)",
            )?;
            within(
                key("heat_mj_m3_k"),
                material.heat_mj_m3_k,
                0.1,
                10.0,
                "MJ/(m3 K)",
            )?;
            within(
                key("expansion_ppm_k"),
                material.expansion_ppm_k,
                -10.0,
                100.0,
                "1e-6/K",
            )?;
            within(key("modulus_gpa"), material.modulus_gpa, 0.1, 1e3, "GPa")?;
            if let Some(residual) = material.residual_ppm {
                within(key("residual_ppm"), residual, -1e3, 1e3, "1e-6")?;
            }
        }
        Ok(())
    }

    fn check_segments(&self) -> Result<(), ConfigError> {
        for (i, segment) in self.segments.iter().enumerate() {
            segment.check(i)?;
        }
        let refuse = |value: String, range: &str| {
            Err(ConfigError::Range {
                key: "segments".into(),
                value,
                range: range.into(),
            })
        };
        let cells: usize = self.segments.iter().map(|s| s.cells).sum();
        if !(4..=128).contains(&cells) {
            return refuse(
                format!("{cells} cells in all"),
                "from 4 to 128 cells in all",
            );
        }
        if !self.segments.iter().any(|s| s.heated) {
            return refuse(
                "without a heated one".into(),
                "at least one with `heated = true`",
            );
        }
        Ok(())
    }

    fn check_frame(&self) -> Result<(), ConfigError> {
        let Some(frame) = self.frame else {
            return Ok(());
        };
        within("frame.frame_uj_k", frame.frame_uj_k, 0.01, 1e7, "uJ/K")?;
        within(
            "frame.frame_to_package_uw_k",
            frame.frame_to_package_uw_k,
            0.1,
            1e8,
            "uW/K",
        )?;
        within("frame.package_mj_k", frame.package_mj_k, 1e-3, 1e6, "mJ/K")?;
        within(
            "frame.package_to_room_uw_k",
            frame.package_to_room_uw_k,
            0.1,
            1e8,
            "uW/K",
        )
    }

    fn check_motion(&self) -> Result<(), ConfigError> {
        let Some(motion) = self.motion else {
            return Ok(());
        };
        within("motion.piston_hz", motion.piston_hz, 10.0, 1e5, "Hz")?;
        within("motion.tilt_hz", motion.tilt_hz, 10.0, 1e5, "Hz")?;
        within("motion.q", motion.q, 0.51, 1e4, "")
    }

    fn check_sensor(&self) -> Result<(), ConfigError> {
        let s = &self.sensor;
        within(
            "sensor.position_noise_nm",
            s.position_noise_nm,
            0.0,
            1e5,
            "nm",
        )?;
        within("sensor.wander_nm", s.wander_nm, 0.0, 1e5, "nm")?;
        within("sensor.wander_s", s.wander_s, 1e-3, 1e6, "s")?;
        within(
            "sensor.tilt_noise_mdeg",
            s.tilt_noise_mdeg,
            0.0,
            1e4,
            "mdeg",
        )?;
        within(
            "sensor.current_noise_ua",
            s.current_noise_ua,
            0.0,
            1e4,
            "uA",
        )?;
        within(
            "sensor.current_noise_ratio",
            s.current_noise_ratio,
            0.0,
            0.1,
            "",
        )?;
        within(
            "sensor.current_gain_ratio",
            s.current_gain_ratio,
            0.0,
            0.1,
            "",
        )
    }
}

impl Segment {
    fn check(&self, index: usize) -> Result<(), ConfigError> {
        let key = |what: &str| format!("segments[{index}] ({}).{what}", self.name);
        within(key("length_um"), self.length_um, 1.0, 5e3, "um")?;
        within(key("width_um"), self.width_um, 1.0, 1e3, "um")?;
        within(key("cells"), self.cells as f64, 1.0, 64.0, "")?;
        within(
            key("air_loss_w_m_k"),
            self.air_loss_w_m_k,
            0.0,
            10.0,
            "W/(m K)",
        )?;
        within(key("layers"), self.layers.len() as f64, 1.0, 8.0, "films")?;
        for (i, layer) in self.layers.iter().enumerate() {
            within(key(&format!("layers[{i}].um")), layer.um, 0.01, 20.0, "um")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(edit: impl Fn(&mut MirrorConfig)) -> String {
        let mut config = MirrorConfig::bench();
        edit(&mut config);
        config.check().expect_err("must be refused").to_string()
    }

    #[test]
    fn a_number_out_of_range_is_named_with_its_range() {
        assert_eq!(
            refusal(|c| c.heater.ohm = -3.0),
            "heater.ohm is -3, but must be from 10 to 100000 ohm"
        );
        assert_eq!(
            refusal(|c| c.segments[1].layers[0].um = 0.0),
            "segments[1] (NI).layers[0].um is 0, but must be from 0.01 to 20 um"
        );
        assert!(refusal(|c| c.shape.clamp = f64::NAN).contains("shape.clamp is NaN"));
    }

    #[test]
    fn a_beam_without_heater_is_refused() {
        let said = refusal(|c| c.segments.iter_mut().for_each(|s| s.heated = false));
        assert!(said.contains("heated = true"), "{said}");
    }

    #[test]
    fn an_unknown_key_is_refused_by_name() {
        let text = include_str!("../../mirrors/bench.toml").replace("tcr_per_k", "tcr");
        let said = MirrorConfig::from_toml(&text)
            .expect_err("must be refused")
            .to_string();
        assert!(
            said.contains("`tcr`") && said.contains("tcr_per_k"),
            "{said}"
        );
    }
}
