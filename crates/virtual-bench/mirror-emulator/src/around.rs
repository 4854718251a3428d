//! What a person moves around the mirror: the sensor's spot on the plate, the stage under the mirror, the oven, the air.

use std::fmt;

use emulated_board::Controls;
use quantities::{Length, Temperature, in_unit};

/// The travel of spot and stage either way (um): twenty times a plate's side.
const TRAVEL_UM: f64 = 10_000.0;
/// Rooms that boards are used in (degC): the industrial range.
const OVEN_C: [f64; 2] = [-40.0, 85.0];
/// How many times its heat the air may take: none is a vacuum, ten times a strong wind.
const AIR: [f64; 2] = [0.0, 10.0];

/// One thing, and where it is brought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Around {
    /// The spot: x and y from the plate's centre (um).
    Spot([f64; 2]),
    /// The stage: how far towards the substrate (um).
    Stage(f64),
    /// The oven (degC).
    Oven(f64),
    /// How many times the heat the air takes.
    Air(f64),
}

impl Around {
    /// What `words` ask for; `None` where it is nothing around the mirror.
    ///
    /// # Errors
    /// Where they ask for something that cannot be: what can, in words.
    pub(crate) fn asked(words: &[String]) -> Option<Result<Self, String>> {
        let (what, values) = words.split_first()?;
        let travel = [-TRAVEL_UM, TRAVEL_UM];
        let far = "in micrometres, at most 10 mm either way";
        let (asked, how) = match what.as_str() {
            "spot" => (
                within(travel, values, micrometres).map(Self::Spot),
                format!("`spot X Y`: from the plate's centre, {far}"),
            ),
            "stage" => (
                within(travel, values, micrometres).map(|[um]| Self::Stage(um)),
                format!("`stage UM`: towards the substrate, {far}"),
            ),
            "oven" => (
                within(OVEN_C, values, celsius).map(|[celsius]| Self::Oven(celsius)),
                "`oven CELSIUS`: from -40 to 85 degrees".to_owned(),
            ),
            "air" => (
                within(AIR, values, |times| times.parse().ok()).map(|[factor]| Self::Air(factor)),
                "`air FACTOR`: how many times its heat the air takes, from 0 to 10".to_owned(),
            ),
            _ => return None,
        };
        Some(asked.ok_or(how))
    }

    /// Brings it there.
    pub(crate) fn bring(self, controls: &Controls) {
        match self {
            Self::Spot(at_um) => controls.move_spot(at_um),
            Self::Stage(um) => controls.move_stage(um),
            Self::Oven(celsius) => controls.set_oven(celsius),
            Self::Air(factor) => controls.set_air(factor),
        }
    }
}

impl fmt::Display for Around {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spot([x, y]) => write!(f, "the spot is at x {x} um, y {y} um of the plate"),
            Self::Stage(um) => write!(f, "the stage is {um} um from where it was first"),
            Self::Oven(celsius) => write!(f, "the oven goes to {celsius} degC"),
            Self::Air(factor) => write!(f, "the air takes {factor} times its heat"),
        }
    }
}

/// So many numbers between these bounds, each as `read` reads it.
fn within<const N: usize>(
    [low, high]: [f64; 2],
    words: &[String],
    read: impl Fn(&str) -> Option<f64>,
) -> Option<[f64; N]> {
    // Not so for NaN.
    let is_possible = |number: &f64| (low..=high).contains(number);
    let numbers: Option<Vec<f64>> = words
        .iter()
        .map(|word| read(word).filter(is_possible))
        .collect();
    numbers?.try_into().ok()
}

fn micrometres(word: &str) -> Option<f64> {
    in_unit(word, "um").ok().map(|Length { um }| um)
}

fn celsius(word: &str) -> Option<f64> {
    let read = in_unit(word, "degC").ok();
    read.map(|Temperature { celsius }| celsius)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(line: &str) -> Option<Result<Around, String>> {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        Around::asked(&words)
    }

    #[test]
    fn what_can_be_is_done_and_told() {
        for (line, told) in [
            (
                "spot 10 -20um",
                "the spot is at x 10 um, y -20 um of the plate",
            ),
            ("stage 0.005mm", "the stage is 5 um from where it was first"),
            (
                "stage 10mm",
                "the stage is 10000 um from where it was first",
            ),
            ("oven 85", "the oven goes to 85 degC"),
            ("oven -40degC", "the oven goes to -40 degC"),
            ("air 0", "the air takes 0 times its heat"),
        ] {
            let around = asked(line).expect(line).expect(line);
            assert_eq!(around.to_string(), told);
        }
    }

    #[test]
    fn what_cannot_be_is_told_how_it_can() {
        for line in [
            "spot",
            "spot 1",
            "spot nan 1",
            "spot 1 inf",
            "spot 1 2 3",
            "spot 1V 2V",
            "stage 1e308",
            "stage 10.001mm",
            "stage -10.001mm",
            "stage um",
            "oven 1e9",
            "oven 85.1",
            "oven -40.1degC",
            "oven 22K",
            "air -1",
            "air nan",
            "air 10.1",
            "air 2um",
        ] {
            let how = asked(line).expect(line).expect_err(line);
            let what = line.split(' ').next().expect("a word");
            assert!(how.starts_with(&format!("`{what} ")), "{line}: {how}");
        }
        assert_eq!(asked("set-z 10um"), None);
        assert_eq!(Around::asked(&[]), None);
    }
}
