//! A plate that rings below the family's lowest resonance, as a heavy one on long beams does.

use diagnosis::{Verdict, diagnose};
use identification::Dataset;
use mirror_model::{Model, Preset};
use shared_cache::null_ensembles;
use virtual_mirror::{Family, MirrorConfig, MotionConfig};
use virtual_sessions::{Instruments, measure};

#[test]
#[ignore = "long"]
fn plates_of_80_and_150_hz_are_named_with_their_frequencies() {
    for (seed, piston_hz, q) in [(871, 80.0, 4.0), (872, 150.0, 1.5)] {
        let mut config = MirrorConfig::draw(Family::F, seed);
        config.motion = Some(MotionConfig {
            piston_hz,
            tilt_hz: 1.3 * piston_hz,
            q,
        });
        let drives = experiments::session(3.5);
        let session = measure(&config, &drives, Instruments::PositionAndCurrents);
        let data = Dataset::new(&session.expect("a possible mirror"));
        let cache = null_ensembles();
        let model = Model::from(Preset::Paper);
        let found = diagnose(&model, &data, &[], cache.as_deref()).expect("a finite answer");
        assert_eq!(found.verdict, Verdict::Named, "{found}");
        assert_eq!(found.effects, ["resonance"], "{found}");
        let said_hz = found.ranking[0].parameters["f"].value;
        // A tenth of its width.
        let off = (said_hz / piston_hz - 1.0).abs();
        assert!(off < 0.1 / q, "{found}");
    }
}
