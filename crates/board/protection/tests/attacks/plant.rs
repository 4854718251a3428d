//! One beam of a mirror behind one channel of a board, in f64 and in terms of its own.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Steps of integration in a control tick of 0.1 ms: the quickest node takes 0.6 ms.
const STEPS: usize = 10;
const STEP_S: f64 = 1e-4 / STEPS as f64;

/// How much of the air's cooling there is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings {
    pub(crate) air: f64,
    pub(crate) room_k: f64,
}

impl Surroundings {
    pub(crate) const AIR: Self = Self {
        air: 1.0,
        room_k: 0.0,
    };
    pub(crate) const VACUUM: Self = Self {
        air: 0.03,
        room_k: 0.0,
    };

    /// From air to vacuum, in a room 8 K colder to 15 K warmer than where the mirror was measured.
    pub(crate) fn draw(rng: &mut ChaCha8Rng) -> Self {
        Self {
            air: 10_f64.powf(rng.random_range(-1.5..0.0)),
            room_k: rng.random_range(-8.0..15.0),
        }
    }
}

/// Heater film, beam and plate: what they hold, what they pass on, what they lose.
#[derive(Clone, Debug)]
pub(crate) struct Beam {
    /// Rises above the room where the mirror was measured (K).
    rise_k: [f64; 3],
    room_k: f64,
    capacity_j_k: [f64; 3],
    /// From film to beam, and from beam to plate (W/K).
    link_w_k: [f64; 2],
    /// From each into the room (W/K).
    loss_w_k: [f64; 3],
    cold_ohm: f64,
    platinum: Platinum,
    /// The two poles of the output filter, of which an emulated board has none.
    filter_v: [f64; 2],
    corner_hz: Option<f64>,
    sense_gain: f64,
    sense_offset_a: f64,
    noise: u32,
}

#[derive(Clone, Copy, Debug)]
enum Platinum {
    /// Callendar and Van Dusen's, IEC 60751, from 22 degC: it reads colder than it is where a straight line is assumed.
    Iec60751,
    /// The paper's: 3.92e-3 /K all the way.
    Straight,
}

impl Platinum {
    fn relative(self, rise_k: f64) -> f64 {
        let iec = |t_c: f64| 1.0 + 3.9083e-3 * t_c - 5.775e-7 * t_c * t_c;
        match self {
            Self::Iec60751 => iec(22.0 + rise_k) / iec(22.0),
            Self::Straight => 1.0 + 3.92e-3 * rise_k,
        }
    }
}

impl Beam {
    /// A beam of the line, at rest.
    pub(crate) fn draw(surroundings: Surroundings, rng: &mut ChaCha8Rng) -> Self {
        let air = surroundings.air * rng.random_range(0.9..1.1);
        let quickest_s = rng.random_range(0.6e-3..3e-3);
        // The more of the film's heat the air takes, the less is left to hold it back in vacuum.
        let link_w_k = rng.random_range(20e-6..150e-6);
        Self {
            rise_k: [surroundings.room_k; 3],
            room_k: surroundings.room_k,
            capacity_j_k: [240e-6 * quickest_s, 8e-6, 1e-5],
            link_w_k: [link_w_k, 60e-6],
            loss_w_k: [
                (110e-6 + 0.6 * (150e-6 - link_w_k)) * air,
                100e-6 * air + 6e-6,
                40e-6 * air,
            ],
            cold_ohm: rng.random_range(345.0..375.0),
            platinum: if rng.random() {
                Platinum::Iec60751
            } else {
                Platinum::Straight
            },
            filter_v: [0.0; 2],
            corner_hz: rng
                .random::<bool>()
                .then(|| rng.random_range(1800.0..2200.0)),
            sense_gain: 1.0 + rng.random_range(-0.01..0.01),
            sense_offset_a: rng.random_range(-8e-6..8e-6),
            noise: rng.random(),
        }
    }

    pub(crate) fn hottest_k(&self) -> f64 {
        self.rise_k.into_iter().fold(self.room_k, f64::max)
    }

    /// A control tick with `drive_v` in the compare register; the code that its converter reads, which samples while
    /// the channel has its turn: 14 us each, from the tick's beginning.
    pub(crate) fn tick(&mut self, channel: usize, drive_v: f64) -> u16 {
        let mut code = 0;
        for step in 0..STEPS {
            let volts = self.filtered(drive_v);
            let ohm = self.cold_ohm * self.platinum.relative(self.rise_k[0]);
            if step == channel + channel / 2 {
                code = self.convert(volts / ohm);
            }
            self.heat(volts * volts / ohm);
        }
        code
    }

    fn filtered(&mut self, drive_v: f64) -> f64 {
        let Some(corner_hz) = self.corner_hz else {
            return drive_v;
        };
        let part = 1.0 - (-std::f64::consts::TAU * corner_hz * STEP_S).exp();
        let before = self.filter_v[1];
        self.filter_v[0] += part * (drive_v - self.filter_v[0]);
        self.filter_v[1] += part * (self.filter_v[0] - self.filter_v[1]);
        before
    }

    fn heat(&mut self, power_w: f64) {
        let [film, beam, plate] = self.rise_k;
        let into_beam = self.link_w_k[0] * (film - beam);
        let into_plate = self.link_w_k[1] * (beam - plate);
        let lost = |i: usize| self.loss_w_k[i] * (self.rise_k[i] - self.room_k);
        let net_w = [
            power_w - into_beam - lost(0),
            into_beam - into_plate - lost(1),
            into_plate - lost(2),
        ];
        for (i, net_w) in net_w.into_iter().enumerate() {
            self.rise_k[i] += net_w * STEP_S / self.capacity_j_k[i];
        }
    }

    /// 264 V/A upon 32.7 mV, at 3.3 V / 65536 a step, with noise of some steps.
    fn convert(&mut self, current_a: f64) -> u16 {
        self.noise = self
            .noise
            .wrapping_mul(1_664_525)
            .wrapping_add(1_013_904_223);
        let noise = f64::from(self.noise >> 24) / 16.0 - 8.0;
        let sensed_a = current_a * self.sense_gain + self.sense_offset_a;
        let volts = sensed_a * 264.0 + 3.3 / 101.0;
        (volts / 3.3 * 65_536.0 + noise).clamp(0.0, 65_520.0) as u16
    }
}
