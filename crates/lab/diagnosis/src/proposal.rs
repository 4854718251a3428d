//! What a diagnosis proposes to do next, as data: whoever asks has its own words for how.

use experiments::Measurement;
use serde::Serialize;

/// What to measure next.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextMeasurement {
    /// What it would tell.
    pub why: String,
    /// What to do.
    pub how: Next,
}

impl NextMeasurement {
    /// The same beside a session that began at this temperature of the room (degC), or does not tell it. A measurement without one is not
    /// compared with one that has it.
    pub(crate) fn in_the_room(mut self, room_c: Option<f64>) -> Self {
        let Next::Measure(proposal) = &mut self.how else {
            return self;
        };
        match (room_c, proposal.ambient_c) {
            (Some(room_c), None) => {
                proposal.ambient_c = Some(room_c);
                self.why += &format!(
                    "; tell the room's temperature then, as the session does, which began at {room_c} degC"
                );
            }
            (None, Some(_)) => self.why = format!("{}; {SESSION_IS_TO_TELL}", self.why),
            _ => {}
        }
        self
    }
}

/// What a session without the room's temperature takes before it is compared with a measurement that has one.
pub(crate) const SESSION_IS_TO_TELL: &str =
    "the session is to tell its own room first, in a column T_ambient_C in degrees Celsius";

/// What to do next.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Next {
    /// The bench can measure it.
    Measure(Proposal),
    /// It takes other means: what is known of the effect with this id says which.
    ReadAbout(String),
}

/// A measurement, and how it is asked for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Proposal {
    /// What is measured.
    pub measurement: Measurement,
    /// How warm the surroundings are to be (degC), where they matter.
    pub ambient_c: Option<f64>,
    /// What to call the file, or the folder, where the measurement's own name would say too little.
    pub name: Option<&'static str>,
}

impl From<Proposal> for Next {
    fn from(proposal: Proposal) -> Self {
        Self::Measure(proposal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beside_a_session_that_tells_its_room_a_measurement_tells_it_too() {
        let next = |ambient_c| NextMeasurement {
            why: "a step".to_owned(),
            how: Next::Measure(Proposal {
                measurement: Measurement::Session { max_v: 3.5 },
                ambient_c,
                name: None,
            }),
        };
        let told = next(None).in_the_room(Some(22.5));
        assert!(told.why.ends_with("began at 22.5 degC"), "{}", told.why);
        assert_eq!(told.how, next(Some(22.5)).how);
        assert_eq!(next(None).in_the_room(None), next(None));
        assert_eq!(next(Some(62.0)).in_the_room(Some(22.5)), next(Some(62.0)));
        let oven = next(Some(62.0)).in_the_room(None);
        assert!(oven.why.ends_with(SESSION_IS_TO_TELL), "{}", oven.why);
    }
}
