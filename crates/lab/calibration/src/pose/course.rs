//! The course: poses on the way, which tell how fast each actuator follows.

use experiments::{Run, Signal, Tilt, Turns, Wave};

use crate::plate_pose::PlatePose;
use crate::reach::Reach;

/// How long [`along_a_course`] takes (s): sixteen of its periods.
pub const COURSE_S: f64 = 0.8;
/// From one reading along it to the next (s): 25 in a period.
pub const COURSE_STEP_S: f64 = 2e-3;

const HZ: f64 = 20.0;
/// Of its range: 10 um, as bench `position` finds that usual mirrors can.
const MIDDLE: f64 = 0.45;
const PART: f64 = 0.06;

/// The two parts of a course, as a board plays them: a sine of the piston, and a circle of the tilts. Both begin and end at the same pose,
/// and take half of [`COURSE_S`]; they are small enough that a heater can cool as fast.
pub fn course(reach: &Reach, top_um: f64) -> [Run; 2] {
    let z_um = MIDDLE * top_um;
    let rad = PART / MIDDLE * reach.largest_tilt_rad(z_um, (1.0, 0.0));
    let part = |amplitude_um: f64, tilts: [Turns; 2]| {
        let signal = Signal::Sine(Wave {
            mean: z_um,
            amplitude: amplitude_um,
            frequency_hz: HZ,
        });
        Run {
            tilts: Some(tilts.map(Tilt::Sine)),
            ..Run::along(signal, (0.5 * COURSE_S * HZ).round() as u32)
        }
    };
    let turns = |mean: f64, start: f64| Turns {
        mean,
        amplitude: rad,
        per_cycle: 1,
        start,
    };
    // From its lowest on, the second tilt begins at none as the first one does.
    let circle = [turns(0.0, 0.0), turns(rad, 0.75)];
    [
        part(PART * top_um, [Turns::default(); 2]),
        part(0.0, circle),
    ]
}

/// The pose of a course, one part right after the other, after so many seconds.
pub fn along_a_course(reach: &Reach, top_um: f64, t_s: f64) -> PlatePose {
    let [piston, tilts] = course(reach, top_um);
    match t_s < piston.duration_s() {
        true => PlatePose::along(&piston, t_s),
        false => PlatePose::along(&tilts, t_s - piston.duration_s()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Micrometre;
    use control_core::calibration::Plate;

    #[test]
    fn both_parts_go_from_the_middle_and_come_back_to_it() {
        let reach = Reach::new(Plate::cross(Micrometre(230.0)), 160.0);
        let middle = PlatePose {
            z_um: 72.0,
            ..PlatePose::default()
        };
        for run in course(&reach, 160.0) {
            assert!((run.duration_s() - 0.5 * COURSE_S).abs() < 1e-12);
            for t_s in [0.0, run.duration_s()] {
                let pose = PlatePose::along(&run, t_s);
                assert!((pose.z_um - middle.z_um).abs() < 1e-9, "{pose:?}");
                assert!(pose.tilt_x_rad.abs() < 1e-9 && pose.tilt_y_rad.abs() < 1e-9);
            }
        }
        let at = |t_s: f64| along_a_course(&reach, 160.0, t_s);
        // A quarter of a period, and half a period of the circle.
        assert!((at(0.0125).z_um - 72.0 - 9.6).abs() < 1e-9);
        let half = at(0.4 + 0.025);
        assert!(
            half.tilt_x_rad.abs() < 1e-9 && half.tilt_y_rad > 0.01,
            "{half:?}"
        );
        assert!((half.z_um - 72.0).abs() < 1e-9);
    }
}
