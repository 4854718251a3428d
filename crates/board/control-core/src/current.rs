//! The current sense of one board: from codes to amperes, with what its channels are off by.

use crate::CHANNELS;
use crate::codes::{AMPERE_PER_ADC_CODE, AdcCode, PEDESTAL_CODES};
use crate::design::{SENSE_GAIN_TOLERANCE, SENSE_ZERO_TOLERANCE};
use crate::units::Ampere;

/// Offset and gain of each channel: what flows is (the designed reading - `zero`) x `gain`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SenseCalibration {
    zero: [Ampere; CHANNELS],
    gain: [f32; CHANNELS],
}

/// The same, ready for use: amperes = codes x slope + offset.
#[derive(Clone, Debug)]
pub struct CurrentSense {
    slope: [f32; CHANNELS],
    offset: [f32; CHANNELS],
}

const MAGIC: [u8; 4] = *b"EMCS";

impl SenseCalibration {
    /// A board as designed.
    pub const DESIGNED: Self = Self {
        zero: [Ampere(0.0); CHANNELS],
        gain: [1.0; CHANNELS],
    };

    /// Bytes of [`Self::to_bytes`].
    pub const BYTES: usize = MAGIC.len() + 2 * 4 * CHANNELS;

    /// A calibration of these numbers; `None` where no sound board can have them.
    pub fn new(zero: [Ampere; CHANNELS], gain: [f32; CHANNELS]) -> Option<Self> {
        // NaN is within no tolerance.
        let sound_zero = |zero: &Ampere| zero.0.abs() <= SENSE_ZERO_TOLERANCE.0;
        let sound_gain = |gain: &f32| (gain - 1.0).abs() <= SENSE_GAIN_TOLERANCE;
        (zero.iter().all(sound_zero) && gain.iter().all(sound_gain)).then_some(Self { zero, gain })
    }

    /// What is read, as designed, where nothing flows.
    pub fn zero(&self) -> [Ampere; CHANNELS] {
        self.zero
    }

    /// What flows for each ampere that is read, as designed, beyond [`Self::zero`].
    pub fn gain(&self) -> [f32; CHANNELS] {
        self.gain
    }

    /// The same zeros with the designed gains. The protection goes by it: a zero that is wrong shows where nothing is
    /// driven, a wrong gain would make every heater look colder.
    #[must_use]
    pub fn with_designed_gain(&self) -> Self {
        Self {
            zero: self.zero,
            ..Self::DESIGNED
        }
    }

    /// As bytes: the letters `EMCS`, four zeros (A) and four gains, little endian.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let (magic, numbers) = bytes.split_at_mut(MAGIC.len());
        magic.copy_from_slice(&MAGIC);
        let values = self.zero.iter().map(|zero| zero.0).chain(self.gain);
        for (place, value) in numbers.chunks_exact_mut(4).zip(values) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        bytes
    }

    /// From bytes, checked as [`Self::new`] checks; `None` where they are not what
    /// [`Self::to_bytes`] makes.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let numbers = bytes.strip_prefix(&MAGIC)?;
        let (numbers, rest) = numbers.as_chunks::<4>();
        let numbers: &[[u8; 4]; 2 * CHANNELS] = numbers.try_into().ok()?;
        let [a, b, c, d, gain @ ..] = numbers.map(f32::from_le_bytes);
        let zero = [a, b, c, d].map(Ampere);
        rest.is_empty().then(|| Self::new(zero, gain)).flatten()
    }
}

impl CurrentSense {
    /// The sense of a board with this calibration.
    pub fn new(calibration: &SenseCalibration) -> Self {
        let slope = calibration.gain.map(|gain| gain * AMPERE_PER_ADC_CODE);
        Self {
            slope,
            offset: core::array::from_fn(|i| {
                -(PEDESTAL_CODES * slope[i] + calibration.zero[i].0 * calibration.gain[i])
            }),
        }
    }

    /// What flows where these codes are read.
    pub fn currents(&self, codes: [AdcCode; CHANNELS]) -> [Ampere; CHANNELS] {
        core::array::from_fn(|i| Ampere(f32::from(codes[i].0) * self.slope[i] + self.offset[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_calibration() -> impl Strategy<Value = SenseCalibration> {
        let zero = proptest::array::uniform4(-50e-6_f32..50e-6);
        let gain = proptest::array::uniform4(0.951_f32..1.049);
        (zero, gain).prop_map(|(zero, gain)| {
            SenseCalibration::new(zero.map(Ampere), gain).expect("within the tolerances")
        })
    }

    proptest! {
        #[test]
        fn bytes_return_to_the_same(calibration in any_calibration()) {
            let bytes = calibration.to_bytes();
            prop_assert_eq!(SenseCalibration::from_bytes(&bytes), Some(calibration));
            prop_assert_eq!(SenseCalibration::from_bytes(&bytes[1..]), None);
            prop_assert_eq!(SenseCalibration::from_bytes(&bytes[..bytes.len() - 1]), None);
        }

        #[test]
        fn any_bytes_are_sound_numbers_or_none(bytes in proptest::collection::vec(any::<u8>(), 32)) {
            let bytes = [&MAGIC[..], &bytes].concat();
            if let Some(calibration) = SenseCalibration::from_bytes(&bytes) {
                prop_assert!(calibration.gain().iter().all(|gain| (0.9..1.1).contains(gain)));
            }
        }

        #[test]
        fn a_calibrated_reading_is_what_flows(calibration in any_calibration(), milliampere in 0.0_f32..11.0) {
            let flows = milliampere * 1e-3;
            let read = |i: usize| Ampere(flows / calibration.gain[i] + calibration.zero[i].0);
            let codes = core::array::from_fn(|i| AdcCode::nearest(read(i)));
            for current in CurrentSense::new(&calibration).currents(codes) {
                // Half a step of 0.19 uA, at a gain of 1.1 at most.
                prop_assert!((current.0 - flows).abs() < 0.11e-6, "{current:?} of {flows}");
            }
        }
    }
}
