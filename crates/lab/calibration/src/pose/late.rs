//! Where a plate on its way was when an instrument saw it that tells late.

use nalgebra::Vector3;

use super::point::PosePoint;

/// When the points ended that were asked for, one after the other.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    ends: Vec<End>,
}

#[derive(Clone, Copy, Debug)]
struct End {
    s: f64,
    /// The plate had come to rest before it.
    is_rest: bool,
}

impl Schedule {
    pub(super) fn of(points: &[PosePoint]) -> Self {
        let mut passed_s = 0.0;
        let end = |point: &PosePoint| {
            passed_s += point.held_s;
            End {
                s: passed_s,
                is_rest: point.is_long_held(),
            }
        };
        Self {
            ends: points.iter().map(end).collect(),
        }
    }

    /// Where a plate was `late_s` before the end of a point, which was `at` a place at the end of each: on the parabola through the nearest
    /// three of them (Newton's divided differences).
    pub(super) fn before(
        &self,
        point: usize,
        late_s: f64,
        at: impl Fn(usize) -> Vector3<f64>,
    ) -> Vector3<f64> {
        let end_s = |point: usize| self.ends[point].s;
        let last = self.ends.len() - 1;
        let then_s = end_s(point) - late_s;
        let next = self.ends.partition_point(|end| end.s < then_s).min(last);
        if next == 0 || self.ends[next].is_rest {
            return at(next);
        }
        let is_nearer = then_s - end_s(next - 1) < end_s(next) - then_s;
        let nearest = if is_nearer { next - 1 } else { next };
        let (before, after) = (nearest.saturating_sub(1), (nearest + 1).min(last));
        let slope = |from: usize, to: usize| match end_s(to) - end_s(from) {
            apart_s if apart_s > 0.0 => (at(to) - at(from)) / apart_s,
            _ => Vector3::zeros(),
        };
        let (from_s, speed) = (then_s - end_s(nearest), slope(before, nearest));
        let bend = match end_s(after) - end_s(before) {
            apart_s if apart_s > 0.0 => (slope(nearest, after) - speed) / apart_s,
            _ => Vector3::zeros(),
        };
        at(nearest) + speed * from_s + bend * (from_s * (then_s - end_s(before)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plate_pose::PlatePose;

    /// Ten micrometres at 20 Hz, read every 2 ms after a rest.
    #[test]
    fn a_plate_was_where_its_sine_was_and_before_that_at_rest() {
        let held = |held_s: f64| PosePoint {
            asked: PlatePose::default(),
            held_s,
            reached: None,
            told_k: None,
        };
        let mut points = vec![held(2.0), held(2.0)];
        points.extend([held(2e-3); 200]);
        let schedule = Schedule::of(&points);
        let sine = |t_s: f64| 10.0 * (std::f64::consts::TAU * 20.0 * t_s.max(0.0)).sin();
        let way_s = |point: usize| 2e-3 * (point as f64 - 1.0);
        let at = |point: usize| match point {
            0 => Vector3::repeat(50.0),
            _ => Vector3::repeat(sine(way_s(point))),
        };
        for point in 2..200 {
            for late_s in [-1e-3, 0.0, 0.5e-3, 2e-3, 7.3e-3] {
                let off = schedule.before(point, late_s, at)
                    - Vector3::repeat(sine(way_s(point) - late_s));
                // On a straight line in the first step: (0.25 / 2)^2 / 2 of the amplitude; then the third derivative.
                let most_um = if way_s(point) - late_s < 2e-3 {
                    0.08
                } else {
                    0.02
                };
                assert!(off.amax() < most_um, "{point}, {late_s}: {off}");
            }
        }
    }

    #[test]
    fn nothing_moves_in_no_time() {
        let point = |held_s: f64| PosePoint {
            asked: PlatePose::default(),
            held_s,
            reached: None,
            told_k: None,
        };
        let schedule = Schedule::of(&[point(0.0), point(0.0), point(0.0)]);
        for at in 0..3 {
            let was = schedule.before(at, 1e-3, |_| Vector3::repeat(3.0));
            assert_eq!(was, Vector3::repeat(3.0));
        }
    }
}
