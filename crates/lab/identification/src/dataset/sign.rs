//! Displacements that were recorded the other way round.

use measurement::correlation;

/// Of fewer displacements nothing is said.
const FEWEST: usize = 8;
/// Displacements whose correlation with the mean square of the drives is below this fall where the drives rise. Of a mirror it is above 0.9, whatever
/// is hidden in it; a choice.
const FALLS: f64 = -0.5;
/// How a sign is turned back.
const REMEDY: &str =
    "is their sign turned? `host-tool import FILE --column z=NAME:um:-1` turns it back";

/// A displacement (um) after the mean square of the drives at it (V^2).
pub(super) type Driven = (f64, f64);

/// A sentence where displacements fall as the drives rise, and count towards the substrate, where heat takes the mirror: those of all
/// experiments, or else those of some, by their names.
pub(super) fn turned(experiments: &[(&str, Vec<Driven>)]) -> Option<String> {
    let all: Vec<Driven> = experiments
        .iter()
        .flat_map(|(_, own)| own.clone())
        .collect();
    if falls(&all) {
        return Some(format!(
            "displacements fall where the drives rise, and count towards the substrate: {REMEDY}"
        ));
    }
    let turned = experiments
        .iter()
        .filter(|(_, own)| falls(own) && is_opposite(own));
    let names: Vec<&str> = turned.map(|(name, _)| *name).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{}: displacements fall where the drives rise, unlike those of the other experiments: {REMEDY}",
            names.join(", ")
        )
    })
}

fn falls(displacements: &[Driven]) -> bool {
    let is_enough = displacements.len() >= FEWEST;
    is_enough && correlation(displacements).is_some_and(|found| found < FALLS)
}

/// Whether displacements are on the other side of their zero, too: beyond a resonance a mirror swings against its drive, about where the
/// drive's mean holds it.
fn is_opposite(displacements: &[Driven]) -> bool {
    let total = |of: fn(&Driven) -> f64| displacements.iter().map(of).sum::<f64>();
    let size = (total(|d| d.0 * d.0) * total(|d| d.1 * d.1)).sqrt();
    total(|d| d.0 * d.1) < FALLS * size
}

#[cfg(test)]
mod tests {
    use super::*;

    fn displacements(sign: f64, count: u32) -> Vec<Driven> {
        let squares = (0..count).map(|level| (0.3 * f64::from(level)).powi(2));
        squares
            .map(|square| (square, sign * 15.0 * square))
            .collect()
    }

    fn told(sign: f64, count: u32) -> Option<String> {
        turned(&[("sweep", displacements(sign, count))])
    }

    #[test]
    fn what_falls_with_the_drive_is_told() {
        assert_eq!(told(1.0, 10), None);
        let told = told(-1.0, 10).expect("it falls");
        assert!(told.contains("--column z=NAME:um:-1"), "{told}");
    }

    #[test]
    fn of_few_readings_and_of_a_mirror_that_does_not_move_nothing_is_said() {
        assert_eq!(told(-1.0, 7), None);
        assert_eq!(told(0.0, 10), None);
        assert_eq!(turned(&[]), None);
    }

    #[test]
    fn an_experiment_of_another_sign_is_told_by_its_name() {
        let mut experiments = vec![
            ("sweep", displacements(1.0, 30)),
            ("repeat", displacements(-1.0, 10)),
        ];
        let told = turned(&experiments).expect("it falls");
        assert!(told.starts_with("repeat: displacements fall"), "{told}");
        // Beyond its resonance a mirror swings against its drive.
        let swing = |level: f64| (4.0 + level, 60.0 - 3.0 * level);
        experiments[1].1 = (-5..5).map(|level| swing(f64::from(level))).collect();
        assert_eq!(turned(&experiments), None);
    }
}
