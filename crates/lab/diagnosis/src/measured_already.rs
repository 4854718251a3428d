//! Whether a session holds an experiment already: the same again would tell no more.

use crate::menu::Offer;
use identification::dataset::Dataset;
use mirror_model::{ACTUATORS, Interval};

/// Drives are the same that are apart by so much of the highest (root mean square over their course): a few percent, a choice.
const ALIKE: f64 = 0.03;
/// Times at which they are compared: 66 in each cycle of the sines that are offered, several in each step of the others.
const TIMES: u32 = 200;
/// A course counts that is first read within this part of its length, or as soon as was asked to a factor of 2: a choice.
const FIRST_READ: f64 = 0.01;

/// Whether an experiment of the session drives the mirror as this one does, at least as long.
pub(crate) fn holds(session: &Dataset, offer: &Offer) -> bool {
    let Some(asked) = driven_part(&offer.intervals, &offer.readings) else {
        return false;
    };
    let soon_s = (FIRST_READ * length_s(asked)).max(2.0 * asked[0].duration_s);
    (0..session.experiments.len()).any(|experiment| {
        let of_it = session.observations.iter();
        let of_it = of_it.filter(|o| o.experiment == experiment);
        let readings: Vec<usize> = of_it.map(|o| o.interval).collect();
        driven_part(&session.intervals, &readings)
            .is_some_and(|part| part[0].duration_s <= soon_s && is_alike(asked, part))
    })
}

/// From the first driven interval that is read to the last one.
fn driven_part<'a>(intervals: &'a [Interval], readings: &[usize]) -> Option<&'a [Interval]> {
    let is_driven = |&&reading: &&usize| intervals[reading].to_v != [0.0; ACTUATORS];
    let first = readings.iter().find(is_driven)?;
    let last = readings.iter().rfind(is_driven)?;
    Some(&intervals[*first..=*last])
}

fn length_s(intervals: &[Interval]) -> f64 {
    intervals.iter().map(|interval| interval.duration_s).sum()
}

/// Whether the drives are the same for as long as those that were asked for.
fn is_alike(asked: &[Interval], driven: &[Interval]) -> bool {
    let voltages = asked.iter().flat_map(|interval| interval.to_v);
    let top_v = voltages.fold(0.0, f64::max);
    let between_s = length_s(asked) / f64::from(TIMES);
    let squares = (0..TIMES).map(|time| {
        // Between two edges rather than on one.
        let t_s = (f64::from(time) + 0.5) * between_s;
        let (asked, driven) = (drive_at(asked, t_s), drive_at(driven, t_s));
        let apart = (0..ACTUATORS).map(|i| (asked[i] - driven[i]).powi(2));
        apart.sum::<f64>() / ACTUATORS as f64
    });
    (squares.sum::<f64>() / f64::from(TIMES)).sqrt() <= ALIKE * top_v
}

/// The drives at a time since the begin of the intervals (V); after them there are none.
fn drive_at(intervals: &[Interval], mut t_s: f64) -> [f64; ACTUATORS] {
    for interval in intervals {
        if t_s < interval.duration_s {
            return interval.drive_at(t_s / interval.duration_s);
        }
        t_s -= interval.duration_s;
    }
    [0.0; ACTUATORS]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::menu::menu;
    use identification::dataset::Channel;

    #[test]
    fn each_experiment_on_the_menu_is_held_by_itself_and_by_no_other() {
        for (one, measured) in menu(3.5).iter().enumerate() {
            let session = measured.plan(0.02);
            for (other, offer) in menu(3.5).iter().enumerate() {
                let what = (measured.what, offer.what);
                assert_eq!(holds(&session, offer), one == other, "{what:?}");
            }
        }
    }

    #[test]
    fn a_hold_counts_at_that_drive_and_as_long_however_it_was_read() {
        let hold = menu(4.0).swap_remove(1);
        // Read every half second, then at rest.
        let held = |volts: f64, readings: usize| {
            let drives = (0..readings).map(|_| (volts, 0.5)).chain([(0.0, 1.0)]);
            Dataset::driven(drives).read_at_each(&[(Channel::Displacement, 0.02)])
        };
        assert!(holds(&held(2.8, 120), &hold));
        assert!(holds(&held(2.85, 400), &hold), "longer, and 2 % more");
        assert!(!holds(&held(2.8, 60), &hold), "half as long");
        assert!(!holds(&held(3.0, 120), &hold), "7 % more");
        let fast = menu(4.0).swap_remove(2);
        assert!(!holds(&held(2.4, 2), &fast), "read too late");
        assert!(!holds(&Dataset::default(), &hold));
    }
}
