//! Whether the heaters are those of the calibration: by what their resistances differ from each other.
//!
//! A mirror may be exchanged while the board has no power, and the calibration in flash is another's then. One room makes all four heaters
//! of the calibration's mirror tell the same part more, so what each tells beyond the mean of the four is another mirror, or heat from before
//! a start that the board knows nothing of. Heat leaves: what has not shrunk is another mirror.

use super::evidence::Evidence;
use crate::CHANNELS;
use crate::calibration::Parts;
use crate::design::TICK;
use crate::units::{Ampere, Kelvin};

/// What the four differ by from their mean, root of the sum of squares: on its own mirror and board a calibration leaves 0.4 % at most, of which 0.2 %
/// are noise, and virtual mirrors are 0.9 to 8 % from each other (`closed-loop`, test `exchanged`). Currents that two boards sense by gains that nobody has
/// measured, 0.3 % each (`docs/board.md`), make it more than this in one case of 25. One heater alone is 1.4 % off then: `host-tool load-calibration`
/// asks for 1.3 % (`calibration-procedure`, `heaters.rs`).
const OTHER: f32 = 0.012;
/// Below this they are the calibration's: half of that, so that the same noise does not begin a doubt and end it.
const SAME: f32 = 0.006;
/// A doubt is decided by a reading so much later, and kept where it is still this part of what it was: heat that leaves with a time
/// constant of a minute has less, and plate and frame of usual mirrors take 20 s. A choice.
const STAYS: u32 = (10.0 / TICK.0) as u32;
const KEPT: f32 = 0.85;
/// Heaters that are driven end a doubt after this: heat from before the start has left, and another mirror, whose heaters may look alike at a
/// position where they lose otherwise, has been told at others. A choice.
const COOLED: u32 = (60.0 / TICK.0) as u32;
/// A smaller current tells a resistance by more than 0.2 %, of 1 uA of noise.
const LEAST: Ampere = Ampere(0.5e-3);
/// More than the heaters' check takes, 0.3 V on the lowest resistance: 0.97 mA. Where more flows, a heater is warm by its loss, which ages, too.
const MOST_AT_REST: Ampere = Ampere(1.2e-3);
/// So warm a heater may be from before a reset, or have to become yet, to be one at rest (K): a fifth of it, by which its poles may be off, is
/// within what begins no doubt.
const WARM: Kelvin = Kelvin(5.0);
/// Heaters further apart than this part of their mean rise, and [`WARM`], tell what a draught takes of the hotter ones: of a fifth more in the air a
/// third of this, so 0.5 % of the resistance at 60 K.
const LEVEL: f32 = 0.3;

const ALL: u8 = (1 << CHANNELS) - 1;

/// What the heaters tell of it.
#[derive(Clone, Debug)]
pub(super) struct Likeness {
    /// By what part each has told more than at calibration.
    more: [f32; CHANNELS],
    /// Which have told in this period, and in the one before.
    told: [u8; 2],
    /// Whether one of these was driven.
    is_driven: bool,
    /// Whether all four have told at rest.
    is_read: bool,
    doubt: Option<Doubt>,
    is_other: bool,
    /// Readings below this current (A) are asked for: those of driven heaters to decide a doubt only, and none where the calibration does not tell the
    /// heaters apart.
    most: f32,
}

/// They differ, for whatever reason.
#[derive(Clone, Copy, Debug)]
struct Doubt {
    /// By what they differed when it began, as a part.
    apart: f32,
    /// Ticks since then.
    ticks: u32,
}

impl Doubt {
    /// Whether what they differ by is no heat that leaves.
    fn is_confirmed(&self, apart: f32) -> bool {
        self.ticks >= STAYS && apart > OTHER && apart > KEPT * self.apart
    }
}

impl Likeness {
    /// A calibration that takes all heaters for alike, as one that nobody measured does, may be any mirror's.
    pub(super) fn new(parts: &Parts) -> Self {
        let [first, others @ ..] = &parts.actuators;
        let ohm = first.resistance_at_rest();
        let is_measured = others.iter().any(|it| it.resistance_at_rest() != ohm);
        Self {
            more: [0.0; CHANNELS],
            told: [0; 2],
            is_driven: false,
            is_read: false,
            doubt: None,
            is_other: false,
            most: match is_measured && parts.ambient_ratio > 0.0 {
                true => MOST_AT_REST.0,
                false => 0.0,
            },
        }
    }

    /// Whether a reading at this current is asked for.
    pub(super) fn asks(&self, current: Ampere) -> bool {
        current.0 < self.most
    }

    /// A heater has told this part more than at calibration.
    pub(super) fn read(&mut self, actuator: usize, more: f32, evidence: &Evidence) {
        let apart = (evidence.rise.0 - evidence.mean_rise.0).abs();
        let is_still = evidence.unsettled.0.abs() + evidence.held_back.0.abs() < WARM.0;
        let is_told = evidence.current.0 > LEAST.0 && more.abs() < 1.0;
        let is_level = apart < WARM.0 + LEVEL * evidence.mean_rise.0;
        // Not so for NaN.
        if !(is_told && is_still && is_level) {
            return;
        }
        if self.told == [0; 2] {
            self.is_driven = false;
        }
        self.is_driven |= evidence.current.0 >= MOST_AT_REST.0 || evidence.rise.0 >= WARM.0;
        self.more[actuator] = more;
        let [now, before] = &mut self.told;
        *now |= 1 << actuator;
        if *now | *before == ALL {
            self.told = [0; 2];
            self.compare();
        }
    }

    /// All four have told.
    fn compare(&mut self) {
        let mean = self.more.iter().sum::<f32>() / CHANNELS as f32;
        let squares = self.more.iter().map(|more| (more - mean) * (more - mean));
        let apart = fpu::sqrt(squares.sum());
        if !self.is_driven {
            self.compare_at_rest(apart);
        } else if let Some(doubt) = &self.doubt {
            self.is_other |= doubt.is_confirmed(apart);
            if !self.is_other && apart < SAME && doubt.ticks >= COOLED {
                self.doubt = None;
            }
        }
        self.most = match self.doubt {
            Some(_) => f32::INFINITY,
            None => MOST_AT_REST.0,
        };
    }

    fn compare_at_rest(&mut self, apart: f32) {
        self.is_read = true;
        let is_new = match &self.doubt {
            _ if apart < SAME => {
                (self.doubt, self.is_other) = (None, false);
                false
            }
            None => apart > OTHER,
            Some(doubt) => {
                self.is_other |= doubt.is_confirmed(apart);
                doubt.ticks >= STAYS || apart < KEPT * doubt.apart
            }
        };
        if is_new {
            self.doubt = Some(Doubt { apart, ticks: 0 });
        }
    }

    /// So many ticks pass: a period, or a rest.
    pub(super) fn pass(&mut self, ticks: u16) {
        self.told = [0, self.told[0]];
        if let Some(doubt) = &mut self.doubt {
            doubt.ticks = doubt.ticks.saturating_add(ticks.into());
        }
    }

    /// Whether they differ and may be another mirror's.
    pub(super) fn is_doubted(&self) -> bool {
        self.doubt.is_some()
    }

    /// Whether a reading at rest is asked for: none has come yet, or it decides.
    pub(super) fn is_open(&self) -> bool {
        self.most > 0.0 && (!self.is_read || (self.is_doubted() && !self.is_other))
    }

    /// Whether they are.
    pub(super) fn is_other(&self) -> bool {
        self.is_other
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::tests::parts;
    use crate::units::Ohm;
    use proptest::prelude::*;

    const CHECK: Ampere = Ampere(0.83e-3);

    fn measured() -> Likeness {
        let mut parts = parts();
        parts.actuators[2].cold_resistance = Ohm(350.0);
        Likeness::new(&parts)
    }

    fn evidence(current: Ampere) -> Evidence {
        Evidence {
            sensed: Kelvin(0.0),
            rise: Kelvin(0.0),
            mean_rise: Kelvin(0.0),
            unsettled: Kelvin(1.0),
            held_back: Kelvin(0.0),
            current,
        }
    }

    /// A check of the heaters, of which the first tells so much more than the others.
    fn check(likeness: &mut Likeness, room: f32, more: f32) {
        check_at(likeness, CHECK, room, more);
    }

    fn check_at(likeness: &mut Likeness, current: Ampere, room: f32, more: f32) {
        for actuator in 0..CHANNELS {
            if likeness.asks(current) {
                let more = if actuator == 0 { room + more } else { room };
                likeness.read(actuator, more, &evidence(current));
            }
        }
        likeness.pass(16);
    }

    fn wait(likeness: &mut Likeness) {
        for _ in 0..11 {
            likeness.pass(10_000);
        }
    }

    #[test]
    fn what_stays_is_another_mirror_and_is_taken_back_by_its_own() {
        for more in [0.02, -0.02] {
            let mut likeness = measured();
            // It has been driven just now.
            check(&mut likeness, 0.04, 0.2);
            check(&mut likeness, 0.04, more);
            assert!(likeness.is_doubted() && !likeness.is_other());
            check(&mut likeness, 0.04, more);
            assert!(!likeness.is_other(), "at once");
            wait(&mut likeness);
            check(&mut likeness, -0.03, more);
            assert!(likeness.is_other());
            assert!(!likeness.is_open());
            check(&mut likeness, 0.0, 0.002);
            assert!(!likeness.is_doubted() && !likeness.is_other());
        }
    }

    #[test]
    fn what_leaves_is_none() {
        let mut likeness = measured();
        let mut more = 0.05;
        // The root of 3/4: the mean goes along.
        while 0.866 * more > SAME {
            check(&mut likeness, 0.0, more);
            assert!(likeness.is_doubted() && !likeness.is_other(), "{more}");
            wait(&mut likeness);
            // In 11 s, of a minute.
            more *= 0.83;
        }
        check(&mut likeness, 0.0, more);
        assert!(!likeness.is_doubted());
    }

    #[test]
    fn driven_heaters_decide_a_doubt_and_begin_none() {
        let mut likeness = measured();
        let driven = Ampere(5e-3);
        check_at(&mut likeness, driven, 0.0, 0.05);
        assert!(!likeness.is_doubted() && likeness.is_open());
        check(&mut likeness, 0.0, 0.02);
        wait(&mut likeness);
        check_at(&mut likeness, driven, 0.0, 0.02);
        assert!(likeness.is_other());
        check_at(&mut likeness, driven, 0.0, 0.0);
        assert!(likeness.is_other(), "they may be alike there");
        let mut warm = measured();
        check(&mut warm, 0.0, 0.02);
        for _ in 0..6 {
            check_at(&mut warm, driven, 0.0, 0.0);
            assert!(warm.is_doubted() && !warm.is_other());
            wait(&mut warm);
        }
        check_at(&mut warm, driven, 0.0, 0.0);
        assert!(!warm.is_doubted(), "it has cooled");
    }

    #[test]
    fn one_room_and_one_noisy_reading_are_no_mirror() {
        let mut likeness = measured();
        for room in [-0.05, 0.07] {
            check(&mut likeness, room, 0.004);
            assert!(!likeness.is_doubted() && !likeness.is_open());
        }
        check(&mut likeness, 0.0, 0.03);
        check(&mut likeness, 0.0, 0.0);
        assert!(!likeness.is_doubted());
    }

    #[test]
    fn a_calibration_that_takes_heaters_for_alike_may_be_any_mirrors() {
        let mut unmeasured = parts();
        let mut likeness = Likeness::new(&unmeasured);
        check(&mut likeness, 0.0, 0.1);
        assert!(!likeness.is_doubted() && !likeness.is_open());
        unmeasured.actuators[2].cold_resistance = Ohm(350.0);
        unmeasured.ambient_ratio = 0.0;
        assert!(!Likeness::new(&unmeasured).asks(CHECK));
    }

    proptest! {
        #[test]
        fn any_bit_pattern_is_borne(bits in proptest::array::uniform4(any::<u32>())) {
            let mut likeness = measured();
            for (actuator, bits) in bits.into_iter().enumerate() {
                likeness.read(actuator, f32::from_bits(bits), &evidence(CHECK));
            }
            wait(&mut likeness);
            check(&mut likeness, 0.0, 0.0);
            prop_assert!(!likeness.is_doubted() && !likeness.is_other());
        }
    }
}
