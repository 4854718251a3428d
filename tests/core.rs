//! The control core on the target against samples of the f64 model.
#![no_std]
#![no_main]

use mirror_firmware as _;

// `REFERENCE`: (z in um, the model's drive in V, the model's dz/dV in um/V).
include!("reference/samples.rs");

#[embedded_test::tests]
mod tests {
    use super::REFERENCE;
    use control_core::{
        Ampere, CHANNELS, Controller, Limit, Micrometre, PwmCode, Setpoint, Step, Volt,
    };
    use mirror_firmware::factory;

    /// The paper's sensor resolution.
    const BOUND_UM: f64 = 0.010;

    fn step(setpoint: Setpoint) -> Step {
        let mut calibration = factory::calibration();
        let mut controller = Controller::new(&mut calibration);
        *controller.step(setpoint, [Volt(0.0); CHANNELS], [Ampere(0.0); CHANNELS])
    }

    #[test]
    fn positions_are_driven_as_the_f64_model_says() {
        let mut worst_um = 0.0_f64;
        let mut calibration = factory::calibration();
        let mut controller = Controller::new(&mut calibration);
        for (z_um, model_v, um_per_v) in REFERENCE {
            let setpoint = Setpoint::track(Micrometre(z_um));
            let mut tick =
                || *controller.step(setpoint, [Volt(0.0); CHANNELS], [Ampere(0.0); CHANNELS]);
            // The first tick takes the mirror there, the second one holds it.
            tick();
            let step = tick();
            for drive in step.drives {
                worst_um = worst_um.max(((f64::from(drive.0) - model_v) * um_per_v).abs());
            }
        }
        defmt::println!("worst error on the target: {=f64} nm", worst_um * 1e3);
        assert!(worst_um <= BOUND_UM, "{worst_um} um");
    }

    #[test]
    fn positions_out_of_range_are_limited_by_name() {
        let top = factory::calibration().max_position();
        let beyond = step(Setpoint::position(Micrometre(top.0 + 1.0)));
        assert!(beyond.limits.contains(Limit::PositionHigh));
        assert_eq!(beyond.drives, step(Setpoint::position(top)).drives);
        assert!(
            step(Setpoint::position(Micrometre(-1.0)))
                .limits
                .contains(Limit::PositionLow)
        );
    }

    #[test]
    fn any_bit_pattern_gives_a_drive_within_the_limits() {
        let mut calibration = factory::calibration();
        let highest = calibration.max_drive().0;
        let mut controller = Controller::new(&mut calibration);
        let mut bits = 1_u32;
        let mut next = || {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from_bits(bits)
        };
        for _ in 0..20_000 {
            let z = Setpoint::position(Micrometre(next()));
            let drives = Setpoint::Drive([next(), next(), next(), next()].map(Volt));
            for setpoint in [z, drives] {
                let step = controller.step(
                    setpoint,
                    [Volt(next()); CHANNELS],
                    [Ampere(next()); CHANNELS],
                );
                for drive in step.drives {
                    assert!((0.0..=highest).contains(&drive.0));
                }
            }
        }
    }

    #[test]
    fn quantisation_is_at_most_half_a_millivolt() {
        for millivolt in 0..=35_000 {
            let drive = Volt(millivolt as f32 * 1e-4);
            let error = PwmCode::nearest(drive).drive().0 - drive.0;
            assert!(error.abs() <= 0.5e-3 + 1e-6, "{error} at {drive}");
        }
    }
}
