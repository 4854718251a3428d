//! The Kalman filter of room and loss: two random walks, and a jump of both [Simon 2006, section 5.1].

use crate::units::Kelvin;

/// How fast a room drifts by itself, as a random walk (K in a root second): a kelvin in ten minutes, 0.04 times the root of 600 s. A choice.
const ROOM_WALK: f32 = 0.04;
/// The same of the relative loss: a tenth of the room's, at a heater that is 60 K warm; only air that begins to flow is faster,
/// and that is a jump.
const LOSS_WALK: f32 = 7e-5;
/// What is known of a room before anything was sensed, or after a jump (K): 10 to 40 degC around a laboratory's 22.
const ROOM_PRIOR: Kelvin = Kelvin(15.0);
/// The same of the loss: 10 %, half of the fifth by which air is required to be borne (docs/requirements.md).
const LOSS_PRIOR: f32 = 0.1;
/// An update that is off by more standard deviations than this is none, or a jump: noise is once in 1.7 million updates, three quarters
/// of an hour, and four in succession never.
const JUMP: f32 = 5.0;
/// So is one that is off by more than this, however little was known before (K): no room is that far off at a glance, and a single
/// reading that is wrong must not take the range away.
const FAR: Kelvin = Kelvin(10.0);
/// So many of them in succession are a jump: of 6.4 ms, a choice. A glitch is shorter, and the estimate is to be at its new place within
/// 20 ms (docs/theory/surroundings.md).
const UPDATES_TO_JUMP: u8 = 4;
/// Positions whose rises differ by less are one place, with one error of the curves (K): half of what a knot of the resistances' curves is
/// from the next one, for 17 of them up to a hundred kelvins. A choice.
const ONE_PLACE: f32 = 3.0;
/// What is asked at a place that the mirror passes: nothing that ever is, so that it arrives even where it was before.
const ON_ITS_WAY: f32 = f32::INFINITY;
/// An actuator has arrived where its fast poles have no more than this still to bring (K): half of what is one place.
pub(super) const ARRIVED: f32 = 0.5 * ONE_PLACE;
/// Surroundings beyond this bear no bimorph, or are no surroundings but a sense that is wrong (K): from -40 to 85 degC, the
/// industrial range, around a laboratory's 22.
pub(super) const FARTHEST: Kelvin = Kelvin(63.0);
/// A loss beyond this is no air, but a vacuum or a heater that is damaged: two and a half times the fifth that air is required to be borne
/// by (docs/requirements.md).
pub(super) const LARGEST_LOSS: f32 = 0.5;

/// The states and their covariance.
#[derive(Clone, Debug)]
pub(super) struct Filter {
    /// Rise of the surroundings (K).
    pub(super) room: f32,
    /// Relative change of the loss.
    pub(super) loss: f32,
    /// Covariance of the two: variances and their covariance.
    pub(super) room_room: f32,
    room_loss: f32,
    pub(super) loss_loss: f32,
    /// The rise that was asked for where the mirror arrived last (K), in the mean of all four; the heating at the place where it is, and by what a
    /// kelvin of the room counted there when it came.
    asked: f32,
    pub(super) place: f32,
    slope: f32,
    /// What an error of a kelvin that all readings of this place have has made of room (K) and loss.
    place_error: (f32, f32),
    /// Updates in succession that were far off.
    jumps: u8,
}

/// Covariances of the states with what is measured, and its variance.
pub(super) struct CrossCovariance {
    room: f32,
    loss: f32,
    variance: f32,
}

/// How far a reading is off, and where it was read, in kelvins of the room.
struct AsRoom {
    off: f32,
    heating: f32,
    /// By which its variances are to be divided.
    square: f32,
}

impl Filter {
    /// One that knows of nothing but any room.
    pub(super) fn new() -> Self {
        Self {
            room: 0.0,
            loss: 0.0,
            room_room: ROOM_PRIOR.0 * ROOM_PRIOR.0,
            room_loss: 0.0,
            loss_loss: LOSS_PRIOR * LOSS_PRIOR,
            asked: 0.0,
            place: 0.0,
            slope: 1.0,
            place_error: (0.0, 0.0),
            jumps: 0,
        }
    }

    /// What so many seconds add to the covariance.
    pub(super) fn walk(&mut self, seconds: f32) {
        const MOST: (f32, f32) = (ROOM_PRIOR.0 * ROOM_PRIOR.0, LOSS_PRIOR * LOSS_PRIOR);
        let room = self.room_room + ROOM_WALK * ROOM_WALK * seconds;
        let loss = self.loss_loss + LOSS_WALK * LOSS_WALK * seconds;
        self.room_room = if room < MOST.0 { room } else { MOST.0 };
        self.loss_loss = if loss < MOST.1 { loss } else { MOST.1 };
    }

    /// What the states make a measurement, room (1 + growth room) - loss x heating (K).
    pub(super) fn expected(&self, heating: f32, growth: f32) -> f32 {
        self.room * (1.0 + growth * self.room) - self.loss * heating
    }

    /// The mirror is on its way to where `asked` has it, or has arrived there. What the heating changes by while the same is asked
    /// compensates another room: that is no other place, or a room that goes on changing would be told for a loss that makes the
    /// difference between the two.
    ///
    /// Errors of a place's curves have this variance (K^2).
    pub(super) fn go(
        &mut self,
        (asked, has_arrived): (f32, bool),
        (heating, growth): (f32, f32),
        of_place: f32,
    ) {
        let is_elsewhere = (asked - self.asked).abs() > ONE_PLACE;
        if is_elsewhere && (has_arrived || (heating - self.place).abs() > ONE_PLACE) {
            self.asked = if has_arrived { asked } else { ON_ITS_WAY };
            self.leave(of_place);
            self.place = heating;
            self.slope = 1.0 + 2.0 * growth * self.room;
        }
    }

    /// Takes a measurement with its variance, and what errors that stay from update to update add to that: they make it no further off, and
    /// tell less. Returns whether the states have jumped.
    ///
    /// All readings of one place have one error of the curves, whatever the heating is off by there, so that they tell nothing of how
    /// room and loss divide what they have in common: gains are those of the place, as it was when the mirror came there
    /// (first-estimates Jacobian; Huang, Mourikis and Roumeliotis, IEEE ICRA 2008, 473). What that error has made of the states is in
    /// their covariance from when the mirror leaves on, for the next place has another.
    pub(super) fn measure(
        &mut self,
        measured: f32,
        (heating, growth): (f32, f32),
        (variance, lasting): (f32, f32),
    ) -> bool {
        let off = measured - self.expected(heating, growth);
        let mut reading = self.as_room(off);
        let mut gains = self.gains(reading.heating, variance / reading.square);
        let is_off =
            reading.off * reading.off > JUMP * JUMP * gains.variance || reading.off.abs() > FAR.0;
        if is_off {
            self.jumps += 1;
            if self.jumps < UPDATES_TO_JUMP {
                return false;
            }
            self.forget();
            self.place_error = (0.0, 0.0);
            // Most of what is off is the room: there a kelvin of it counts so much from this reading on, or the next one would tell
            // room and loss apart by the difference.
            self.slope = 1.0 + 2.0 * growth * (self.room + reading.off);
            reading = self.as_room(off);
            gains = self.gains(reading.heating, variance / reading.square);
        }
        self.jumps = 0;
        gains.variance += lasting / reading.square;
        let (room, loss) = (gains.room / gains.variance, gains.loss / gains.variance);
        self.room = within(self.room + room * reading.off, FARTHEST.0);
        self.loss = within(self.loss + loss * reading.off, LARGEST_LOSS);
        let unexplained = 1.0 - (self.place_error.0 - reading.heating * self.place_error.1);
        self.place_error.0 += room * unexplained;
        self.place_error.1 += loss * unexplained;
        self.room_room -= room * gains.room;
        self.room_loss -= room * gains.loss;
        self.loss_loss -= loss * gains.loss;
        self.keep_positive();
        is_off
    }

    /// A reading that is so far off, as if it were the room itself that was measured.
    fn as_room(&self, off: f32) -> AsRoom {
        AsRoom {
            off: off / self.slope,
            heating: self.place / self.slope,
            square: self.slope * self.slope,
        }
    }

    /// Variance of what the states make a measurement at this heating (K^2).
    pub(super) fn variance(&self, heating: f32) -> f32 {
        self.gains(heating, 0.0).variance
    }

    fn gains(&self, heating: f32, variance: f32) -> CrossCovariance {
        let room = self.room_room - heating * self.room_loss;
        let loss = self.room_loss - heating * self.loss_loss;
        CrossCovariance {
            room,
            loss,
            variance: room - heating * loss + variance,
        }
    }

    /// The mirror goes elsewhere.
    fn leave(&mut self, of_place: f32) {
        let (room, loss) = core::mem::take(&mut self.place_error);
        self.room_room += of_place * room * room;
        self.room_loss += of_place * room * loss;
        self.loss_loss += of_place * loss * loss;
    }

    /// The covariance of one who knows the states as they were, and that they have jumped.
    fn forget(&mut self) {
        self.room_room = ROOM_PRIOR.0 * ROOM_PRIOR.0;
        self.loss_loss = LOSS_PRIOR * LOSS_PRIOR;
        self.room_loss = 0.0;
    }

    /// What rounding may have taken of the covariance: it stays that of two quantities, with deviations of at least 1 mK and 0.003 %, a
    /// tenth and less of what a reading resolves.
    fn keep_positive(&mut self) {
        const LEAST: (f32, f32) = (1e-6, 1e-9);
        self.room_room = if self.room_room > LEAST.0 {
            self.room_room
        } else {
            LEAST.0
        };
        self.loss_loss = if self.loss_loss > LEAST.1 {
            self.loss_loss
        } else {
            LEAST.1
        };
        // What the two have in common is told to a hundred-thousandth of the room at most. Were the covariance cut instead, each update would tell a
        // little of how they divide, and thousands of them nearly all.
        let least = self.room_loss * self.room_loss / (0.99998 * self.loss_loss);
        if least.is_finite() {
            self.room_room = if self.room_room > least {
                self.room_room
            } else {
                least
            };
        } else {
            self.room_loss = 0.0;
        }
    }
}

/// `value`, but not beyond `most` either way; NaN becomes 0.
fn within(value: f32, most: f32) -> f32 {
    if value > most {
        most
    } else if value < -most {
        -most
    } else if value.is_nan() {
        0.0
    } else {
        value
    }
}
