//! The mirror that all these tests are about.

use control_core::calibration::{
    Bounds, Heat, Label, Memory, Origin, Parts, Path, Plate, Residual, Resonance, SensedRises,
};
use control_core::{
    ActuatorCalibration, CHANNELS, InverseTable, Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin,
    Second, Volt, Watt,
};

/// Its calibration, at rest at once and without a memory, with this cold resistance (ohm) and its temperature coefficient (1/K),
/// highest drive (V) and rise (K).
pub(crate) fn parts(cold_ohm: f32, tcr: f32, drive_v: f32, rise_k: f32) -> Parts {
    let actuator = ActuatorCalibration {
        cold_resistance: Ohm(cold_ohm),
        tcr: PerKelvin(tcr),
        thermal_resistance: KelvinPerWatt(5700.0),
        loss_growth: PerKelvin(0.0),
        slower_by: Second(0.0),
        shape: InverseTable::new(Micrometre(170.0), std::array::from_fn(|i| i as f32))
            .expect("rising"),
        sensed_rises: SensedRises::UNKNOWN,
    };
    Parts {
        origin: Origin {
            device: Label::EMPTY,
            date: Label::EMPTY,
            model_hash: 0,
        },
        actuators: [actuator; CHANNELS],
        plate: Plate::UNKNOWN,
        heat: Heat::INSTANT,
        memory: Memory::NONE,
        path: Path {
            move_time: Second(0.0),
            resonance: Resonance::UNKNOWN,
        },
        bounds: Bounds {
            drive: Volt(drive_v),
            power: Watt(34e-3),
            rise: Kelvin(rise_k),
        },
        ambient_ratio: 0.0,
        sensed_crosstalk: 0.0,
        residual: Residual::UNKNOWN,
    }
}
