//! What a right name leaves is no second name: a mirror of a family that no threshold was calibrated on, in the standard session.

use diagnosis::{Diagnosis, Verdict, add, diagnose};
use identification::Dataset;
use mirror_model::effect::find;
use mirror_model::{Model, Preset};
use shared_cache::null_ensembles;
use virtual_mirror::{Effect, Family, MirrorConfig};
use virtual_sessions::{Instruments, measure};

/// Nature's hysteresis is Dahl's, the model's first form is of play operators: beside thresholds that know nothing of a model's effects,
/// what the form leaves here scores 7000.
#[test]
#[ignore = "long"]
fn what_the_form_of_a_strong_hysteresis_leaves_is_nothing_missing() {
    let mut config = MirrorConfig::draw(Family::F, 613);
    config.effects.set(Effect::Hysteresis, 3.0);
    is_the_only_one("hysteresis", &config);
}

/// The emulated board's own mirror, whose plate rings: what the base's lumped heat leaves right after a jump makes it ring a little otherwise,
/// which was an electrostatic pull by a score of 2600.
#[test]
#[ignore = "long"]
fn what_a_plate_that_rings_makes_of_the_base_s_error_is_nothing_missing() {
    is_the_only_one("resonance", &MirrorConfig::bench());
}

/// Named in the standard session, and with it added nothing is missing.
fn is_the_only_one(id: &str, config: &MirrorConfig) {
    let session = measure(
        config,
        &experiments::session(3.5),
        Instruments::PositionAndCurrents,
    );
    let data = Dataset::new(&session.expect("a possible mirror"));
    let kept = null_ensembles();
    let diagnosed = |model: &Model| -> Diagnosis {
        diagnose(model, &data, &[], kept.as_deref()).expect("a finite answer")
    };
    let paper = Model::from(Preset::Paper);
    let first = diagnosed(&paper);
    assert_eq!(first.effects, [id], "{first}");
    let effect = find(id).expect("built in");
    let added = add(&paper, effect, &data, &[], kept.as_deref()).expect("it lowers the error");
    let second = diagnosed(&added.after);
    assert_eq!(second.verdict, Verdict::None, "{second}");
}
