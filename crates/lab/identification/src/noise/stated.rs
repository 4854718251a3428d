//! Whether files are right in what they say of their displacement's noise. A number ten times too small makes chance look like physics,
//! and one that is too large hides what is missing.

use super::{ENOUGH, roughness};
use crate::digit::last_digit;
use measurement::{MeasurementFile, Session};
use std::collections::BTreeMap;

/// Readings scatter by this many times what a file says, or by one in so many, if it is wrong: a choice, beyond what a spread of
/// [`ENOUGH`] differences may be off by, and what a sensor's specification may be.
const WRONG: f64 = 4.0;
/// The lower quartile of the magnitudes of normal numbers, in standard deviations: the normal distribution's quantile of 5/8.
const QUARTILE_OF_NORMAL: f64 = 0.3186;
/// So many files are told by their names.
const TOLD: usize = 3;

/// What files say of their noise that their readings do not bear out, in sentences.
pub(crate) fn misstated(session: &Session) -> Vec<String> {
    let mut by_noise: BTreeMap<u64, Vec<(&str, Option<f64>)>> = BTreeMap::new();
    for (name, file) in &session.files {
        let said_um = file.keys.displacement_noise_um();
        if let Some(said_um) = said_um.filter(|_| file.has_displacement()) {
            // No noise is negative, and the bits of such numbers are in their order.
            let same = by_noise.entry(said_um.max(0.0).to_bits()).or_default();
            same.push((name, scatter_um(file)));
        }
    }
    let sentence = |(said, files): (u64, Vec<(&str, Option<f64>)>)| {
        let said_nm = 1e3 * f64::from_bits(said);
        let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
        let found = files.iter().filter_map(|(_, scatter)| *scatter);
        let (least, most) = found.fold((f64::INFINITY, 0.0_f64), |(least, most), um| {
            (least.min(um), most.max(um))
        });
        let scatters_nm = match () {
            () if said_nm == 0.0 => {
                return Some(format!(
                    "{}: noise_z_nm=0 says nothing, and the noise is taken from the readings, or as that of a usual sensor",
                    told(&names)
                ));
            }
            () if least.is_finite() && 1e3 * least > WRONG * said_nm => 1e3 * least,
            () if most > 0.0 && 1e3 * most * WRONG < said_nm => 1e3 * most,
            () => return None,
        };
        let consequence = if scatters_nm > said_nm {
            "what is chance looks like physics"
        } else {
            "what is missing may look like chance"
        };
        Some(format!(
            "{}: noise_z_nm={} is not what the readings show, which scatter by {scatters_nm:.0} nm from one to the next: {consequence}. Leave the line out, \
             and it is taken from the readings",
            told(&names),
            // As it was written.
            (1e6 * said_nm).round() / 1e6,
        ))
    };
    by_noise.into_iter().filter_map(sentence).collect()
}

/// What a file's displacements scatter by from one to the next, one standard deviation (um), `None` where they are too few or at no even
/// times. It is read off the lower quartile of differences that cancel any cubic, since a mirror rings in some rows, and sines are no cubics; it
/// is no less than what the last digit scatters by (a rectangular distribution; JCGM 100:2008, 4.3.7).
fn scatter_um(file: &MeasurementFile) -> Option<f64> {
    if file.keys.is_steady() {
        return None;
    }
    let mut roughness = roughness(&file.rows, false, |row| Some([row.z_um?, 1.0]));
    roughness.sort_by(f64::total_cmp);
    let quartile = roughness.get(roughness.len() / 4)?;
    let digit = last_digit(file.rows.iter().filter_map(|row| row.z_um));
    let scatter = (quartile / QUARTILE_OF_NORMAL).max(digit / 12f64.sqrt());
    (roughness.len() >= ENOUGH).then_some(scatter)
}

/// These files, the first few by their names.
fn told(names: &[&str]) -> String {
    let more = match names.len().saturating_sub(TOLD) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let names: Vec<String> = names.iter().take(TOLD).map(|n| format!("`{n}`")).collect();
    format!("{}{more}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A sine and a step that rings, with noise of 20 nm, read to the next such digit (um), and what their files say.
    fn said(noise_z_nm: &str, digit_um: f64) -> Vec<String> {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut file = |name: &str, z_um: fn(f64) -> f64| {
            let mut text = format!("# noise_z_nm={noise_z_nm}\nt_s,V_V,z_um\n");
            for row in 1..=300 {
                let read = z_um(f64::from(row)) + 0.02 * noise();
                let read = (read / digit_um).round() * digit_um;
                text += &format!("{},1,{read:.5}\n", f64::from(row) * 1e-3);
            }
            let file = MeasurementFile::parse(name, &text).expect("a file");
            (name.to_owned(), file)
        };
        let files = vec![
            file("sine.csv", |row| 30.0 + 30.0 * (row / 8.0).sin()),
            file("step.csv", |row| {
                60.0 + 40.0 * (-row / 20.0).exp() * (2.0 * row).sin()
            }),
        ];
        misstated(&Session { files })
    }

    #[test]
    fn a_noise_that_the_readings_do_not_show_is_told() {
        let small = said("1", 1e-4);
        assert!(
            small[0].starts_with("`sine.csv`, `step.csv`: noise_z_nm=1 is not"),
            "{small:?}"
        );
        assert!(small[0].contains("chance looks like physics"), "{small:?}");
        let large = said("2000", 1e-4);
        assert!(large[0].contains("noise_z_nm=2000"), "{large:?}");
        assert!(
            large[0].contains("missing may look like chance"),
            "{large:?}"
        );
        assert!(said("0", 1e-4)[0].contains("noise_z_nm=0 says nothing"));
    }

    #[test]
    fn a_mirror_that_rings_and_a_coarse_digit_are_no_other_noise() {
        assert_eq!(said("20", 1e-4), [""; 0]);
        assert_eq!(said("20", 0.1), [""; 0]);
    }
}
