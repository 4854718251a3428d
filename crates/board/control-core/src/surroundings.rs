//! The surroundings: how much warmer they are than at calibration, and how much more of the heat they take.
//!
//! A heater's resistance tells its own temperature; the stages tell the rise over the surroundings that its power makes. Their
//! difference is the surroundings' own rise, less what a changed loss takes of the heater's. What a power holds by itself,
//! q = dT (1 + g dT), flows off between the heater's temperature and the surroundings', F(T) - F(a), whatever law F follows;
//! at calibration the resistance told T = s(dT) of it, so F(s(dT)) = q, and
//!
//! ```text
//! (T_R - s(dT)) F'(T) s'(0) = a (1 + g a / s'(0)) - e q s'(0)     a: rise of the surroundings, e: relative change of the loss
//! ```
//!
//! where F'(T) = (1 + 2 g dT) / s'(dT), the growth of the loss halfway between the two temperatures.
//!
//! to first order (`docs/theory/surroundings.md`). The same offset at any drive is the surroundings, one in proportion to the
//! heating is the loss; a Kalman filter whose two states are random walks [Simon 2006, section 5.1] keeps what cannot be told
//! apart yet as their covariance. One room is around all four actuators and one air takes their heat, so they share both
//! states, and readings of all four go into one update.
//!
//! What it finds is compensated in the stages' target. The surroundings bend an actuator as `ambient_ratio` kelvins of its
//! heater, so that much less is asked of the power, and more by what the loss has grown.

use crate::CHANNELS;
use crate::calibration::Parts;
use crate::design::{FILM_TCR_PER_K, TICK};
use crate::uncertainty::RECTANGULAR;
use crate::units::{Ampere, Kelvin};

mod apart;
mod curves;
mod drift;
mod evidence;
pub mod excursion;
mod filter;
mod likeness;
mod period;
mod reference;
mod uneven;
mod unknown;

use apart::Apart;
use curves::CURVES_VARIANCE;
pub use curves::beyond_the_curves;
use drift::{Drift, Innovation};
pub(crate) use evidence::Evidence;
use excursion::Excursion;
use filter::{ARRIVED, FARTHEST, Filter};
use likeness::Likeness;
pub(crate) use period::PERIOD;
use reference::Reference;
use uneven::{Uneven, Unshared};

/// Noise of a current reading: 1.2 steps of a 12-bit conversion and its rounding, in the mean of 16, are 0.95 uA (`codes.rs`;
/// the emulated board's converter).
const NOISE: Ampere = Ampere(1e-6);
/// What a resistance and the stages are apart at rest in the room of the calibration, beyond that (K): what a straight line
/// with a bend leaves of heaters that are not warm evenly (`closed-loop`, test `surroundings`).
const UNMODELLED: Kelvin = Kelvin(0.03);
/// Part of what the fast poles have still to bring by which a resistance and the stages may be apart meanwhile: the heater
/// and the bend see the same poles with other weights. Half of it, so that what moves hardly counts: its error is no noise, and
/// a tenth let moves take the surroundings with them by some kelvins (the same test).
const UNSETTLED: f32 = 0.5;
/// Part of a difference that two terms of its series may leave out: 2 %, of 20 K 0.4 K.
const FIRST_ORDER: f32 = 0.02;
/// Air that takes a fifth more or less, as a draught does, is told as up to 0.25 (bench `position`). What is beyond this is no
/// air: two fifths more of the heat, or a quarter less.
const AIR: f32 = 0.3;
/// Part of what a heater tells of the others' heat by which it may be off: one number stands for all heights, and on the paper's virtual
/// mirror it is 1.7 times what `calibrate-pose` finds at a third of the range, and 0.7 times at three quarters.
const SENSED_CROSSTALK: f32 = 0.5;
/// The room's standard deviation below which it is told apart from the loss (K): 0.03 to 0.2 K after two positions.
const TOLD_APART: Kelvin = Kelvin(0.3);
/// Ticks in which a new position has told the surroundings: they are at a jump's new place in 20 ms (`closed-loop`, test
/// `surroundings`).
const LEARNT: u16 = 200;
/// Targets nearer to where the surroundings alone hold the mirror are not compensated for the loss, which takes hardly anything
/// there: the 0.15 K by which curves are off (see above) would be taken for a loss of 8 % and more.
const NEAR_REST: Kelvin = Kelvin(2.0);
/// What a target may be scaled by. A loss of half the heat, the largest that is followed (`filter.rs`), takes a rise to half or
/// to twice of what it is; a quarter beyond that is for the bend of the curves.
const SCALES: (f32, f32) = (0.4, 2.5);
/// The standard deviation of the surroundings from which on an actuator at rest is probed, and until which (K): 0.5 K are
/// some 0.9 um.
const PROBED: (f32, f32) = (0.1, 0.5);

/// What is known of the surroundings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    /// Their temperature over that at calibration.
    pub rise: Kelvin,
    /// Its standard deviation, of kelvins that are those of a film of the usual coefficient.
    pub rise_deviation: Kelvin,
    /// Relative change of the loss to them.
    pub loss: f32,
    /// Its standard deviation.
    pub loss_deviation: f32,
}

/// Part of a room by which it is unknown in kelvins, since nobody has measured the coefficient of its films: those of the paper's four
/// actuators are up to 5 % from its Table 1 (`virtual-mirror`, `paper.toml`). Positions do not depend on it.
const UNMEASURED_FILM: f32 = 0.05;

impl Estimate {
    /// Standard deviation of the rise as a thermometer would tell it.
    pub fn thermometer_deviation(&self) -> Kelvin {
        let (of_the_rise, of_the_film) = (self.rise_deviation.0, UNMEASURED_FILM * self.rise.0);
        Kelvin(fpu::sqrt(
            of_the_rise * of_the_rise + of_the_film * of_the_film,
        ))
    }
}

/// The filter, and what is compensated.
// What every tick reads comes first, as in the controller.
#[derive(Clone, Debug)]
#[repr(C)]
pub(crate) struct Surroundings {
    /// Kelvins of its stages that each actuator is to be less warm, near rest.
    offsets: [f32; CHANNELS],
    /// By what each target grows, for the loss.
    scales: [f32; CHANNELS],
    references: [Reference; CHANNELS],
    excursions: [Excursion; CHANNELS],
    apart: [Apart; CHANNELS],
    uneven: [Uneven; CHANNELS],
    /// Kelvins of a heater that one of the surroundings is worth; 0: they are not compensated.
    ratio: f32,
    is_used: bool,
    has_drifted: bool,
    /// What a heater tells more for each kelvin by which the four are warmer in the mean.
    crosstalk: f32,
    /// Kelvins of the films' platinum for each that the resistances tell.
    kelvin: f32,
    /// By how much the loss grows, in the mean of the actuators (1/K).
    growth: f32,
    filter: Filter,
    batch: Batch,
    /// What the readings of all four were off by in the mean, after the last update (K).
    common: f32,
    /// Variance of that (K^2).
    common_variance: f32,
    drift: Drift,
    likeness: Likeness,
    /// Ticks since room and loss are told apart, as far as they are counted.
    apart_since: u16,
    is_probing: bool,
    estimate: Estimate,
    /// What nobody has measured of the heat that the four share, and what that makes each be off by.
    unshared: Option<Unshared>,
}

/// The readings since the last update, summed.
#[derive(Clone, Copy, Debug, Default)]
struct Batch {
    readings: f32,
    measured: f32,
    heating: f32,
    variance: f32,
    /// What the variance grows by where errors stay from update to update.
    lasting: f32,
    /// What the quick poles of the actuator that was read last have still to bring (K).
    unsettled: f32,
}

impl Surroundings {
    pub(crate) fn new(parts: &Parts) -> Self {
        let references = parts.actuators.each_ref().map(Reference::new);
        let growth = references.iter().map(Reference::room_growth).sum::<f32>();
        let mut unknown = Self {
            growth: growth / CHANNELS as f32,
            references,
            excursions: Default::default(),
            uneven: Default::default(),
            unshared: Unshared::of(&parts.heat),
            apart: Default::default(),
            ratio: parts.ambient_ratio,
            is_used: true,
            crosstalk: parts.sensed_crosstalk,
            kelvin: platinum_kelvin(parts),
            filter: Filter::new(),
            batch: Batch::default(),
            common: 0.0,
            common_variance: 0.0,
            drift: Drift::default(),
            has_drifted: false,
            likeness: Likeness::new(parts),
            apart_since: 0,
            is_probing: false,
            offsets: [0.0; CHANNELS],
            scales: [1.0; CHANNELS],
            estimate: Estimate::default(),
        };
        unknown.tell();
        unknown
    }

    /// What is known; `None` where the calibration does not know the resistances well enough.
    pub(crate) fn estimate(&self) -> Option<&Estimate> {
        self.is_known().then_some(&self.estimate)
    }

    /// The states with their deviations, for who asks.
    fn tell(&mut self) {
        let Filter {
            room, loss, place, ..
        } = self.filter;
        // What actuators are apart by is in their mean, too.
        let of_parts = apart::usual(room, loss, (place, place)) / CHANNELS as f32;
        let of_loss = apart::OF_LOSS * loss;
        let unmodelled = UNMODELLED.0 * UNMODELLED.0;
        let of_heaters = RECTANGULAR * self.taken_for_the_room();
        let of_heaters = of_heaters * of_heaters;
        let deviation = fpu::sqrt(self.filter.room_room + unmodelled + of_parts + of_heaters);
        self.estimate = Estimate {
            rise: Kelvin(room * self.kelvin),
            rise_deviation: Kelvin(deviation * self.kelvin),
            loss,
            loss_deviation: fpu::sqrt(self.filter.loss_loss + of_loss * of_loss),
        };
    }

    /// How much may be taken for the room that is of heaters which are no longer as they were at calibration (K).
    fn taken_for_the_room(&self) -> f32 {
        match (self.likeness.is_doubted(), self.has_drifted) {
            (true, _) => FARTHEST.0,
            (false, true) => self.drift.apart(),
            (false, false) => 0.0,
        }
    }

    /// Whether they are to be compensated, where they are known.
    pub(crate) fn is_wanted(&self) -> bool {
        self.is_used
    }

    /// So many ticks pass in which nothing is read.
    pub(crate) fn rest(&mut self, ticks: u16) {
        self.likeness.pass(ticks);
        self.filter.walk(TICK.0 * f32::from(ticks));
        self.tell();
    }

    /// Whether the calibration can tell the surroundings.
    fn is_known(&self) -> bool {
        self.ratio > 0.0
    }

    /// Whether they are compensated.
    pub(crate) fn is_used(&self) -> bool {
        self.is_used && self.is_known()
    }

    /// Compensates them from now on, or does not.
    pub(crate) fn compensate(&mut self, is_used: bool) {
        self.is_used = is_used;
        self.offsets = [0.0; CHANNELS];
        self.scales = [1.0; CHANNELS];
    }

    /// The rise that the stages must reach so that the actuator bends as `rise` does in the room of the calibration.
    #[inline(always)]
    pub(crate) fn target(&self, actuator: usize, rise: Kelvin) -> Kelvin {
        Kelvin((rise.0 - self.offsets[actuator]) * self.scales[actuator])
    }

    /// The rise at which an actuator bends as the surroundings bend it alone: a heater, which cannot cool, takes it no lower. 0 where
    /// they are not warmer, or not compensated.
    pub(crate) fn lowest(&self, actuator: usize) -> Kelvin {
        Kelvin(self.offsets[actuator])
    }

    /// Evidence that a heater has drifted, as a part of what is told.
    pub(crate) fn drift(&self) -> f32 {
        self.drift.evidence()
    }

    /// Whether a heater tells otherwise than the others, or all of them of a loss that no air takes.
    pub(crate) fn has_drifted(&self) -> bool {
        self.has_drifted
    }

    /// Whether the heaters may be another mirror's.
    pub(crate) fn are_heaters_doubted(&self) -> bool {
        self.likeness.is_doubted()
    }

    /// Whether they are to be read at rest, to decide that.
    pub(crate) fn are_heaters_asked(&self) -> bool {
        self.likeness.is_open()
    }

    /// Whether a heater's current tells whose mirror it is.
    pub(crate) fn is_compared(&self, current: Ampere) -> bool {
        self.likeness.asks(current)
    }

    /// Compares what an actuator's heater tells with what it told at calibration.
    pub(crate) fn compare(&mut self, actuator: usize, evidence: &Evidence) {
        let reference = &self.references[actuator];
        let (expected, _) = reference.sensed(evidence.rise);
        let more = self.apart(expected, evidence) / (reference.cold_kelvin + expected);
        self.likeness.read(actuator, more, evidence);
    }

    /// What a heater tells beyond what is expected of it (K), that of the others' heat left out.
    fn apart(&self, expected: f32, evidence: &Evidence) -> f32 {
        evidence.sensed.0 - expected - self.of_others(evidence)
    }

    /// What a heater tells of the others' heat (K).
    fn of_others(&self, evidence: &Evidence) -> f32 {
        self.crosstalk * (evidence.mean_rise.0 - evidence.rise.0)
    }

    /// Whether an actuator that is not driven is to be driven as little as shows its resistance.
    pub(crate) fn is_probing(&self) -> bool {
        self.is_probing
    }

    /// Adds an actuator's reading to the next update.
    pub(crate) fn read(&mut self, actuator: usize, evidence: &Evidence) {
        let Evidence {
            sensed,
            rise,
            unsettled,
            held_back,
            current,
            ..
        } = *evidence;
        let reference = &self.references[actuator];
        let (expected, slope) = reference.sensed(rise);
        let apart = self.apart(expected, evidence);
        let halfway = Kelvin(rise.0 + 0.5 * apart / slope);
        // Not so for NaN.
        let is_possible = apart.abs() < 2.0 * FARTHEST.0;
        if !is_possible {
            return;
        }
        let sensitivity = reference.sensitivity(halfway, slope);
        let noise = NOISE.0 / current.0 * (reference.cold_kelvin + sensed.0);
        let lag = UNSETTLED * unsettled.0;
        let measured = apart * sensitivity;
        let heating = reference.heating(rise);
        let square = sensitivity * sensitivity;
        let crosstalk = SENSED_CROSSTALK * self.of_others(evidence);
        let lasting = self.excursions[actuator].variance()
            + self.uneven[actuator].variance
            + crosstalk * crosstalk;
        let lasting = lasting * square;
        let variance = (noise * noise + lag * lag) * square + lasting;
        self.batch.readings += 1.0;
        self.batch.measured += measured;
        self.batch.heating += heating;
        self.batch.variance += variance;
        self.batch.unsettled = unsettled.0;
        self.batch.lasting += lasting;
        let expected = self.filter.expected(heating, self.growth);
        self.apart[actuator].read(
            measured - expected,
            variance + excursion::AS_NOISE * lasting,
        );
        if self.drift.watches(actuator) {
            let order = FIRST_ORDER * measured;
            // Where it goes beyond what was measured, its curve is a guess; and while room and loss are not told apart, actuators
            // at different heat are off by different parts of both.
            let place = self.filter.place;
            let warmer = heating - place;
            let part = match warmer.abs() < place {
                true => warmer / place,
                false => 1.0,
            };
            let by_heat = part * part * self.filter.room_room;
            let unlike = order * order + held_back.0 * held_back.0 + by_heat + self.common_variance;
            // What all four are off by is a room or a loss that the filter still follows, or what is left of a move.
            self.drift.watch(&Innovation {
                off: measured - expected - self.common,
                variance: variance + unlike + self.usually_apart(heating),
            });
        }
    }

    /// Variance of what an actuator at this heating is apart by from what the filter tells of all four (K^2).
    fn usually_apart(&self, heating: f32) -> f32 {
        let Filter {
            room, loss, place, ..
        } = self.filter;
        self.filter.variance(heating) + apart::usual(room, loss, (heating, place))
    }

    /// Ticks until a position that was reached so many ticks ago has told what it can, for the estimate moves the mirror while it does:
    /// where room and loss are not told apart, since it was reached, else since they are.
    pub(crate) fn ticks_to_learn(&self, since: u16) -> f32 {
        let known_since = match self.are_told_apart() {
            true => self.apart_since,
            false => since,
        };
        match self.is_used() {
            true => f32::from(LEARNT.saturating_sub(known_since)),
            false => 0.0,
        }
    }

    /// Whether the room is told apart from the loss.
    fn are_told_apart(&self) -> bool {
        self.filter.room_room < TOLD_APART.0 * TOLD_APART.0
    }

    /// Whether nobody has measured what the four share of their heat.
    pub(crate) fn is_sharing_unknown(&self) -> bool {
        self.unshared.is_some()
    }

    /// An actuator is so much warmer than a level plate at the mean height of the four asks for. Once in every [`PERIOD`].
    pub(crate) fn pass_unevenly(&mut self, actuator: usize, warmer: Kelvin) {
        if let Some(unshared) = &self.unshared {
            self.uneven[actuator].pass(unshared, warmer);
        }
    }

    /// Brings one actuator's target nearer to where it bends as at the rise `asked` in the room of the calibration. Where the
    /// actuator is on its way there does not count: a step from there would take the bend of its curve for the surroundings'. Once in
    /// every [`PERIOD`].
    pub(crate) fn follow(&mut self, actuator: usize, asked: Kelvin) {
        // What compensates another room is no move.
        self.excursions[actuator].pass(asked);
        let rise = self.target(actuator, asked);
        let reference = &self.references[actuator];
        let heating = reference.heating(rise);
        let usual = self.usually_apart(heating);
        let apart = &mut self.apart[actuator];
        apart.pass(usual);
        let (own, unknown) = (apart.counted, apart.unknown);
        let from_rest = asked.0 - self.offsets[actuator];
        if !(self.is_used() && from_rest > NEAR_REST.0) {
            self.scales[actuator] = 1.0;
            return;
        }
        // One step of Newton's method, from the target so far, for: what the resistance tells there is what it told at calibration, and the part of the
        // surroundings that bends otherwise than a heater.
        let (there, slope) = reference.sensed(rise);
        let wanted = reference.sensed(asked).0 + (1.0 - self.ratio) * self.filter.room;
        let halfway = Kelvin(rise.0 + 0.5 * (wanted - there) / slope);
        let of_all = self.filter.expected(heating, self.growth);
        let apart = (of_all + own) / reference.sensitivity(halfway, slope);
        let target = rise.0 + (wanted - there - apart) / slope;
        let target = asked.0 + beyond_the_curves(target - asked.0, unknown);
        let (least, most) = SCALES;
        let scale = target / from_rest;
        self.scales[actuator] = if scale > most {
            most
        } else if scale > least {
            scale
        } else {
            least
        };
    }

    /// The filter's update with what was read since the last one, where this rise is asked for in the mean of all four.
    pub(crate) fn update(&mut self, asked: Kelvin) {
        let batch = core::mem::take(&mut self.batch);
        self.filter.walk(TICK.0 * PERIOD as f32);
        self.drift.turn();
        self.likeness.pass(PERIOD as u16);
        if batch.readings > 0.0 && self.is_known() {
            let part = 1.0 / batch.readings;
            let measured = batch.measured * part;
            let order = FIRST_ORDER * measured;
            let variance =
                batch.variance * part * part + UNMODELLED.0 * UNMODELLED.0 + order * order;
            let (heating, growth) = (batch.heating * part, self.growth);
            let of_place = CURVES_VARIANCE + order * order;
            self.common_variance = batch.lasting * part * part;
            let lasting = excursion::AS_NOISE * self.common_variance;
            let has_arrived = batch.unsettled.abs() < ARRIVED;
            self.filter
                .go((asked.0, has_arrived), (heating, growth), of_place);
            if self
                .filter
                .measure(measured, (heating, growth), (variance, lasting))
            {
                self.drift.jumped();
            }
            self.common = measured - self.filter.expected(heating, growth);
        }
        let (until, from) = PROBED;
        let probed = if self.is_probing { until } else { from };
        self.is_probing = self.is_used() && self.filter.room_room > probed * probed;
        if self.is_used() {
            let bent = self.ratio * beyond_the_curves(self.filter.room, self.filter.room_room);
            for (offset, reference) in self.offsets.iter_mut().zip(&self.references) {
                *offset = bent * reference.per_first_slope;
            }
        }
        // Before room and loss are told apart, either may be anything.
        self.apart_since = match self.are_told_apart() {
            true => self.apart_since.saturating_add(PERIOD as u16),
            false => 0,
        };
        let is_air = self.filter.loss.abs() < AIR || !self.are_told_apart();
        let is_other = self.likeness.is_other();
        self.has_drifted = self.is_known() && (self.drift.is_told() || !is_air || is_other);
        self.tell();
    }
}

/// Kelvins for each that the resistances tell by R0 and xi: a refined calibration's are in proportion to what displacement and
/// power tell, and platinum has a temperature coefficient of its own.
pub fn platinum_kelvin(parts: &Parts) -> f32 {
    let kelvin = parts.actuators.iter().map(|actuator| {
        let at_rest = 1.0 + actuator.tcr.0 * actuator.sensed_rises.knots[0];
        actuator.tcr.0 / (at_rest * FILM_TCR_PER_K)
    });
    kelvin.sum::<f32>() / CHANNELS as f32
}

#[cfg(test)]
mod tests;
