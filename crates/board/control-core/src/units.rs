//! Units as types: a number that enters the core says what it measures.

macro_rules! unit {
    ($(#[$doc:meta])* $name:ident, $symbol:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $name(pub f32);

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                core::fmt::Display::fmt(&self.0, f)?;
                f.write_str(concat!(" ", $symbol))
            }
        }
    };
}

unit!(
    /// Position of the mirror, from its rest at zero drive, positive towards the substrate.
    Micrometre,
    "um"
);
unit!(
    /// Rotation of the plate, right-handed, from its rest.
    Radian,
    "rad"
);
unit!(
    /// Voltage at an actuator.
    Volt,
    "V"
);
unit!(
    /// Current through an actuator.
    Ampere,
    "A"
);
unit!(
    /// Heater resistance.
    Ohm,
    "ohm"
);
unit!(
    /// Temperature above ambient.
    Kelvin,
    "K"
);
unit!(
    /// Heating power of one actuator.
    Watt,
    "W"
);
unit!(
    /// Thermal resistance from the heater to ambient (R_T of eq. 3).
    KelvinPerWatt,
    "K/W"
);
unit!(
    /// Temperature coefficient of resistance (xi of eq. 3).
    PerKelvin,
    "/K"
);
unit!(
    /// Time.
    Second,
    "s"
);
unit!(
    /// What a time constant grows by with the temperature.
    SecondPerKelvin,
    "s/K"
);
unit!(
    /// Frequency.
    Hertz,
    "Hz"
);
