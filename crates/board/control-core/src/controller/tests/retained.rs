use super::*;
use crate::controller::Retained;
use crate::design::UNDRIVEN_TICKS;

/// A controller that went up and rested, and one that was reset then, both without drive for the ticks of a start.
fn reset(is_recalled: bool) -> [Controller<'static>; 2] {
    let calibration = || Box::leak(Box::new(Calibration::new(parts()).expect("good")));
    let [mut before, mut anew] = [(); 2].map(|()| Controller::new(calibration()));
    for z_um in [150.0, 60.0] {
        for _ in 0..50_000 {
            let there = Setpoint::position(Micrometre(z_um));
            before.step(there, NOTHING.0, NOTHING.1);
        }
    }
    let kept = core::array::from_fn(|actuator| {
        let words = before.retained(actuator).to_words();
        Retained::from_words(&words).expect("a mirror's")
    });
    for _ in 0..UNDRIVEN_TICKS {
        before.step(Setpoint::Off, NOTHING.0, NOTHING.1);
    }
    if is_recalled {
        anew.recall(&kept);
    }
    [before, anew]
}

/// How far apart the drives of both take the mirror (V), a while after both were sent somewhere.
fn apart_v([before, anew]: &mut [Controller<'static>; 2]) -> f32 {
    let there = Setpoint::position(Micrometre(90.0));
    let mut apart = 0.0;
    for tick in 0..2_000 {
        let [one, other] = [&mut *before, &mut *anew]
            .map(|controller| controller.step(there, NOTHING.0, NOTHING.1).drives);
        let drives = one.iter().zip(other);
        if tick == 1_999 {
            apart = drives.fold(0.0_f32, |most, (a, b)| most.max((a.0 - b.0).abs()));
        }
    }
    apart
}

#[test]
fn a_controller_that_was_reset_goes_on_as_if_it_had_not_been() {
    // 1 um is some 10 mV there: 0.01 um of a turn of each slow lag, which is not kept, and 5 um of heat and memory that are forgotten.
    let (recalled, forgotten) = (apart_v(&mut reset(true)), apart_v(&mut reset(false)));
    assert!(
        recalled < 1e-4 && forgotten > 50e-3,
        "{recalled} and {forgotten}"
    );
}

#[test]
fn a_controller_at_rest_retains_nothing() {
    let calibration = Box::leak(Box::new(Calibration::new(parts()).expect("good")));
    let words = Controller::new(calibration).retained(0).to_words();
    assert_eq!(words, [0; Retained::WORDS]);
}

proptest! {
    /// Whatever memory holds, the drive that follows is a number within the bounds.
    #[test]
    fn whatever_is_recalled_is_answered(
        words in proptest::collection::vec(any::<u32>(), Retained::WORDS),
        values in proptest::collection::vec(-2e4_f32..2e4, Retained::WORDS),
    ) {
        for words in [words, values.into_iter().map(f32::to_bits).collect()] {
            let words: [u32; Retained::WORDS] = words.try_into().expect("as many");
            let Some(retained) = Retained::from_words(&words) else {
                continue;
            };
            prop_assert_eq!(retained.to_words(), words);
            let mut calibration = Calibration::new(parts()).expect("good");
            let highest = calibration.parts().bounds.drive;
            let mut controller = Controller::new(&mut calibration);
            controller.recall(&[retained; CHANNELS]);
            for tick in 0..200 {
                let there = Setpoint::position(Micrometre(tick as f32));
                let drives = controller.step(there, NOTHING.0, NOTHING.1).drives;
                prop_assert!(drives.iter().all(|drive| (0.0..=highest.0).contains(&drive.0)));
            }
        }
    }
}
