//! Displacements that were recorded the other way round.

use measurement::correlation;

/// Of fewer displacements nothing is said.
const FEWEST: usize = 8;
/// Displacements whose correlation with the mean square of the drives is below this fall where the drives rise. Of a mirror it is above 0.9, whatever
/// is hidden in it; a choice.
const FALLS: f64 = -0.5;

/// A sentence where displacements fall as the drives rise: they count towards the substrate, where heat takes the mirror. Each comes with
/// the mean square of the drives (V^2).
pub(super) fn turned(displacements: &[(f64, f64)]) -> Option<String> {
    let falls = displacements.len() >= FEWEST && correlation(displacements)? < FALLS;
    falls.then(|| {
        "displacements fall where the drives rise, and count towards the substrate: is their sign turned? \
         `host-tool import FILE --column z=NAME:um:-1` turns it back"
            .to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn displacements(sign: f64, count: u32) -> Vec<(f64, f64)> {
        let squares = (0..count).map(|level| (0.3 * f64::from(level)).powi(2));
        squares
            .map(|square| (square, sign * 15.0 * square))
            .collect()
    }

    #[test]
    fn what_falls_with_the_drive_is_told() {
        assert_eq!(turned(&displacements(1.0, 10)), None);
        let told = turned(&displacements(-1.0, 10)).expect("it falls");
        assert!(told.contains("--column z=NAME:um:-1"), "{told}");
    }

    #[test]
    fn of_few_readings_and_of_a_mirror_that_does_not_move_nothing_is_said() {
        assert_eq!(turned(&displacements(-1.0, 7)), None);
        assert_eq!(turned(&displacements(0.0, 10)), None);
        assert_eq!(turned(&[]), None);
    }
}
