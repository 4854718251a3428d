//! The way to a new pose: smooth enough that the mirror does not ring, and no longer than that takes.
//!
//! A move is the minimum-jerk trajectory that begins as the mirror moves now and ends at rest (Flash and
//! Hogan 1985), a polynomial of fifth order. What is left of it at a resonance falls with the third
//! power of the resonance's periods in it: a test holds it below 1 % from four on, 0.5 % from five on.
//!
//! Where the resonance is known, the actuators are asked for what takes the plate along the way: with a natural frequency w and a
//! quality factor Q, z + z' / (w Q) + z'' / w^2 (feedforward by inversion; Piazzi and Visioli, IEEE/ASME Trans. Mechatronics 5 (2000) 12).
//! What is left then falls with the error of the frequency, and a move may take fewer periods.
//!
//! All four actuators begin and arrive together. The plate is rigid, so each of its coordinates takes such a
//! trajectory too, and a way between two poses within reach stays within reach.

use core::f32::consts::PI;

use crate::CHANNELS;
use crate::calibration::{Path, Resonance};
use crate::design::TICK;

/// Where the actuators are asked to be (um), tick by tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct PathPlanner {
    /// Part of a move that a tick takes.
    pace: f32,
    target: [f32; CHANNELS],
    /// Part of the move that is done; 1 at the target.
    done: f32,
    courses: [Course; CHANNELS],
    /// What they are asked for, so that the plate is where it is to be.
    now: [f32; CHANNELS],
    /// What a move asks for, as its beginning is worth.
    asked: Asked,
}

/// What speed and acceleration of the way, per move and per move squared, add to what is asked for.
#[derive(Clone, Copy, Debug, Default)]
struct Lead {
    speed: f32,
    acceleration: f32,
}

impl Lead {
    /// For moves of so many ticks.
    fn new(resonance: &Resonance, ticks: f32) -> Self {
        if !resonance.is_known() {
            return Self::default();
        }
        let per_radian = 1.0 / (2.0 * PI * resonance.frequency.0 * ticks * TICK.0);
        Self {
            speed: per_radian / resonance.quality,
            acceleration: per_radian * per_radian,
        }
    }
}

/// How one actuator's move began, counted from its target, in micrometres and moves.
#[derive(Clone, Copy, Debug, Default)]
struct Course {
    away: f32,
    speed: f32,
    acceleration: f32,
}

/// What each of these three is worth at one moment of every move: Hermite's polynomials of fifth order that end at rest, or a
/// derivative of them.
struct Hermite {
    away: f32,
    speed: f32,
    acceleration: f32,
}

/// A polynomial of fifth order without a constant: what is left of a move is its variable, and nothing is left at its end.
#[derive(Clone, Copy, Debug, Default)]
struct Quintic([f32; 5]);

impl Quintic {
    /// `place` and its derivatives by the part of the move that is done, which `lead` adds. `place` begins with the cube.
    fn led([cube, fourth, fifth]: [f32; 3], lead: &Lead) -> Self {
        let place = [0.0, 0.0, 0.0, cube, fourth, fifth, 0.0, 0.0];
        Self(core::array::from_fn(|k| {
            let power = k + 1;
            // What is left falls as what is done grows.
            let speed = -((power + 1) as f32) * place[power + 1];
            let acceleration = ((power + 2) * (power + 1)) as f32 * place[power + 2];
            place[power] + lead.speed * speed + lead.acceleration * acceleration
        }))
    }

    #[inline(always)]
    fn at(&self, rest: f32) -> f32 {
        let [first, second, third, fourth, fifth] = self.0;
        rest * (first + rest * (second + rest * (third + rest * (fourth + rest * fifth))))
    }
}

/// [`Hermite`] of what is asked for, which leads the place.
#[derive(Clone, Copy, Debug, Default)]
struct Asked {
    away: Quintic,
    speed: Quintic,
    acceleration: Quintic,
}

impl Asked {
    /// The polynomials of [`Hermite::place`], in powers of what is left.
    fn new(lead: &Lead) -> Self {
        Self {
            away: Quintic::led([10.0, -15.0, 6.0], lead),
            speed: Quintic::led([4.0, -7.0, 3.0], lead),
            acceleration: Quintic::led([0.5, -1.0, 0.5], lead),
        }
    }

    #[inline(always)]
    fn at(&self, done: f32) -> Hermite {
        let rest = if done < 1.0 { 1.0 - done } else { 0.0 };
        Hermite {
            away: self.away.at(rest),
            speed: self.speed.at(rest),
            acceleration: self.acceleration.at(rest),
        }
    }
}

impl Hermite {
    /// Where the move is when this part of it is done, and exactly 0 at its end.
    fn place(done: f32) -> Self {
        let rest = if done < 1.0 { 1.0 - done } else { 0.0 };
        let cube = rest * rest * rest;
        let speed = cube * done;
        Self {
            away: cube + speed * (3.0 + 6.0 * done),
            speed: speed + speed * (3.0 * done),
            acceleration: speed * (0.5 * done),
        }
    }

    /// How fast it is.
    fn speed(done: f32) -> Self {
        let square = (1.0 - done) * (1.0 - done);
        Self {
            away: -30.0 * done * done * square,
            speed: (1.0 + done * (2.0 - 15.0 * done)) * square,
            acceleration: done * (1.0 - 2.5 * done) * square,
        }
    }

    /// How fast that changes.
    fn acceleration(done: f32) -> Self {
        let rest = 1.0 - done;
        Self {
            away: -60.0 * done * rest * (1.0 - 2.0 * done),
            speed: -12.0 * done * rest * (3.0 - 5.0 * done),
            acceleration: rest * (1.0 - done * (8.0 - 10.0 * done)),
        }
    }

    #[inline(always)]
    fn from(&self, start: f32, course: &Course) -> f32 {
        let from = start + self.away * course.away;
        from + self.speed * course.speed + self.acceleration * course.acceleration
    }
}

impl PathPlanner {
    pub(crate) fn new(calibration: &Path) -> Self {
        let ticks = (calibration.move_time.0 / TICK.0).max(1.0);
        Self {
            pace: 1.0 / ticks,
            done: 1.0,
            asked: Asked::new(&Lead::new(&calibration.resonance, ticks)),
            ..Self::default()
        }
    }

    /// Where the actuators are asked to be now, so that the plate is at [`Self::place`].
    pub(crate) fn now(&self) -> &[f32; CHANNELS] {
        &self.now
    }

    /// Where the actuators are with a plate that is on its way.
    pub(crate) fn place(&self) -> [f32; CHANNELS] {
        if self.done >= 1.0 {
            return self.now;
        }
        let place = Hermite::place(self.done);
        core::array::from_fn(|i| place.from(self.target[i], &self.courses[i]))
    }

    /// Where the way leads.
    pub(crate) fn target(&self) -> &[f32; CHANNELS] {
        match self.done < 1.0 {
            true => &self.target,
            false => &self.now,
        }
    }

    /// Ticks until it is there.
    pub(crate) fn ticks_left(&self) -> f32 {
        if self.done < 1.0 {
            (1.0 - self.done) / self.pace
        } else {
            0.0
        }
    }

    /// The next positions of the way.
    pub(crate) fn advance(&mut self) {
        if self.done < 1.0 {
            self.done += self.pace;
            let place = self.asked.at(self.done);
            let actuators = self.now.iter_mut().zip(&self.target).zip(&self.courses);
            for ((now, target), course) in actuators {
                *now = place.from(*target, course);
            }
        }
    }

    /// Follows positions that are a way already, or the mirror where it is driven otherwise: these are to be what is returned.
    pub(crate) fn follow(&mut self) -> &mut [f32; CHANNELS] {
        self.done = 1.0;
        &mut self.now
    }

    /// The same of a way that is followed already.
    #[inline(always)]
    pub(crate) fn go_on(&mut self) -> &mut [f32; CHANNELS] {
        &mut self.now
    }

    /// A move of full length to `target`, from the present positions, speeds and accelerations.
    pub(crate) fn plan(&mut self, target: &[f32; CHANNELS]) {
        let place = self.place();
        // A move that is done is at rest.
        let done = if self.done < 1.0 { self.done } else { 1.0 };
        let (speed, acceleration) = (Hermite::speed(done), Hermite::acceleration(done));
        for ((course, place), target) in self.courses.iter_mut().zip(&place).zip(target) {
            *course = Course {
                away: place - target,
                speed: speed.from(0.0, course),
                acceleration: acceleration.from(0.0, course),
            };
        }
        self.target = *target;
        self.done = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{Hertz, Second};
    use proptest::prelude::*;
    use std::vec::Vec;

    const TICKS: usize = 60;

    fn toward(path: &mut PathPlanner, target: &[f32; CHANNELS]) -> [f32; CHANNELS] {
        if *target != path.target {
            path.plan(target);
        }
        path.advance();
        path.now
    }

    /// The next position of one actuator.
    fn one(path: &mut PathPlanner, target: f32) -> f32 {
        toward(path, &[target, 0.0, 0.0, 0.0])[0]
    }

    fn path() -> PathPlanner {
        PathPlanner::new(&Path {
            move_time: Second(6e-3),
            resonance: Resonance::UNKNOWN,
        })
    }

    #[test]
    fn arrives_in_the_time_of_a_move_and_stays() {
        let mut path = path();
        let way: Vec<f32> = (0..2 * TICKS).map(|_| one(&mut path, 100.0)).collect();
        // A thousandth of the move: rounding of a polynomial of fifth order in f32, times ten.
        assert!(
            (way[TICKS / 2 - 1] - 50.0).abs() < 0.1,
            "half way in half the time"
        );
        assert!(way[TICKS - 3] < 100.0);
        assert!(way[TICKS..].iter().all(|z| *z == 100.0));
        assert!(way.windows(2).all(|pair| pair[0] <= pair[1] + 1e-4));
    }

    #[test]
    fn without_time_it_is_there_at_once() {
        let mut path = PathPlanner::new(&Path {
            move_time: Second(0.0),
            resonance: Resonance::UNKNOWN,
        });
        assert_eq!(one(&mut path, 42.0), 42.0);
    }

    /// A planner whose moves take so many periods of a resonance that is known.
    fn led(periods: f32, quality: f32) -> PathPlanner {
        PathPlanner::new(&Path {
            move_time: Second(6e-3),
            resonance: Resonance {
                frequency: Hertz(periods / 6e-3),
                quality,
            },
        })
    }

    /// Amplitude of the ringing that a move leaves at a resonance of so many periods a move, in parts
    /// of the move.
    fn ringing(mut path: PathPlanner, periods: f64) -> f64 {
        let omega = std::f64::consts::TAU * periods / TICKS as f64;
        let (mut sine, mut cosine, mut last) = (0.0, 0.0, 0.0);
        for tick in 0..TICKS {
            let z = f64::from(one(&mut path, 1.0));
            sine += (z - last) * (omega * tick as f64).sin();
            cosine += (z - last) * (omega * tick as f64).cos();
            last = z;
        }
        sine.hypot(cosine)
    }

    #[test]
    fn leaves_less_than_a_hundredth_from_four_periods_on_and_half_of_it_from_five() {
        for tenth in 40..100 {
            let (left, most) = (
                ringing(path(), f64::from(tenth) / 10.0),
                if tenth < 50 { 0.01 } else { 0.005 },
            );
            assert!(left < most, "{left} at {} periods", f64::from(tenth) / 10.0);
        }
    }

    /// Where a move is not led it rings by 0.06 of it after two and a half periods.
    #[test]
    fn a_led_move_leaves_little_even_where_the_frequency_is_off() {
        for tenth in 25..60 {
            let periods = f64::from(tenth) / 10.0;
            for off in [0.97, 1.0, 1.03] {
                let left = ringing(led(periods as f32, 1e4), off * periods);
                // By 60 ticks of a move: steps are no curve.
                let most = if off == 1.0 { 0.002 } else { 0.006 };
                assert!(
                    left < most,
                    "{left} at {periods} periods of {off} times the frequency"
                );
            }
        }
    }

    #[test]
    fn a_led_move_ends_at_its_target_and_says_where_the_plate_is() {
        let (mut led, mut plain) = (led(2.5, 30.0), path());
        let mut ahead: f32 = 0.0;
        for _ in 0..TICKS + 2 {
            let asked = one(&mut led, 100.0);
            let place = one(&mut plain, 100.0);
            assert!((led.place()[0] - place).abs() < 1e-3);
            ahead = ahead.max(asked - place);
        }
        assert_eq!(led.now()[0], 100.0);
        // The largest acceleration of a move is 5.8 of it a move squared.
        let expected = 5.8 * 100.0 / (std::f32::consts::TAU * 2.5).powi(2);
        assert!(
            (ahead / expected - 1.0).abs() < 0.2,
            "{ahead} of {expected}"
        );
    }

    #[test]
    fn all_coordinates_of_a_plate_take_the_same_share_of_their_way() {
        let mut path = path();
        let (from, to) = ([10.0, 60.0, 90.0, 40.0], [80.0, 120.0, 20.0, 40.0]);
        *path.follow() = from;
        for _ in 0..TICKS {
            let now = toward(&mut path, &to);
            let share = (now[0] - from[0]) / (to[0] - from[0]);
            for i in 1..3 {
                let other = (now[i] - from[i]) / (to[i] - from[i]);
                // Less than a nanometre of a way of 60 um.
                assert!((share - other).abs() < 1e-5, "{share} and {other}");
            }
            assert_eq!(now[3], 40.0);
        }
    }

    proptest! {
        /// A new target on the way bends the path without a jump in speed.
        #[test]
        fn a_new_target_on_the_way_makes_no_jump(
            first in 0.0_f32..170.0,
            second in 0.0_f32..170.0,
            after in 1..TICKS,
        ) {
            let mut path = path();
            let mut way: Vec<f32> = (0..after).map(|_| one(&mut path, first)).collect();
            way.extend((0..TICKS + 1).map(|_| one(&mut path, second)));
            prop_assert_eq!(way[way.len() - 1], second);
            // The highest acceleration of a move is 5.8 of its length a move squared.
            let most = 3.0 * 5.8 * 340.0 / (TICKS * TICKS) as f32;
            for three in way.windows(3) {
                let bend = three[2] - 2.0 * three[1] + three[0];
                prop_assert!(bend.abs() < most, "{bend} of {most}");
            }
        }

        #[test]
        fn any_target_can_be_left_again(bits: u32) {
            let mut path = path();
            one(&mut path, f32::from_bits(bits).clamp(0.0, 200.0));
            for _ in 0..=TICKS {
                one(&mut path, 10.0);
            }
            prop_assert!(one(&mut path, 10.0) == 10.0 || f32::from_bits(bits).is_nan());
        }
    }
}
