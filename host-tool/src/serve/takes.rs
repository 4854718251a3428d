//! What a command takes: parameters in base units, or with a unit as people write it.

use quantities::{Length, QuantityError, Span, Voltage, in_unit};

use crate::scpi::{Error, Kind};
use crate::serve::action::Action;
use crate::serve::trace::MOST_ROWS;
use crate::tilted_pose::TiltedPose;

/// The parameters of a command, and what is said with them.
pub(super) enum Takes {
    Nothing(Action),
    Length(fn(Length) -> Action),
    /// Piston, and the tilts about x and y.
    Pose(fn(TiltedPose) -> Action),
    /// One voltage for all four actuators, or one for each (V).
    Voltages(fn([f64; 4]) -> Action),
    Span(fn(Span) -> Action),
    CountAndSpan(fn(u32, Span) -> Action),
    Register(fn(u16) -> Action),
    /// One of the standard registers, which have half as many bits (IEEE 488.2, 11).
    StandardRegister(fn(u8) -> Action),
    Boolean(fn(bool) -> Action),
    Text(fn(String) -> Action),
}

impl Takes {
    /// How the reference writes them.
    pub(super) fn told(&self) -> &'static str {
        match self {
            Self::Nothing(_) => "",
            Self::Length(_) => "<length>",
            Self::Pose(_) => "<length>,<angle>,<angle>",
            Self::Voltages(_) => "<voltage>[,<voltage>,<voltage>,<voltage>]",
            Self::Span(_) => "<time>",
            Self::CountAndSpan(_) => "<count>,<time>",
            Self::Register(_) | Self::StandardRegister(_) => "<mask>",
            Self::Boolean(_) => "{ON|OFF}",
            Self::Text(_) => "<string>",
        }
    }

    /// What the command `header` says with these parameters, as they were typed.
    ///
    /// # Errors
    /// Where there are too many or too few, or one is of another kind.
    pub(super) fn read(&self, header: &str, typed: &[String]) -> Result<Action, Error> {
        match (self, typed) {
            (Self::Nothing(action), []) => Ok(action.clone()),
            (Self::Length(action), [text]) => quantity(text, "m").map(action),
            (Self::Pose(action), [z, x, y]) => Ok(action(TiltedPose::new(
                quantity(z, "m")?,
                quantity(x, "rad")?,
                quantity(y, "rad")?,
            ))),
            (Self::Voltages(action), [text]) => volts(text).map(|all| action([all; 4])),
            (Self::Voltages(action), [a, b, c, d]) => {
                Ok(action([volts(a)?, volts(b)?, volts(c)?, volts(d)?]))
            }
            (Self::Span(action), [text]) => quantity(text, "s").map(action),
            (Self::CountAndSpan(action), [count, span]) => {
                let what = format!("a count from 1 to {MOST_ROWS}");
                let count = whole(count, &what, 1, MOST_ROWS)?;
                Ok(action(count, quantity(span, "s")?))
            }
            (Self::Register(action), [text]) => {
                let mask = whole(text, "a mask from 0 to 65535", 0, u16::MAX.into())?;
                Ok(action(mask as u16))
            }
            (Self::StandardRegister(action), [text]) => {
                let mask = whole(text, "a mask from 0 to 255", 0, u8::MAX.into())?;
                Ok(action(mask as u8))
            }
            (Self::Boolean(action), [text]) => boolean(text).map(action),
            (Self::Text(action), [text]) => string(text).map(action),
            _ => Err(self.miscounted(header, typed.len())),
        }
    }

    fn miscounted(&self, header: &str, given: usize) -> Error {
        let most = match self {
            Self::Nothing(_) => 0,
            Self::Voltages(_) => 4,
            Self::Pose(_) => 3,
            Self::CountAndSpan(_) => 2,
            _ => 1,
        };
        let kind = match given > most {
            true => Kind::ParameterNotAllowed,
            false => Kind::MissingParameter,
        };
        let said = match self.told() {
            "" => format!("{header} takes no parameters"),
            told => format!("{header} takes {told}"),
        };
        Error::new(kind, said)
    }
}

fn volts(text: &str) -> Result<f64, Error> {
    quantity::<Voltage>(text, "V").map(|voltage| voltage.v)
}

/// A number with its unit, whose case does not matter; without one it is in the base unit.
fn quantity<Q>(text: &str, base_unit: &str) -> Result<Q, Error>
where
    Q: std::str::FromStr<Err = QuantityError>,
{
    let read = |text: &str| in_unit(text, base_unit);
    // Units are small letters but for the volt; M is milli, as of all units of SCPI but megahertz and megohm.
    let in_usual_case = || text.to_lowercase().replace('v', "V");
    let parsed = read(text).or_else(|error| read(&in_usual_case()).map_err(|_| error));
    parsed.map_err(|error| {
        let kind = match error {
            QuantityError::WrongUnit { .. } => Kind::InvalidSuffix,
            QuantityError::Unusable { .. } => Kind::DataOutOfRange,
            QuantityError::NoNumber { .. }
            | QuantityError::NoUnit { .. }
            | QuantityError::Comma { .. } => Kind::DataType,
        };
        Error::new(kind, error.to_string())
    })
}

fn whole(text: &str, what: &str, least: u32, most: u32) -> Result<u32, Error> {
    let said = || format!("`{text}` is not {what}");
    let number = integer(text).ok_or_else(|| Error::new(Kind::DataType, said()))?;
    match (u64::from(least)..=u64::from(most)).contains(&number) {
        true => Ok(number as u32),
        false => Err(Error::new(Kind::DataOutOfRange, said())),
    }
}

/// A whole number, also with a point or an exponent (IEEE 488.2, 7.7.2); the largest there is where it is beyond all.
fn integer(text: &str) -> Option<u64> {
    let written_out = || {
        let number: f64 = text.parse().ok()?;
        (number >= 0.0 && number.fract() == 0.0).then_some(number as u64)
    };
    text.parse().ok().or_else(written_out)
}

fn boolean(text: &str) -> Result<bool, Error> {
    match text.to_ascii_uppercase().as_str() {
        "ON" | "1" => Ok(true),
        "OFF" | "0" => Ok(false),
        _ => {
            let said = format!("`{text}` is neither ON nor OFF");
            Err(Error::new(Kind::DataType, said))
        }
    }
}

/// A text in quotes; two of them within are one (IEEE 488.2, 7.7.5).
fn string(text: &str) -> Result<String, Error> {
    ['"', '\'']
        .into_iter()
        .find_map(|quote| {
            let inner = text.strip_prefix(quote)?.strip_suffix(quote)?;
            Some(inner.replace(&format!("{quote}{quote}"), &quote.to_string()))
        })
        .ok_or_else(|| {
            let said = format!("`{text}` is no string; write it in quotes");
            Error::new(Kind::DataType, said)
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::serve::action::Registers;
    use proptest::prelude::*;

    #[test]
    fn a_number_without_a_unit_is_in_the_base_unit_and_case_does_not_matter() {
        for text in [
            "120um", "120 UM", "0.12mm", "0.12 MM", "1.2e-4", "120 µm", "1.2E-4 M",
        ] {
            let length: Length = quantity(text, "m").expect(text);
            assert!((length.um - 120.0).abs() < 1e-9, "{text}");
        }
        assert_eq!(quantity("5MS", "s"), Ok(Span { s: 5e-3 }));
        for text in ["500mV", "500MV", "500mv", "500000UV", "0.5 v", "5E-1"] {
            let volts = volts(text).expect(text);
            assert!((volts - 0.5).abs() < 1e-12, "{text}");
        }
        let length = Takes::Length(Action::SetPosition);
        let pose = Takes::Pose(Action::SetPose);
        let span = Takes::Span(Action::SetSettling);
        let count = Takes::CountAndSpan(Action::Trace);
        let questionable = Takes::Register(|mask| Action::SetEnable(Registers::Questionable, mask));
        for (takes, typed, kind) in [
            (&length, "120V", Kind::InvalidSuffix),
            (&length, "NAN", Kind::DataType),
            (&length, "", Kind::DataType),
            (&length, "1e400m", Kind::DataOutOfRange),
            (&pose, "1um,2deg", Kind::MissingParameter),
            (&pose, "1um,2deg,1V", Kind::InvalidSuffix),
            (&span, "-1s", Kind::DataOutOfRange),
            (&count, "0,1ms", Kind::DataOutOfRange),
            (&count, "65537,1ms", Kind::DataOutOfRange),
            (&count, "1e9,1ms", Kind::DataOutOfRange),
            (&count, "1e99,1ms", Kind::DataOutOfRange),
            (&count, "1.5,1ms", Kind::DataType),
            (&count, "-1,1ms", Kind::DataType),
            (&count, "inf,1ms", Kind::DataType),
            (&questionable, "65536", Kind::DataOutOfRange),
            (
                &Takes::StandardRegister(Action::SetEventEnable),
                "256",
                Kind::DataOutOfRange,
            ),
            (&Takes::Boolean(Action::SetOutput), "MAYBE", Kind::DataType),
            (&Takes::Text(Action::SelectBoard), "bare", Kind::DataType),
        ] {
            let typed: Vec<String> = typed.split(',').map(str::to_owned).collect();
            let error = takes.read("X", &typed).expect_err("wrong");
            assert_eq!(error.kind, kind, "{typed:?}: {error}");
        }
    }

    #[test]
    fn a_count_may_have_an_exponent_and_one_that_is_too_large_is_told_with_the_largest() {
        let count = Takes::CountAndSpan(Action::Trace);
        let read = |typed: &str| count.read("TRAC?", &[typed.to_owned(), "1ms".to_owned()]);
        for typed in ["1000", "1e3", "1.0E+3", "1000.0"] {
            let read = read(typed);
            assert!(matches!(read, Ok(Action::Trace(1000, _))), "{typed}");
        }
        let said = read("1e9").expect_err("too many").to_string();
        assert!(
            said.contains("`1e9` is not a count from 1 to 65536"),
            "{said}"
        );
    }

    proptest! {
        #[test]
        fn a_string_comes_back_from_its_quotes_and_any_text_ends(text in ".{0,30}") {
            prop_assert_eq!(string(&crate::scpi::quoted(&text)), Ok(text.clone()));
            let _ = (quantity::<Length>(&text, "m"), whole(&text, "", 0, 1), boolean(&text));
        }
    }
}
