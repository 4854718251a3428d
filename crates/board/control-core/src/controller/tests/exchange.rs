use super::*;

/// In the midst of a course, warm and with a history.
#[test]
fn a_calibration_that_is_exchanged_for_itself_changes_nothing() {
    let course = |exchanged_at: u32| {
        let calibration = || Box::leak(Box::new(Calibration::new(parts()).expect("good")));
        let mut controller = Controller::new(calibration());
        for tick in 0..40_000 {
            if tick == exchanged_at {
                controller.exchange(calibration());
            }
            let z = Micrometre([90.0, 20.0, 60.0, 40.0][tick as usize / 10_000]);
            controller.step(Setpoint::position(z), NOTHING.0, NOTHING.1);
        }
        (controller.step.drives, controller.budget.spans())
    };
    let ((drives, spans), (exchanged, spans_then)) = (course(u32::MAX), course(25_000));
    for (drive, other) in drives.into_iter().zip(exchanged) {
        // 1 um is some 10 mV there: a nanometre.
        assert!((drive.0 - other.0).abs() < 1e-5, "{drive:?} and {other:?}");
    }
    for ((low, high), (other_low, other_high)) in spans
        .into_iter()
        .flatten()
        .zip(spans_then.into_iter().flatten())
    {
        // A nanometre here, too.
        assert!((low - other_low).abs() + (high - other_high).abs() < 1e-3);
    }
}

/// A stage in each tick, as the firmware does it while nothing is driven.
#[test]
fn a_calibration_that_is_exchanged_stage_by_stage_changes_nothing() {
    let course = |is_exchanged: bool| {
        let calibration = || Box::leak(Box::new(Calibration::new(parts()).expect("good")));
        let mut controller = Controller::new(calibration());
        let tick = |controller: &mut Controller, setpoint| {
            controller.step(setpoint, NOTHING.0, NOTHING.1).drives
        };
        let moved = |controller: &mut Controller, z_um: f32| {
            let moved = (0..5_000).map(|_| tick(controller, Setpoint::position(Micrometre(z_um))));
            moved.last().expect("ticks")
        };
        moved(&mut controller, 90.0);
        moved(&mut controller, 40.0);
        let mut stages = 0;
        if is_exchanged {
            controller.begin_exchange(calibration());
        }
        for _ in 0..20 {
            tick(&mut controller, Setpoint::Off);
            if controller.is_exchanging() {
                controller.exchange_on();
                stages += 1;
            }
        }
        assert!(!controller.is_exchanging());
        assert_eq!(stages > 1, is_exchanged);
        moved(&mut controller, 60.0)
    };
    for (drive, exchanged) in course(false).into_iter().zip(course(true)) {
        // 1 um is some 10 mV there: 10 nm, for the creep of the ticks in which memory stands still.
        assert!(
            (drive.0 - exchanged.0).abs() < 1e-4,
            "{drive:?} and {exchanged:?}"
        );
    }
}
