//! A session gets the same diagnosis, digit by digit, whatever was diagnosed before it.

use diagnosis::diagnose;
use experiments::Experiment;
use identification::Dataset;
use mirror_model::{Model, Preset};
use virtual_mirror::{Effect, Family, MirrorConfig};
use virtual_sessions::{Instruments, measure};

fn measured(family: Family, noise_nm: f64, hidden: Option<Effect>) -> Dataset {
    let mut config = MirrorConfig::draw(family, 57);
    config.sensor.position_noise_nm = noise_nm;
    if let Some(effect) = hidden {
        config.effects.set(effect, 1.0);
    }
    let experiments = vec![
        Experiment::sweep(3.5, 10, 1.0, 1),
        Experiment::single(3.5, 3, 1.0).after(5.0),
    ];
    let session = measure(&config, &experiments, Instruments::PositionAndCurrents);
    Dataset::new(&session.expect("a possible mirror"))
}

#[test]
fn a_diagnosis_does_not_depend_on_what_was_diagnosed_before() {
    let paper = Model::from(Preset::Paper);
    // One kind of session, other readings and another noise.
    let before = measured(Family::F, 5.0, None);
    let session = measured(Family::G, 25.0, Some(Effect::Softening));
    let folder = tempfile::tempdir().expect("a folder");
    let said = |data: &Dataset, cache| {
        let found = diagnose(&paper, data, &[], cache).expect("finite");
        format!("{found:?}")
    };
    let alone = said(&session, None);
    said(&before, Some(folder.path()));
    let after_another = said(&session, Some(folder.path()));
    assert_eq!(alone, after_another);
    let kept = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(kept, 1, "both sessions share an ensemble");
}
