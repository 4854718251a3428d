use super::*;
use crate::calibration::tests::parts;
use proptest::prelude::*;

/// What the filter reads of a heater in a room so much warmer, whose loss has grown: the balance of its heat, solved by
/// halving, and not the filter's first order.
fn evidence(rise_k: f64, room: f64, loss: f64) -> Evidence {
    let g = f64::from(parts().actuators[0].loss_growth.0);
    let heating = rise_k * (1.0 + g * rise_k);
    // What flows off between two temperatures is the integral of a conductance that grows.
    let law = |kelvin: f64| kelvin * (1.0 + g * kelvin);
    let flows = |heater: f64| (1.0 + loss) * (law(heater) - law(room));
    let (mut low, mut high) = (-100.0, 250.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if flows(middle) < heating {
            low = middle;
        } else {
            high = middle;
        }
    }
    Evidence {
        sensed: Kelvin(low as f32),
        rise: Kelvin(rise_k as f32),
        unsettled: Kelvin(0.0),
        current: Ampere(5e-3),
    }
}

/// So many updates with the readings of all four.
fn follow(filter: &mut Surroundings, evidence: &Evidence, updates: usize) {
    for _ in 0..updates {
        for actuator in 0..CHANNELS {
            filter.read(actuator, evidence);
        }
        filter.update();
    }
}

fn filter() -> Surroundings {
    Surroundings::new(&parts())
}

#[test]
fn room_and_loss_are_told_apart_by_two_drives_and_not_by_one() {
    let mut filter = filter();
    follow(&mut filter, &evidence(60.0, 8.0, 0.1), 300);
    let one = *filter.estimate().expect("known");
    // 0.1 of 67 K may be the room's as well.
    assert!(one.rise_deviation.0 > 3.0, "{one:?}");
    for _ in 0..3 {
        for rise in [20.0, 100.0] {
            follow(&mut filter, &evidence(rise, 8.0, 0.1), 300);
        }
    }
    let both = *filter.estimate().expect("known");
    // Two orders leave a percent of either.
    assert!((both.rise.0 - 8.0).abs() < 0.3, "{both:?}");
    assert!((both.loss - 0.1).abs() < 0.015, "{both:?}");
    assert!(both.rise_deviation.0 < 0.5, "{both:?}");
}

#[test]
fn nothing_read_leaves_the_estimate_and_not_its_certainty() {
    let mut filter = filter();
    follow(&mut filter, &evidence(60.0, 5.0, 0.0), 300);
    follow(&mut filter, &evidence(10.0, 5.0, 0.0), 300);
    let before = *filter.estimate().expect("known");
    let minute_ticks = 60_000;
    for _ in 0..10 {
        filter.rest(minute_ticks);
    }
    let after = *filter.estimate().expect("known");
    assert_eq!(before.rise, after.rise);
    assert!(after.rise_deviation.0 > 0.2 + before.rise_deviation.0 * 0.5);
}

#[test]
fn one_glitch_is_no_jump_and_a_jump_is_followed() {
    let mut filter = filter();
    follow(&mut filter, &evidence(60.0, 0.0, 0.0), 300);
    follow(&mut filter, &evidence(10.0, 0.0, 0.0), 300);
    let before = filter.estimate().copied();
    follow(&mut filter, &evidence(10.0, 20.0, 0.0), 1);
    assert!((filter.estimate().expect("known").rise.0).abs() < 0.1);
    follow(&mut filter, &evidence(10.0, 0.0, 0.0), 1);
    assert!(filter.estimate().expect("known").rise.0 - before.expect("known").rise.0 < 0.1);
    // 10 updates are 16 ms.
    follow(&mut filter, &evidence(10.0, 20.0, 0.0), 10);
    assert!((filter.estimate().expect("known").rise.0 - 20.0).abs() < 1.0);
}

#[test]
fn a_calibration_that_does_not_know_the_resistances_tells_nothing() {
    let mut filter = Surroundings::new(&Parts {
        ambient_ratio: 0.0,
        ..parts()
    });
    follow(&mut filter, &evidence(60.0, 20.0, 0.0), 300);
    assert_eq!(filter.estimate(), None);
    assert_eq!(filter.target(0, Kelvin(50.0)), Kelvin(50.0));
}

proptest! {
    /// What the stages are asked for is what holds the bend, to first order in room and loss.
    #[test]
    fn the_target_holds_the_bend(rise in 25.0_f64..100.0, room in -10.0_f64..10.0, loss in -0.1_f64..0.1) {
        let mut filter = filter();
        filter.room = room as f32;
        filter.loss = loss as f32;
        filter.update();
        let mut target = filter.target(0, Kelvin(rise as f32));
        for _ in 0..3 {
            filter.follow(0, Kelvin(rise as f32));
            target = filter.target(0, Kelvin(rise as f32));
        }
        let held = evidence(f64::from(target.0), room, loss);
        let bends = f64::from(held.sensed.0) + (f64::from(filter.ratio) - 1.0) * room;
        prop_assert!((bends - rise).abs() < 0.02 * rise, "{bends} for {rise}");
    }

    #[test]
    fn any_reading_leaves_finite_numbers(sensed: u32, rise: u32, unsettled: u32, current: u32, ticks in 1_usize..50) {
        let any = Evidence {
            sensed: Kelvin(f32::from_bits(sensed)),
            rise: Kelvin(f32::from_bits(rise)),
            unsettled: Kelvin(f32::from_bits(unsettled)),
            current: Ampere(f32::from_bits(current)),
        };
        let mut filter = filter();
        follow(&mut filter, &any, ticks);
        follow(&mut filter, &evidence(40.0, 3.0, 0.0), 20);
        follow(&mut filter, &any, ticks);
        let estimate = *filter.estimate().expect("known");
        prop_assert!(estimate.rise.0.abs() <= 1.01 * FARTHEST.0);
        prop_assert!(estimate.loss.abs() <= LARGEST_LOSS);
        prop_assert!(estimate.rise_deviation.0 >= 0.0 && estimate.loss_deviation >= 0.0);
        for actuator in 0..CHANNELS {
            filter.follow(actuator, Kelvin(50.0));
            prop_assert!(filter.target(actuator, Kelvin(50.0)).0.is_finite());
        }
    }
}
