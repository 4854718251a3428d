//! What a null ensemble depends on, and nothing else: a session's drives, surroundings and channels, how noisy each reading is,
//! roughly, and what is known of the mirror.
//!
//! The ensemble is computed from [`Conditions`] alone, and its key is the hash of all that is in them. So a session has the
//! same ensemble whether another session of the same kind left it in the cache or nobody did.

use super::drive_scaling::DriveScaling;
use identification::dataset::{Channel, Dataset, Observation};
use mirror_model::device::{Fact, Quantity, Segment};
use mirror_model::{ACTUATORS, Device, Interval};
use sha2::{Digest, Sha256};

/// Noise of a displacement below this is taken for this (um): a quarter of the 0.1 um that lumped equations cannot follow, it changes
/// the weights of the fits by 3 %.
const LEAST_NOISE_UM: f64 = 0.025;

/// After a rest of so long (s) a mirror that lacks nothing has forgotten what it was driven with, but for 10 nm in the slowest of the
/// ensemble's, whose last time constant is 2.5 s: `a_rest_is_a_rest_whatever_is_held`. The sensor's wander, 20 nm over half a minute, remembers
/// no drive; that it counts as another one after such a rest leaves the ensemble a little wider than the session's.
pub(super) const FORGOTTEN_S: f64 = 4.0;
/// Such a rest is as long as between files that share no clock (s).
pub(super) const REST_S: f64 = 60.0;
/// Two clocks may be apart by this part: a rest of a second is one of a second for both.
const CLOCK: f64 = 0.01;

/// A session's dataset without its readings, and its mirror.
#[derive(Clone, Debug)]
pub(super) struct Conditions {
    data: Dataset,
    device: Device,
}

impl Conditions {
    /// Those of a session of this device, its drives scaled as its mirrors are driven.
    pub(super) fn of(session: &Dataset, device: &Device, scaling: &DriveScaling) -> Self {
        let scaled = rested(scaling.driven(session));
        let observations: Vec<Observation> = scaled.observations.iter().map(unread).collect();
        let own_zeros = scaled.own_zeros.iter().map(|zero| zero.unread()).collect();
        Self {
            data: Dataset {
                intervals: scaled.intervals,
                observations,
                own_zeros,
                is_steady: scaled.is_steady,
                ..Dataset::default()
            },
            device: scaling.described(session, device),
        }
    }

    /// As a dataset, every reading 0.
    pub(super) fn data(&self) -> &Dataset {
        &self.data
    }

    /// What is known of the mirrors, as they are driven.
    pub(super) fn device(&self) -> &Device {
        &self.device
    }

    /// The SHA-256 of everything in them.
    pub(super) fn hash(&self) -> [u8; 32] {
        let mut hash = Hash::default();
        let Dataset {
            intervals,
            observations,
            own_zeros,
            is_steady,
            experiments: _,
            thinned_rows: _,
            notes: _,
            first_ambient_c: _,
        } = &self.data;
        hash.count(usize::from(*is_steady));
        hash.count(intervals.len());
        intervals
            .iter()
            .for_each(|interval| hash.interval(interval));
        hash.count(observations.len());
        observations.iter().for_each(|o| hash.observation(o));
        for zero in own_zeros {
            let counted = observations.iter().map(|o| u8::from(zero.is_of(o)));
            hash.0.update(counted.collect::<Vec<_>>());
        }
        hash.device(&self.device);
        hash.0.finalize().into()
    }
}

/// Between the files of a session lies as much time as a host took to go on. So that sessions of one kind share an ensemble, what a drive
/// is held for until it no longer matters what was before is rounded to [`REST_S`], and a shorter rest, where nothing was read at its
/// end, down to a power of two: a host makes rests longer.
fn rested(mut data: Dataset) -> Dataset {
    let mut is_read = vec![false; data.intervals.len()];
    data.observations
        .iter()
        .for_each(|o| is_read[o.interval] = true);
    for (interval, is_read) in data.intervals.iter_mut().zip(is_read) {
        let is_held = interval.from_v == interval.to_v;
        let is_rest = is_held && interval.to_v == [0.0; ACTUATORS] && !is_read;
        match interval.duration_s {
            long_s if is_held && long_s >= FORGOTTEN_S => interval.duration_s = REST_S,
            short_s if is_rest => {
                interval.duration_s = (short_s * (1.0 + CLOCK)).log2().floor().exp2();
            }
            _ => {}
        }
    }
    data
}

/// What was observed and when, its noise to the nearest power of two, and nothing of what was read.
fn unread(observation: &Observation) -> Observation {
    let noise = match observation.channel {
        Channel::Displacement => observation.noise.max(LEAST_NOISE_UM),
        Channel::Current(_) => observation.noise,
    };
    Observation {
        value: 0.0,
        noise: noise.log2().round().exp2(),
        t_s: 0.0,
        ..*observation
    }
}

/// Each number as eight bytes, least first.
#[derive(Default)]
struct Hash(Sha256);

impl Hash {
    fn count(&mut self, count: usize) {
        self.0.update((count as u64).to_le_bytes());
    }

    fn number(&mut self, number: f64) {
        // 0 and -0 are the same drive.
        self.0.update((number + 0.0).to_le_bytes());
    }

    fn flag(&mut self, flag: bool) {
        self.count(usize::from(flag));
    }

    /// What is known, whatever its names and sources are.
    fn device(&mut self, device: &Device) {
        let Device { facts, segments } = device;
        for quantity in Quantity::OF_THE_MIRROR {
            self.fact(facts.get(&quantity));
        }
        self.count(segments.len());
        segments.iter().for_each(|segment| self.segment(segment));
    }

    fn fact(&mut self, fact: Option<&Fact>) {
        self.flag(fact.is_some());
        if let Some(fact) = fact {
            self.number(fact.value);
            self.number(fact.tolerance);
        }
    }

    fn segment(&mut self, segment: &Segment) {
        let Segment {
            name: _,
            length,
            width,
            films,
            loss,
            heated,
            turned,
        } = segment;
        self.flag(*heated);
        self.flag(*turned);
        for fact in [Some(length), Some(width), loss.as_ref()] {
            self.fact(fact);
        }
        self.count(films.len());
        for (film, thickness) in films {
            self.0.update(film.name());
            self.fact(Some(thickness));
        }
    }

    fn interval(&mut self, interval: &Interval) {
        let Interval {
            duration_s,
            from_v,
            to_v,
            ambient_k,
            reference_um,
        } = interval;
        let volts = from_v.iter().chain(to_v);
        for number in [duration_s, ambient_k, reference_um]
            .into_iter()
            .chain(volts)
        {
            self.number(*number);
        }
    }

    fn observation(&mut self, observation: &Observation) {
        let Observation {
            interval,
            channel,
            value,
            noise,
            experiment,
            t_s,
        } = observation;
        self.count(*interval);
        self.count(match channel {
            Channel::Current(actuator) => *actuator,
            Channel::Displacement => ACTUATORS,
        });
        self.count(*experiment);
        for number in [value, noise, t_s] {
            self.number(*number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::dataset::OwnZero;
    use mirror_model::device::Film;

    /// Two levels, displacement and one current read at each.
    fn session(values: [f64; 4], noise_um: f64) -> Dataset {
        let channels = [
            (Channel::Displacement, noise_um),
            (Channel::Current(0), 2e-6),
        ];
        let read = Dataset::driven([(0.0, 1.0), (2.0, 1.0)]).read_at_each(&channels);
        read.with_values(&values)
    }

    fn key(data: &Dataset) -> [u8; 32] {
        described(data, &Device::default())
    }

    fn described(data: &Dataset, device: &Device) -> [u8; 32] {
        Conditions::of(data, device, &DriveScaling::of(data)).hash()
    }

    #[test]
    fn sessions_of_a_kind_share_an_ensemble_whatever_they_read() {
        // 2 V on 364 and on 400 ohm.
        let one = session([0.0, 0.0, 40.0, 5.5e-3], 0.02);
        let other = session([0.0, 1e-6, 55.0, 5e-3], 0.01);
        assert_eq!(key(&one), key(&other));
        let [a, b] = [&one, &other]
            .map(|data| Conditions::of(data, &Device::default(), &DriveScaling::of(data)));
        assert_eq!(format!("{:?}", a.data), format!("{:?}", b.data));
    }

    #[test]
    fn sessions_share_an_ensemble_however_long_a_host_took_between_their_files() {
        let paused = |pause_s: f64| {
            let mut data = session([0.0, 0.0, 40.0, 2e-3], 0.02);
            data.intervals
                .insert(1, Interval::held([0.0; ACTUATORS], pause_s));
            data.observations[2..]
                .iter_mut()
                .for_each(|o| o.interval = 2);
            key(&data)
        };
        assert_eq!(paused(4.1), paused(7.9));
        // What is read where a drive is held is the beginning of the next file.
        let read_after = |index: usize, held_s: f64| {
            let mut data = session([0.0, 0.0, 40.0, 2e-3], 0.02);
            data.intervals[index].duration_s = held_s;
            key(&data)
        };
        for index in [0, 1] {
            assert_eq!(read_after(index, 4.1), read_after(index, 7.9));
            assert_ne!(read_after(index, 0.6), read_after(index, 0.5));
        }
        assert_eq!(paused(0.5), paused(0.9));
        assert_eq!(paused(1.0), paused(0.999));
        assert_ne!(paused(0.5), paused(5.0));
    }

    #[test]
    fn whatever_an_ensemble_depends_on_changes_its_key() {
        let data = session([0.0, 0.0, 40.0, 2e-3], 0.02);
        let changes: [fn(&mut Dataset); 12] = [
            |data| data.intervals[1].duration_s = 2.0,
            |data| data.intervals[1].from_v[2] = 1.0,
            |data| data.intervals[1].to_v[3] = 1.0,
            |data| data.intervals[1].ambient_k = 1.0,
            |data| data.intervals[1].reference_um = 1.0,
            |data| data.observations[3].channel = Channel::Current(1),
            |data| data.observations[3].interval = 0,
            |data| data.observations[2].noise = 0.2,
            |data| data.observations.truncate(3),
            |data| data.observations[3].experiment = 1,
            |data| data.is_steady = true,
            |data| {
                let zero = OwnZero::new(0..1, &data.observations);
                data.own_zeros.push(zero);
            },
        ];
        for (index, change) in changes.into_iter().enumerate() {
            let mut changed = data.clone();
            change(&mut changed);
            assert_ne!(key(&data), key(&changed), "change {index}");
        }
    }

    #[test]
    fn whatever_is_known_of_the_mirror_changes_its_key_and_how_it_is_known_does_not() {
        let data = session([0.0, 0.0, 40.0, 2e-3], 0.02);
        let nothing = key(&data);
        let fact = |value, tolerance, source: &str| Fact {
            value,
            tolerance,
            source: source.into(),
        };
        let known = |fact| {
            let mut device = Device::default();
            device.facts.insert(Quantity::Leads, fact);
            described(&data, &device)
        };
        let leads = known(fact(6.0, 1.0, "drawing"));
        assert_eq!(leads, known(fact(6.0, 1.0, "ohmmeter")));
        let beam = |change: fn(&mut Segment)| {
            let mut segment = Segment {
                name: "NI".into(),
                length: fact(250.0, 2.0, "drawing"),
                width: fact(100.0, 2.0, "drawing"),
                films: vec![(Film::Aluminium, fact(1.0, 0.1, "drawing"))],
                loss: None,
                heated: true,
                turned: false,
            };
            change(&mut segment);
            let segments = vec![segment];
            described(
                &data,
                &Device {
                    segments,
                    ..Device::default()
                },
            )
        };
        let stated = beam(|_| ());
        assert_eq!(stated, beam(|segment| segment.name = "IV".into()));
        let keys = [
            nothing,
            leads,
            known(fact(6.1, 1.0, "drawing")),
            known(fact(6.0, 1.1, "drawing")),
            stated,
            beam(|segment| segment.turned = true),
            beam(|segment| segment.length.value = 251.0),
            beam(|segment| segment.films[0].0 = Film::Oxide),
            beam(|segment| segment.films[0].1.tolerance = 0.2),
            beam(|segment| segment.loss = Some(segment.width.clone())),
        ];
        for (index, key) in keys.iter().enumerate() {
            assert!(!keys[..index].contains(key), "key {index}");
        }
    }
}
