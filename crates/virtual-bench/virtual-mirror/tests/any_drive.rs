//! No drive, whatever its bits, makes a mirror answer with something that is not a number.

use proptest::prelude::*;
use virtual_mirror::{Effect, Family, MirrorConfig, Sensor, State, VirtualMirror};

fn all_finite(state: &State) -> bool {
    let scalars = [
        state.z_um,
        state.tilt_x_deg,
        state.tilt_y_deg,
        state.hottest_k,
    ];
    let per_actuator = state.current_a.iter().chain(&state.heater_mean_k);
    scalars.iter().chain(per_actuator).all(|x| x.is_finite())
}

fn any_bits() -> impl Strategy<Value = f64> {
    prop_oneof![any::<u64>().prop_map(f64::from_bits), -10.0..10.0f64]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, failure_persistence: None, ..Default::default() })]

    #[test]
    fn any_bits_of_drive_and_duration(
        rows in prop::collection::vec((prop::array::uniform4(any_bits()), any_bits(), any::<bool>()), 1..12)
    ) {
        let mut mirror = VirtualMirror::new(&MirrorConfig::bench()).expect("valid mirror");
        for (drive, duration, ramp) in rows {
            if ramp {
                mirror.advance_ramp(drive, duration);
            } else {
                mirror.advance(drive, duration);
            }
            prop_assert!(all_finite(&mirror.state()), "{:?}", mirror.state());
        }
    }

    #[test]
    fn any_ticks_stay_between_cold_and_the_rails_heat(
        volts in prop::collection::vec(prop::array::uniform4(any_bits()), 1..200)
    ) {
        let config = MirrorConfig::bench();
        let mut hot = VirtualMirror::new(&config).expect("valid mirror");
        hot.advance([config.drive_limit_v; 4], 100.0);
        let ceiling = hot.state().hottest_k * 1.001;
        let mut mirror = VirtualMirror::new(&config).expect("valid mirror");
        for drive in volts {
            mirror.step(drive, 100e-6);
            let state = mirror.state();
            prop_assert!(all_finite(&state));
            prop_assert!(state.hottest_k <= ceiling);
            prop_assert!(state.heater_mean_k.iter().all(|&kelvin| kelvin >= -0.05), "{state:?}");
        }
    }

    #[test]
    fn any_family_with_any_effects_at_any_strength(
        family in 0..Family::ALL.len(),
        seed: u64,
        strengths in prop::collection::vec((0..Effect::ALL.len(), 0.0..10.0f64), 0..5),
        drives in prop::collection::vec((prop::array::uniform4(any_bits()), 1e-5..3.0f64), 1..8)
    ) {
        let drawn = MirrorConfig::draw(Family::ALL[family], seed);
        let config = strengths.into_iter().fold(drawn, |config, (effect, strength)| {
            config.with_effect(Effect::ALL[effect], strength)
        });
        let mut mirror = VirtualMirror::new(&config).expect("valid mirror");
        let mut sensor = Sensor::new(&config);
        for (drive, seconds) in drives {
            mirror.advance(drive, seconds);
            prop_assert!(all_finite(&mirror.state()), "{:?} {:?}", config.effects, mirror.state());
            prop_assert!(sensor.read(&mirror.state(), seconds).z_um.is_finite());
        }
    }
}
