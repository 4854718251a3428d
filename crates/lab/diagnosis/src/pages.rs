//! That pages of the docs say of this package's numbers what they are.

use crate::candidate::PRICE;
use crate::null_distribution::{FLOOR, MARGIN};
use crate::null_ensemble::MEMBERS;

const THEORY: &str = include_str!("../../../../docs/theory/missing-physics.md");
const SCORE: &str = include_str!("../../../../docs/terms/score.md");
const THRESHOLD: &str = include_str!("../../../../docs/terms/threshold.md");
const GLOSSARY: &str = include_str!("../../../../docs/glossary.md");

/// What Akaike's criterion takes for a parameter.
const OF_AKAIKE: f64 = 2.0;

fn says(page: &str, sentence: &str) {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words(page).contains(sentence), "no page says: {sentence}");
}

#[test]
fn a_parameter_s_price_is_the_one_in_use() {
    let taken = format!("less {PRICE} for each of its parameters");
    for page in [THEORY, SCORE] {
        says(page, &taken);
    }
    says(
        THEORY,
        &format!("Akaike's criterion takes {OF_AKAIKE} for each"),
    );
    assert_eq!(PRICE / OF_AKAIKE, 3.0);
    says(THEORY, "the price is three times AIC's");
}

#[test]
fn the_null_ensemble_has_as_many_mirrors_as_are_drawn() {
    says(
        THEORY,
        &format!("{MEMBERS} virtual mirrors with nothing missing"),
    );
    says(
        GLOSSARY,
        &format!("the {MEMBERS} virtual mirrors with nothing missing"),
    );
    says(
        THRESHOLD,
        &format!("on {MEMBERS} virtual mirrors that lack nothing"),
    );
}

#[test]
fn a_threshold_is_as_far_up_as_is_told() {
    says(
        THEORY,
        &format!("must exceed it by {MARGIN} standard deviations"),
    );
    says(THEORY, &format!("No score below {FLOOR}"));
    says(THRESHOLD, &format!("is {FLOOR} at least"));
}
