//! Measurements that a board and its bench can make, each with what it would read.

use crate::proposal::Proposal;
use experiments::instruments::{CURRENT_NOISE_A, POSITION_NOISE_UM};
use experiments::{Experiment, Measurement, OVEN_K, SETTLING_S};
use identification::dataset::{Channel, Dataset, Observation, OwnZero};
use mirror_model::{ACTUATORS, Interval};
use std::ops::Range;

/// Frequencies of the sines that take the place of a chirp (Hz): through the resonances of such mirrors.
const CHIRP_HZ: [f64; 3] = [200.0, 500.0, 1000.0];
/// Slow enough for all heat to settle on the way (Hz): a cycle is five of the slowest time constants that are known.
const SLOW_HZ: f64 = 0.01;
/// Cycles of a sine: the first brings the mirror onto its loop, and two show whether it stays on it.
const CYCLES: u32 = 3;

/// The room where a session does not say how warm it was (degC): an air-conditioned laboratory's.
pub(crate) const ROOM_C: f64 = 22.0;
/// What the session is called that is made once more for the currents' sake.
const WITH_CURRENTS: &str = "with-currents";
/// How much warmer another room is (K): 35 degC, a cabinet without its fan.
const OTHER_ROOM_K: f64 = 13.0;

/// Every measurement that a diagnosis may propose for drives up to `top_v`.
pub fn proposals(top_v: f64) -> Vec<Proposal> {
    let on_the_board = menu(top_v).into_iter();
    let with_currents = with_currents(&Dataset::default(), top_v);
    on_the_board
        .chain([with_currents])
        .chain(beside(top_v, ROOM_C))
        .map(|offer| offer.proposal)
        .collect()
}

/// All that can be measured after a session.
pub(crate) fn offers(session: &Dataset) -> Vec<Offer> {
    let top_v = highest_drive_v(session);
    let mut offers = menu(top_v);
    if !session.has_current() {
        offers.push(with_currents(session, top_v));
    }
    offers.extend(beside(top_v, session.first_ambient_c.unwrap_or(ROOM_C)));
    offers
}

/// The highest drive of a session (V).
pub(crate) fn highest_drive_v(session: &Dataset) -> f64 {
    let drives = session.intervals.iter().flat_map(|interval| interval.to_v);
    drives.fold(0.0, f64::max)
}

/// The noise of a session's displacements (um), or a usual one.
pub(crate) fn position_noise_um(session: &Dataset) -> f64 {
    let mut observations = session.observations.iter();
    let displacement = observations.find(|o| o.channel == Channel::Displacement);
    displacement.map_or(POSITION_NOISE_UM, |o| o.noise)
}

/// A measurement that the board, or its bench, can make.
pub(crate) struct Offer {
    pub(crate) proposal: Proposal,
    pub(crate) what: &'static str,
    pub(crate) intervals: Vec<Interval>,
    /// The intervals at whose ends it is read.
    pub(crate) readings: Vec<usize>,
    /// The first interval in which something else than the board moves the mirror too: on a clock of its own, after a sweep
    /// that a session has already.
    apart: Option<usize>,
}

/// What the board can be made to drive, up to `top_v`.
pub(crate) fn menu(top_v: f64) -> Vec<Offer> {
    let volts = |share: f64| (1e3 * share * top_v).round() / 1e3;
    let sine = |frequency_hz: f64| Measurement::Sine {
        mean_v: volts(0.5),
        amplitude_v: volts(0.2),
        frequency_hz,
        cycles: CYCLES,
    };
    let step = |share: f64, hold_s: f64, rate_hz: f64| Measurement::Step {
        to_v: volts(share),
        hold_s,
        rate_hz,
    };
    let single = Measurement::Single {
        max_v: top_v,
        steps: 7,
        dwell_s: 1.0,
    };
    let twice = Measurement::Sweep {
        max_v: top_v,
        steps: 35,
        dwell_s: 1.0,
        cycles: 2,
    };
    let offers = [
        (single, "heat one actuator and sense an idle one"),
        (step(0.7, 60.0, 5e3), "hold a step for a minute, then rest"),
        (step(0.6, 1.0, 1e4), "sample a step fast"),
        (twice, "repeat the sweep"),
        (
            sine(SLOW_HZ),
            "minor loops, slow enough for all heat to settle",
        ),
    ];
    let chirp = CHIRP_HZ.map(|hz| (sine(hz), "a fast sine, one frequency of a chirp"));
    offers
        .into_iter()
        .chain(chirp)
        .map(|(measurement, what)| Offer::new(measurement, what))
        .collect()
}

/// What no drive does: on the bench, after a sweep up to `top_v` in surroundings at `first_c`.
pub(crate) fn beside(top_v: f64, first_c: f64) -> [Offer; 3] {
    let warmer = |measurement: Measurement, rise_k: f64, name, what| {
        let ambient_c = Some((first_c + rise_k).round());
        Offer::new(measurement, what)
            .after_a_sweep(top_v, rise_k)
            .asked_as(name, ambient_c)
    };
    [
        Offer::new(
            Measurement::reference(),
            "reference steps of the sensor's target on a stage, at rest",
        )
        .after_a_sweep(top_v, 0.0)
        .asked_as("reference", None),
        warmer(
            Measurement::sweep(top_v),
            OTHER_ROOM_K,
            "warmer",
            "a sweep with the room at another, known temperature",
        ),
        warmer(
            Measurement::COLD_SWEEP,
            OVEN_K[1],
            "oven",
            "an oven at a known temperature with the heaters next to off",
        ),
    ]
}

/// The session once more, with the currents that were not measured.
pub(crate) fn with_currents(session: &Dataset, top_v: f64) -> Offer {
    let again = Offer {
        intervals: session.intervals.clone(),
        readings: (0..session.intervals.len()).collect(),
        ..Offer::new(
            Measurement::Session { max_v: top_v },
            "measure the currents, too: the resistance is a thermometer",
        )
    };
    again.asked_as(WITH_CURRENTS, None)
}

impl Offer {
    fn new(measurement: Measurement, what: &'static str) -> Self {
        let (mut intervals, mut readings) = (Vec::new(), Vec::new());
        for experiment in measurement.experiments() {
            add(&experiment, &mut intervals, &mut readings);
        }
        Self {
            proposal: Proposal {
                measurement,
                ambient_c: None,
                name: None,
            },
            what,
            intervals,
            readings,
            apart: None,
        }
    }

    /// The same after a sweep, and in surroundings that are so much warmer from then on.
    fn after_a_sweep(mut self, top_v: f64, rise_k: f64) -> Self {
        let settling = Interval::held([0.0; ACTUATORS], SETTLING_S);
        let sweep = Self::new(Measurement::sweep(top_v), "");
        let before = sweep.intervals.len();
        self.intervals.insert(0, settling);
        for interval in &mut self.intervals {
            interval.ambient_k = rise_k;
        }
        self.intervals.splice(0..0, sweep.intervals);
        let later = self.readings.iter().map(|reading| before + 1 + reading);
        self.readings = sweep.readings.into_iter().chain(later).collect();
        self.apart = Some(before);
        self
    }

    fn asked_as(mut self, name: &'static str, ambient_c: Option<f64>) -> Self {
        self.proposal.name = Some(name);
        self.proposal.ambient_c = ambient_c;
        self
    }

    /// What it would read: displacement and currents.
    pub(crate) fn plan(&self, noise_um: f64) -> Dataset {
        let mut plan = Dataset {
            experiments: vec!["sweep".into()],
            ..Dataset::default()
        };
        let apart = self.apart.unwrap_or(0);
        self.add_part(&mut plan, 0..apart, 0, noise_um, true);
        plan.experiments.push(self.what.into());
        let end = self.intervals.len();
        self.add_part(
            &mut plan,
            apart..end,
            usize::from(apart > 0),
            noise_um,
            true,
        );
        let own_zero = self.apart.map(|_| OwnZero::new(1..2, &plan.observations));
        plan.own_zeros.extend(own_zero);
        plan
    }

    /// A session that goes on with it after a rest, every new reading 0, and how many readings the session has itself. It is
    /// read by what the session was read by, unless it is made for the currents' sake.
    pub(crate) fn after(&self, session: &Dataset) -> (Dataset, usize) {
        let mut longer = session.clone();
        let experiment = longer.experiments.len();
        longer.experiments.push(self.what.into());
        if self.apart.is_none() {
            let rest = Interval::held([0.0; ACTUATORS], SETTLING_S);
            longer.intervals.push(rest);
        }
        let new = self.apart.unwrap_or(0)..self.intervals.len();
        let with_currents = session.has_current() || self.proposal.name == Some(WITH_CURRENTS);
        let noise_um = position_noise_um(session);
        self.add_part(&mut longer, new, experiment, noise_um, with_currents);
        if self.apart.is_some() {
            let own_zero = OwnZero::new(experiment..experiment + 1, &longer.observations);
            longer.own_zeros.push(own_zero);
        }
        (longer, session.observations.len())
    }

    /// Adds these of its intervals to a session, and what is read at the ends of them.
    fn add_part(
        &self,
        plan: &mut Dataset,
        part: Range<usize>,
        experiment: usize,
        noise_um: f64,
        with_currents: bool,
    ) {
        let mut t_s: f64 = plan.intervals.iter().map(|i| i.duration_s).sum();
        for index in part {
            let interval = self.intervals[index];
            t_s += interval.duration_s;
            plan.intervals.push(interval);
            if self.readings.binary_search(&index).is_err() {
                continue;
            }
            let observation = |channel, noise| Observation {
                interval: plan.intervals.len() - 1,
                channel,
                value: 0.0,
                noise,
                experiment,
                t_s,
            };
            let displacement = observation(Channel::Displacement, noise_um);
            plan.observations.push(displacement);
            let currents = (0..ACTUATORS).filter(|_| with_currents);
            let currents =
                currents.map(|actuator| observation(Channel::Current(actuator), CURRENT_NOISE_A));
            plan.observations.extend(currents);
        }
    }
}

/// Adds what drives a mirror in an experiment, and which of it is read.
fn add(experiment: &Experiment, intervals: &mut Vec<Interval>, readings: &mut Vec<usize>) {
    let hold = |volts: f64, seconds: f64, intervals: &mut Vec<Interval>| {
        if seconds > 0.0 {
            intervals.push(Interval::held([volts; ACTUATORS], seconds));
        }
    };
    hold(0.0, experiment.rest_s, intervals);
    if let Some(prehold) = experiment.prehold {
        hold(prehold.volts, prehold.seconds, intervals);
    }
    for dwell in experiment.dwells().expect("drives") {
        hold(0.0, dwell.rest_s, intervals);
        readings.push(intervals.len());
        intervals.push(Interval {
            duration_s: dwell.duration_s,
            from_v: dwell.from_v,
            to_v: dwell.to_v,
            reference_um: dwell.stage_um,
            ..Interval::default()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is offered, by its words.
    fn offer(what: &str) -> Offer {
        let mut all = menu(3.5).into_iter().chain(beside(3.5, 22.0));
        all.find(|offer| offer.what.contains(what))
            .expect("offered")
    }

    #[test]
    fn the_mean_of_a_sine_is_held_before_it_and_not_read() {
        let sine = offer("chirp");
        assert_eq!(sine.intervals[0], Interval::held([1.75; ACTUATORS], 5.0));
        assert_eq!(sine.readings, (1..=300).collect::<Vec<_>>());
    }

    #[test]
    fn an_actuator_alone_is_read_at_each_step_and_not_at_rest() {
        let single = offer("idle");
        let rests = |i: &usize| single.intervals[*i].to_v == [0.0; ACTUATORS];
        // Eight steps of each, and three rests in between.
        assert_eq!((single.readings.len(), single.intervals.len()), (32, 35));
        assert!(!single.readings.iter().any(rests));
    }

    #[test]
    fn an_oven_is_warm_after_the_sweep_and_read_on_a_clock_of_its_own() {
        let oven = offer("oven");
        let apart = oven.apart.expect("another clock");
        assert_eq!(apart, 71);
        let ambient: Vec<f64> = oven.intervals.iter().map(|i| i.ambient_k).collect();
        assert!(ambient[..apart].iter().all(|k| *k == 0.0));
        assert!(ambient[apart..].iter().all(|k| *k == 40.0));
        let plan = oven.plan(0.02);
        let later = plan.observations.iter().filter(|o| o.experiment == 1);
        // 17 steps up and down, a displacement and four currents at each.
        assert_eq!(later.count(), 17 * 5);
        assert_eq!(oven.proposal.ambient_c, Some(62.0));
    }

    #[test]
    fn a_session_goes_on_with_what_it_is_read_by() {
        let session = offer("repeat").plan(0.05);
        let read = session.observations.len();
        for (what, own_zeros) in [("idle", 0), ("oven", 1)] {
            let (longer, before) = offer(what).after(&session);
            assert_eq!(before, read);
            assert_eq!(longer.own_zeros.len(), own_zeros, "{what}");
            let new = &longer.observations[read..];
            let displacements = new.iter().filter(|o| o.channel == Channel::Displacement);
            assert!(displacements.clone().all(|o| o.noise == 0.05), "{what}");
            assert_eq!(displacements.count() * (1 + ACTUATORS), new.len());
            assert_eq!(new[0].experiment, session.experiments.len());
            let warm: Vec<f64> = longer.intervals.iter().map(|i| i.ambient_k).collect();
            let of_session = session.intervals.len();
            assert!(warm[..of_session].iter().all(|k| *k == 0.0));
            assert_eq!(warm[of_session] > 0.0, own_zeros == 1, "{what}");
        }
    }

    #[test]
    fn a_session_of_positions_goes_on_with_positions_but_for_the_currents_sake() {
        let mut session = offer("repeat").plan(0.05);
        session
            .observations
            .retain(|o| o.channel == Channel::Displacement);
        for offer in offers(&session) {
            let (longer, _) = offer.after(&session);
            let asks = offer.what.contains("measure the currents");
            assert_eq!(longer.has_current(), asks, "{}", offer.what);
        }
    }
}
