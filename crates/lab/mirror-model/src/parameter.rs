//! The numbers of the model: one struct to compute with, one table to read, print and store them by.

use std::fmt;

/// The parameters of eqs. 3-9, with Table 1's values as [`Parameters::PAPER`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// L_NI, length of the non-inverted bimorph.
    pub noninverted_length_um: f64,
    /// L_IV, length of the inverted bimorph.
    pub inverted_length_um: f64,
    /// L_OL, length of the straight overlap between the two.
    pub overlap_length_um: f64,
    /// t_b, thickness of the bimorph.
    pub thickness_um: f64,
    /// beta_b, curvature coefficient of eq. 6, between 0 and 1.5.
    pub curvature_coefficient: f64,
    /// Difference of the two layers' thermal expansions.
    pub expansion_difference_per_k: f64,
    /// K of eq. 9, the correction for the Pt layer and the overlap.
    pub deflection_factor: f64,
    /// R0, the heater's resistance at ambient temperature.
    pub cold_resistance_ohm: f64,
    /// xi, relative growth of the heater's resistance.
    pub resistance_coefficient_per_k: f64,
    /// R_T, the mean temperature rise that one watt makes.
    pub thermal_resistance_k_per_w: f64,
    /// Time constant of the fastest thermal pole; 0 is at once. Its weight is what the other two leave of 1.
    pub fast_s: f64,
    /// Weight of the middle thermal pole.
    pub middle_weight: f64,
    /// Time constant of the middle thermal pole.
    pub middle_s: f64,
    /// Weight of the slow thermal pole.
    pub slow_weight: f64,
    /// Time constant of the slow thermal pole.
    pub slow_s: f64,
    /// The highest drive. It bounds what the inverses accept.
    pub drive_limit_v: f64,
}

impl Parameters {
    /// Table 1 of the paper with the printed exponents corrected, and its section 4.2 for R_T. The paper gives no time
    /// constants, so there are none.
    pub const PAPER: Self = Self {
        noninverted_length_um: 250.0,
        inverted_length_um: 125.0,
        overlap_length_um: 120.0,
        thickness_um: 2.4,
        curvature_coefficient: 1.5,
        expansion_difference_per_k: 2.22e-5,
        deflection_factor: 0.921,
        cold_resistance_ohm: 360.0,
        resistance_coefficient_per_k: 3.92e-3,
        thermal_resistance_k_per_w: 5.7e3,
        fast_s: 0.0,
        middle_weight: 0.0,
        middle_s: 0.0,
        slow_weight: 0.0,
        slow_s: 0.0,
        drive_limit_v: 3.5,
    };

    /// The value of one parameter, in its unit of [`TABLE`].
    pub fn get(&self, symbol: Symbol) -> f64 {
        (symbol.entry().get)(self)
    }

    /// Changes one parameter, in its unit of [`TABLE`].
    pub fn set(&mut self, symbol: Symbol, value: f64) {
        *(symbol.entry().get_mut)(self) = value;
    }
}

/// A parameter by its symbol in the paper and in model files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the table says what each means")]
pub enum Symbol {
    NoninvertedLength,
    InvertedLength,
    OverlapLength,
    Thickness,
    CurvatureCoefficient,
    ExpansionDifference,
    DeflectionFactor,
    ColdResistance,
    ResistanceCoefficient,
    ThermalResistance,
    FastTime,
    MiddleWeight,
    MiddleTime,
    SlowWeight,
    SlowTime,
    DriveLimit,
}

impl Symbol {
    /// What is known of the parameter.
    pub fn entry(self) -> &'static Entry {
        &TABLE[self as usize]
    }

    /// The parameter of this name in model files, such as `R_T`.
    pub fn from_name(name: &str) -> Option<Self> {
        TABLE
            .iter()
            .find(|entry| entry.name == name)
            .map(|entry| entry.symbol)
    }
}

impl fmt::Display for Symbol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.entry().name)
    }
}

/// What a reader, a printer and a fitter know of a parameter.
pub struct Entry {
    /// Which one it is.
    pub symbol: Symbol,
    /// Its name in model files.
    pub name: &'static str,
    /// The unit that its value has everywhere.
    pub unit: &'static str,
    /// What it is, in words.
    pub meaning: &'static str,
    /// Lowest and highest value that any such device could have.
    pub range: (f64, f64),
    get: fn(&Parameters) -> f64,
    get_mut: fn(&mut Parameters) -> &mut f64,
}

macro_rules! entry {
    ($symbol:ident, $name:literal, $unit:literal, $field:ident, $range:expr, $meaning:literal) => {
        Entry {
            symbol: Symbol::$symbol,
            name: $name,
            unit: $unit,
            meaning: $meaning,
            range: $range,
            get: |p| p.$field,
            get_mut: |p| &mut p.$field,
        }
    };
}

/// Every parameter, in the order of [`Symbol`]. The ranges are wide enough for heaters of other materials.
pub static TABLE: [Entry; 16] = [
    entry!(
        NoninvertedLength,
        "L_NI",
        "um",
        noninverted_length_um,
        (1.0, 1e4),
        "length of the non-inverted bimorph"
    ),
    entry!(
        InvertedLength,
        "L_IV",
        "um",
        inverted_length_um,
        (1.0, 1e4),
        "length of the inverted bimorph"
    ),
    entry!(
        OverlapLength,
        "L_OL",
        "um",
        overlap_length_um,
        (0.0, 1e4),
        "length of the straight overlap"
    ),
    entry!(
        Thickness,
        "t_b",
        "um",
        thickness_um,
        (0.01, 100.0),
        "thickness of the bimorph"
    ),
    entry!(
        CurvatureCoefficient,
        "beta_b",
        "1",
        curvature_coefficient,
        (0.01, 3.0),
        "curvature coefficient"
    ),
    entry!(
        ExpansionDifference,
        "d_alpha",
        "1/K",
        expansion_difference_per_k,
        (1e-7, 1e-3),
        "difference of the expansions"
    ),
    entry!(
        DeflectionFactor,
        "K",
        "1",
        deflection_factor,
        (0.01, 2.0),
        "correction for the Pt layer and the overlap"
    ),
    entry!(
        ColdResistance,
        "R0",
        "ohm",
        cold_resistance_ohm,
        (1e-2, 1e6),
        "cold resistance of the heater"
    ),
    entry!(
        ResistanceCoefficient,
        "xi",
        "1/K",
        resistance_coefficient_per_k,
        (1e-6, 1e-1),
        "growth of the heater's resistance"
    ),
    entry!(
        ThermalResistance,
        "R_T",
        "K/W",
        thermal_resistance_k_per_w,
        (1e-2, 1e7),
        "temperature rise that one watt makes"
    ),
    entry!(
        FastTime,
        "tau_fast",
        "s",
        fast_s,
        (0.0, 1e4),
        "time constant of the fast thermal pole"
    ),
    entry!(
        MiddleWeight,
        "w_mid",
        "1",
        middle_weight,
        (0.0, 0.95),
        "weight of the middle thermal pole"
    ),
    entry!(
        MiddleTime,
        "tau_mid",
        "s",
        middle_s,
        (0.0, 1e4),
        "time constant of the middle thermal pole"
    ),
    entry!(
        SlowWeight,
        "w_slow",
        "1",
        slow_weight,
        (0.0, 0.95),
        "weight of the slow thermal pole"
    ),
    entry!(
        SlowTime,
        "tau_slow",
        "s",
        slow_s,
        (0.0, 1e5),
        "time constant of the slow thermal pole"
    ),
    entry!(
        DriveLimit,
        "V_max",
        "V",
        drive_limit_v,
        (1e-3, 1e3),
        "highest drive"
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_symbols_and_the_paper_is_in_range() {
        for (index, entry) in TABLE.iter().enumerate() {
            assert_eq!(entry.symbol as usize, index);
            assert_eq!(Symbol::from_name(entry.name), Some(entry.symbol));
            let value = Parameters::PAPER.get(entry.symbol);
            assert!(
                entry.range.0 <= value && value <= entry.range.1,
                "{}",
                entry.name
            );
        }
    }

    #[test]
    fn a_parameter_that_is_set_is_the_one_that_is_read() {
        let mut parameters = Parameters::PAPER;
        for (index, entry) in TABLE.iter().enumerate() {
            parameters.set(entry.symbol, index as f64);
        }
        for (index, entry) in TABLE.iter().enumerate() {
            assert_eq!(parameters.get(entry.symbol), index as f64);
        }
    }
}
