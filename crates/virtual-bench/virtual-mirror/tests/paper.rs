//! The paper's mirror shows the paper's numbers.

use virtual_mirror::{Effect, MirrorConfig, PaperNumbers};

fn shown(config: &MirrorConfig) -> PaperNumbers {
    PaperNumbers::measure(config).expect("valid mirror")
}

#[test]
fn every_published_number_is_within_a_tenth() {
    let (published, shown) = (PaperNumbers::PUBLISHED, shown(&MirrorConfig::paper()));
    let mut pairs = vec![
        ("z at 3.5 V", published.z_3v5_um, shown.z_3v5_um),
        ("z at 1.9 V", published.z_1v9_um, shown.z_1v9_um),
        ("t95", published.t95_ms, shown.t95_ms),
        ("creep", published.creep_s, shown.creep_s),
        (
            "mean tilt x",
            published.tilt_x.mean_deg,
            shown.tilt_x.mean_deg,
        ),
        ("sd of tilt x", published.tilt_x.sd_deg, shown.tilt_x.sd_deg),
        (
            "mean tilt y",
            published.tilt_y.mean_deg,
            shown.tilt_y.mean_deg,
        ),
        ("sd of tilt y", published.tilt_y.sd_deg, shown.tilt_y.sd_deg),
    ];
    for (published, shown) in published.loops.iter().zip(&shown.loops) {
        pairs.push(("a loop", published.width_um, shown.width_um));
    }
    for (what, published, shown) in pairs {
        // What is published has two or three digits; the rest of the tenth is the project's choice.
        assert!(
            (shown / published - 1.0).abs() < 0.1,
            "{what}: published {published}, virtual {shown}"
        );
    }
    assert!(
        shown
            .loops
            .is_sorted_by(|slow, fast| slow.range_um > fast.range_um),
        "{:?}",
        shown.loops
    );
    // The paper shows it without a number: more than the width of its lines, 2 %, and less than half of the step.
    assert!((0.02..0.5).contains(&shown.ringing), "{}", shown.ringing);
}

#[test]
fn its_physics_switches_off_piece_by_piece() {
    let paper = MirrorConfig::paper();
    let with = shown(&paper);

    let without_creep = shown(&paper.clone().with_effect(Effect::Creep, 0.0));
    assert!(without_creep.creep_s < with.creep_s);

    let without_friction = shown(&paper.clone().with_effect(Effect::Hysteresis, 0.0));
    assert!(without_friction.loops[0].width_um < with.loops[0].width_um);

    // A loss that grows with the temperature is what takes the model's 222 um down to 174: more than a tenth.
    let linear_loss = shown(&paper.clone().with_effect(Effect::HeatLossTemperature, 0.0));
    assert!(linear_loss.z_3v5_um > 1.1 * with.z_3v5_um);

    let mut cold_package = paper.clone();
    cold_package.frame = None;
    // Beams and plate follow within a tenth of a second, the package in half a one.
    assert!(shown(&cold_package).t95_ms < 0.2 * with.t95_ms);

    let mut still = paper.clone();
    still.motion = None;
    // Rounding.
    assert!(shown(&still).ringing < 1e-6);

    let mut alike = paper;
    alike.trim = Default::default();
    // Rounding.
    assert!(shown(&alike).tilt_x.sd_deg < 1e-9);
}
