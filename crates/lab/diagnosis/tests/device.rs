//! What a model file states of the mirror narrows what a diagnosis takes for possible, and stays in the file.

use diagnosis::{Asked, Diagnosis, ExpectedGain, Means, add, diagnose, diagnose_with_gains};
use experiments::Experiment;
use identification::{Dataset, fit_and_report};
use mirror_model::effect::find;
use mirror_model::{Model, Preset};
use std::path::Path;
use virtual_mirror::{Effect, Family, MirrorConfig};
use virtual_sessions::{Instruments, measure};

const KNOWN: &str = r#"
format = 1
preset = "paper"
[device]
leads = { value = 2.0, unit = "ohm", tolerance = 2.0, source = "four-wire measurement" }
rest_height = { value = 10.0, unit = "um", tolerance = 10.0, source = "microscope" }
"#;

fn session() -> Dataset {
    let mut config = MirrorConfig::draw(Family::G, 83);
    config.effects.set(Effect::Softening, 1.0);
    let sweep = vec![Experiment::sweep(3.5, 10, 1.0, 1)];
    let session = measure(&config, &sweep, Instruments::PositionAndCurrents);
    Dataset::new(&session.expect("a possible mirror"))
}

fn diagnosed(model: &Model, data: &Dataset, cache: &Path) -> Diagnosis {
    diagnose(model, data, &[], Some(cache)).expect("finite")
}

#[test]
fn what_is_known_lowers_the_discrepancy_and_stays_in_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let data = session();
    let known = Model::parse("known.toml", KNOWN).expect("readable");
    let [open, narrowed] =
        [&Model::from(Preset::Paper), &known].map(|model| diagnosed(model, &data, folder.path()));
    // Curls of up to 300 um are most of what the beams of a mirror leave of which nothing is known.
    let sizes = [&open, &narrowed].map(|found| found.discrepancy_rms.value);
    assert!(sizes[1] < sizes[0], "{sizes:?}");
    let curl = |found: &Diagnosis| {
        let ranked = found.ranking.iter().find(|r| r.effect == "initial-curl");
        ranked
            .and_then(|curl| curl.detection_limit)
            .unwrap_or(f64::INFINITY)
    };
    assert!(curl(&narrowed) < curl(&open), "{open}\n{narrowed}");

    let (fitted, _) = fit_and_report(&known, &data, &["sweep.csv".into()]).expect("finite");
    let softening = find("softening").expect("built in");
    let added = add(&known, softening, &data, &[], Some(folder.path()))
        .expect("finite")
        .after;
    for model in [fitted, added] {
        let again = Model::parse("again.toml", &model.to_toml()).expect("readable");
        assert_eq!(again.device, known.device);
    }
}

#[test]
fn what_is_not_stated_is_worth_what_it_would_show() {
    const ALL_BUT_LEADS_AND_BEAM: &str = r#"
format = 1
preset = "paper"
[device]
rest_height = { value = 10.0, unit = "um", tolerance = 10.0, source = "microscope" }
plate_side = { value = 700.0, unit = "um", tolerance = 70.0, source = "drawing" }
plate_thickness = { value = 150.0, unit = "um", tolerance = 50.0, source = "drawing" }
"#;
    let folder = tempfile::tempdir().expect("a folder");
    let cache = Some(folder.path());
    let nothing = MirrorConfig::draw(Family::G, 83);
    let sweep = vec![Experiment::sweep(3.5, 10, 1.0, 1)];
    let session = measure(&nothing, &sweep, Instruments::PositionAndCurrents);
    let data = Dataset::new(&session.expect("a possible mirror"));
    let model = Model::parse("known.toml", ALL_BUT_LEADS_AND_BEAM).expect("readable");
    let asked = Asked {
        facts: true,
        ..Asked::default()
    };
    let (found, gains) = diagnose_with_gains(&model, &data, &[], cache, asked).expect("finite");
    assert!(gains.measurements.is_none(), "nobody asked");
    let gains = gains.facts.expect("they were asked for");
    let alone = diagnosed(&model, &data, folder.path());
    assert_eq!(
        format!("{found:?}"),
        format!("{alone:?}"),
        "the same verdict"
    );
    let key = |worth: &ExpectedGain| match &worth.means {
        Means::Fact(key) => key.clone(),
        Means::Measurement(_) => panic!("{worth:?}"),
    };
    let mut keys: Vec<_> = gains.iter().map(key).collect();
    keys.sort_unstable();
    assert_eq!(keys, ["leads", "segments"], "of what is not stated");
    for pair in gains.windows(2) {
        let [gain, next] = [0, 1].map(|at| pair[at].right.then - pair[at].right.now);
        assert!(gain >= next, "{gains:?}");
    }
    // Who knows the leads sees a resistance that is not theirs. A layout shows in the fitted parameters.
    let shown_by = |wanted: &str| {
        let of_key = gains.iter().find(|worth| key(worth) == wanted);
        let shows = of_key.map_or(&[][..], |worth| &worth.shows);
        shows
            .iter()
            .map(|shown| shown.effect.as_str())
            .collect::<Vec<_>>()
    };
    assert!(
        shown_by("leads").contains(&"series-resistance"),
        "{gains:?}"
    );
    for shown in gains.iter().flat_map(|worth| &worth.shows) {
        let ranked = found.ranking.iter().find(|r| r.effect == shown.effect);
        let now = ranked.and_then(|r| r.detection_limit);
        assert_eq!(now, shown.now, "as the verdict has it");
        assert!(now.is_none_or(|now| shown.then < now), "{shown:?}");
    }
}
