//! The control step.

use crate::LANES;
use crate::calibration::{Calibration, LaneCalibration};
use crate::limits::{Limit, Limits};
use crate::sense::LaneSense;
use crate::units::{Ampere, Micrometre, Volt};
use fpu::sqrt;

/// What the controller is asked to do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Setpoint {
    /// Zero drive on all lanes.
    #[default]
    Off,
    /// Piston motion: all four actuators to this position.
    Position(Micrometre),
    /// These voltages, lane by lane.
    Drive([Volt; LANES]),
}

/// The outcome of one control step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step {
    /// Voltages to drive from now on.
    pub drives: [Volt; LANES],
    /// What the currents told of each lane, where they told anything.
    pub sense: [Option<LaneSense>; LANES],
    /// What kept the drives from being what was asked.
    pub limits: Limits,
}

/// The four lanes under one calibration.
#[derive(Debug)]
pub struct Controller<'a> {
    calibration: &'a mut Calibration,
}

impl<'a> Controller<'a> {
    /// A controller that inverts `calibration`. It is lent, because it is large and exchanged in place.
    pub fn new(calibration: &'a mut Calibration) -> Self {
        Self { calibration }
    }

    /// The calibration in use.
    pub fn calibration(&self) -> &Calibration {
        self.calibration
    }

    /// Inverts `calibration` from now on, and returns the one before. The history under that one means
    /// nothing now: the mirror is taken to be at rest.
    pub fn exchange(&mut self, calibration: &'a mut Calibration) -> &'a mut Calibration {
        let before = core::mem::replace(self, Self::new(calibration));
        before.calibration
    }

    /// One control tick.
    ///
    /// `applied` are the voltages that were driven while `currents` were sensed. Every input is
    /// answered: what is not finite or out of range is limited, and named in [`Step::limits`].
    pub fn step(
        &mut self,
        setpoint: Setpoint,
        applied: [Volt; LANES],
        currents: [Ampere; LANES],
    ) -> Step {
        let mut limits = Limits::NONE;
        let wanted = match setpoint {
            Setpoint::Off => [Volt(0.0); LANES],
            Setpoint::Position(z) => self.drives_at(z, &mut limits),
            Setpoint::Drive(drives) => drives,
        };
        let lanes = self.calibration.lanes();
        Step {
            drives: wanted.map(|drive| self.limit_drive(drive, &mut limits)),
            sense: core::array::from_fn(|i| LaneSense::read(&lanes[i], applied[i], currents[i])),
            limits,
        }
    }

    fn drives_at(&self, z: Micrometre, limits: &mut Limits) -> [Volt; LANES] {
        let top = self.calibration.max_position().0;
        let z = limits.clamp(z.0, (0.0, Limit::PositionLow), (top, Limit::PositionHigh));
        self.calibration
            .lanes()
            .each_ref()
            .map(|lane| drive_at(lane, Micrometre(z)))
    }

    fn limit_drive(&self, drive: Volt, limits: &mut Limits) -> Volt {
        let max = self.calibration.max_drive().0;
        Volt(limits.clamp(drive.0, (0.0, Limit::DriveLow), (max, Limit::DriveHigh)))
    }
}

/// The drive that holds position `z` in the steady state: shape, heat and resistance inverted in
/// turn (eqs. 3 to 9 backwards).
fn drive_at(lane: &LaneCalibration, z: Micrometre) -> Volt {
    let rise = lane.shape.temperature_rise(z);
    let power = lane.power(rise);
    let resistance = lane.resistance(rise);
    Volt(sqrt(power.0 * resistance.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::tests::parts;
    use crate::calibration::{Heat, Memory, Parts};
    use crate::table::{InverseTable, KNOTS};
    use crate::units::{KelvinPerWatt, Ohm, PerKelvin};
    use proptest::prelude::*;
    use std::boxed::Box;

    /// 100 um at 100 K, 400 ohm cold, 800 ohm at the top.
    fn controller() -> Controller<'static> {
        let lane = LaneCalibration {
            cold_resistance: Ohm(400.0),
            tcr: PerKelvin(0.01),
            thermal_resistance: KelvinPerWatt(5000.0),
            loss_growth: PerKelvin(0.0),
            shape: InverseTable::new(
                Micrometre(100.0),
                core::array::from_fn(|i| 100.0 * i as f32 / (KNOTS - 1) as f32),
            )
            .expect("rising"),
        };
        let parts = Parts {
            lanes: [lane; LANES],
            heat: Heat::INSTANT,
            memory: Memory::NONE,
            ..parts()
        };
        let calibration = Calibration::new(parts).expect("plausible");
        Controller::new(Box::leak(Box::new(calibration)))
    }

    fn step(setpoint: Setpoint) -> Step {
        controller().step(setpoint, [Volt(0.0); LANES], [Ampere(0.0); LANES])
    }

    #[test]
    fn a_position_is_driven_with_the_power_that_holds_it() {
        let drive = step(Setpoint::Position(Micrometre(50.0))).drives[0].0;
        // 50 K need 10 mW in 600 ohm.
        assert!((drive - (10e-3_f32 * 600.0).sqrt()).abs() < 1e-5, "{drive}");
    }

    #[test]
    fn a_position_out_of_range_is_limited_by_name() {
        let limited = |z| step(Setpoint::Position(Micrometre(z))).limits;
        assert_eq!(limited(50.0), Limits::NONE);
        assert!(limited(100.1).contains(Limit::PositionHigh));
        assert!(limited(-0.1).contains(Limit::PositionLow));
        assert!(limited(f32::NAN).contains(Limit::NotANumber));
    }

    #[test]
    fn a_drive_above_the_highest_is_limited_by_name() {
        let mut drives = [Volt(1.0); LANES];
        drives[2] = Volt(3.6);
        let step = step(Setpoint::Drive(drives));
        assert_eq!(step.drives[2], Volt(3.5));
        assert_eq!(step.drives[1], Volt(1.0));
        assert!(step.limits.contains(Limit::DriveHigh));
    }

    #[test]
    fn the_current_is_read_as_a_thermometer() {
        let currents = [
            Ampere(2.0 / 600.0),
            Ampere(2.0 / 400.0),
            Ampere(0.0),
            Ampere(-1e-6),
        ];
        let step = controller().step(Setpoint::Off, [Volt(2.0); LANES], currents);
        let rises = step
            .sense
            .map(|lane| lane.map(|lane| lane.temperature_rise.0.round()));
        assert_eq!(rises, [Some(50.0), Some(0.0), None, None]);
    }

    fn any_float() -> impl Strategy<Value = f32> {
        any::<u32>().prop_map(f32::from_bits)
    }

    fn any_setpoint() -> impl Strategy<Value = Setpoint> {
        prop_oneof![
            Just(Setpoint::Off),
            any_float().prop_map(|z| Setpoint::Position(Micrometre(z))),
            proptest::array::uniform4(any_float()).prop_map(|v| Setpoint::Drive(v.map(Volt))),
        ]
    }

    proptest! {
        #[test]
        fn any_bit_pattern_gives_a_drive_within_the_limits(
            setpoint in any_setpoint(),
            applied in proptest::array::uniform4(any_float()),
            currents in proptest::array::uniform4(any_float()),
        ) {
            let step =
                controller().step(setpoint, applied.map(Volt), currents.map(Ampere));
            for drive in step.drives {
                prop_assert!((0.0..=3.5).contains(&drive.0), "{drive:?}");
            }
        }

        #[test]
        fn a_higher_position_never_needs_a_lower_drive(a in 0.0_f32..100.0, b in 0.0_f32..100.0) {
            let drive = |z| step(Setpoint::Position(Micrometre(z))).drives[0];
            prop_assert!(drive(a.min(b)) <= drive(a.max(b)));
        }

        #[test]
        fn the_drive_holds_the_position_it_was_computed_for(z in 0.0_f32..100.0) {
            let controller = controller();
            let lane = &controller.calibration().lanes()[0];
            let drive = drive_at(lane, Micrometre(z)).0;
            // Forward again: dT = R_T V^2 / R(dT) solved for dT, with 1 um a kelvin.
            let (xi, a) = (lane.tcr.0, lane.thermal_resistance.0 / lane.cold_resistance.0);
            let rise = ((4.0 * xi * a * drive * drive + 1.0).sqrt() - 1.0) / (2.0 * xi);
            prop_assert!((rise - z).abs() < 1e-3, "{z} came back as {rise}");
        }
    }
}
