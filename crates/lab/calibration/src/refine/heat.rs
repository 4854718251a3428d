//! The stage `heat` forward, in f64: from heating power to the temperature rises of the four actuators, through a Foster
//! network of thermal poles (Foster 1924, JESD51-14).

use control_core::CHANNELS;
use control_core::calibration::{FAST_POLES, Heat, Lag, SLOW, SLOW_POLES};
use control_core::{Second, SecondPerKelvin};

use super::timeline::TimeStep;

/// The length that lags are sampled at first (s): a control tick's.
const USUAL_STEP_S: f64 = 1e-4;
/// Time steps are alike that differ by no more than this part: a hundred seconds of ticks are rounded to 1e-10 of a tick.
const ALIKE: f64 = 1e-9;

/// Thermal poles, the fast ones first.
pub(super) const POLES: usize = FAST_POLES + SLOW_POLES;

/// Weights that add up to one, and time constants (s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FosterNetwork {
    pub(super) weight: [f64; POLES],
    pub(super) time_s: [f64; POLES],
    /// What the time constants grow by for each kelvin of the rise (s/K).
    pub(super) time_growth_s_per_k: f64,
}

/// What an actuator's power holds at rest: `rise (1 + growth rise) = k_per_w power`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeatLoss {
    pub(crate) k_per_w: f64,
    /// In 1/K.
    pub(crate) growth: f64,
}

impl FosterNetwork {
    pub(super) fn of(heat: &Heat) -> Self {
        let all = || heat.fast.iter().chain(&heat.slow);
        let mut network = Self {
            weight: [0.0; POLES],
            time_s: [0.0; POLES],
            time_growth_s_per_k: f64::from(heat.time_growth.0),
        };
        for (pole, lag) in all().enumerate() {
            network.weight[pole] = f64::from(lag.weight);
            network.time_s[pole] = f64::from(lag.time.0);
        }
        network
    }

    pub(super) fn heat(&self) -> Heat {
        let lag = |pole: usize| Lag {
            weight: self.weight[pole] as f32,
            time: Second(self.time_s[pole] as f32),
        };
        Heat {
            fast: std::array::from_fn(lag),
            slow: std::array::from_fn(|pole| {
                let slow = lag(FAST_POLES + pole);
                Lag {
                    time: Second(slow.time.0.max(SLOW.0)),
                    ..slow
                }
            }),
            time_growth: SecondPerKelvin(self.time_growth_s_per_k as f32),
            ..Heat::INSTANT
        }
    }

    /// The time (s) in which a step of the heating would be over if it went on as it begins.
    pub(super) fn initial_time_s(&self) -> f64 {
        let rates = self.weight.iter().zip(self.time_s);
        rates
            .map(|(weight, time_s)| weight / time_s)
            .sum::<f64>()
            .recip()
    }

    /// The temperature rises of all actuators at the end of every time step (K).
    pub(super) fn rises(
        &self,
        steps: &[TimeStep],
        losses: &[HeatLoss; CHANNELS],
    ) -> Vec<[f64; CHANNELS]> {
        self.along(steps, losses, |rise, _, _| rise)
    }

    /// The same, with what the fast poles have still to bring then (K).
    pub(super) fn rises_unsettled(
        &self,
        steps: &[TimeStep],
        losses: &[HeatLoss; CHANNELS],
    ) -> Vec<[(f64, f64); CHANNELS]> {
        self.along(steps, losses, |rise, states, input| {
            let fast = states.iter().zip(self.weight).take(FAST_POLES);
            let to_come = fast.map(|(state, weight)| weight * (input - state));
            (rise, to_come.sum())
        })
    }

    /// What `tell` makes of each actuator at the end of every time step: of its temperature rise, the states of its poles, and
    /// where its heating would take these (K).
    fn along<T: Copy + Default>(
        &self,
        steps: &[TimeStep],
        losses: &[HeatLoss; CHANNELS],
        tell: impl Fn(f64, &[f64; POLES], f64) -> T,
    ) -> Vec<[T; CHANNELS]> {
        let mut states = [[0.0; POLES]; CHANNELS];
        let mut rises = [0.0; CHANNELS];
        let mut told = [T::default(); CHANNELS];
        let mut lags = Lags::of(self.time_s);
        let advance = |step: &TimeStep| {
            if step.duration_s > 0.0 {
                let sampled = lags.over(step.duration_s);
                let stored_per_k2 = 0.5 * self.time_growth_s_per_k / step.duration_s;
                for (channel, loss) in losses.iter().enumerate() {
                    let taken = Taken {
                        loss,
                        stored_per_k2,
                    };
                    let power_w = (step.from_w[channel], step.to_w[channel]);
                    let state = &mut states[channel];
                    let rise = self.advance(state, rises[channel], sampled, &taken, power_w);
                    let input = loss.k_per_w * power_w.1 - loss.growth * rise * rise;
                    told[channel] = tell(rise, state, input);
                    rises[channel] = rise;
                }
            }
            told
        };
        steps.iter().map(advance).collect()
    }

    /// One actuator through one time step; returns its rise at the end.
    ///
    /// The network's input is the heating less what the growing loss takes of it, `k_per_w power - growth rise^2`, and less what is
    /// stored all along the step, the time growth's half times the change of `rise^2` over the step's duration. With the free response
    /// and the input's start known, the rise at the end solves `rise = driven - square rise^2`: the root that is 0 at rest.
    fn advance(
        &self,
        states: &mut [f64; POLES],
        rise: f64,
        sampled: &[SampledLag; POLES],
        Taken {
            loss,
            stored_per_k2,
        }: &Taken,
        (from_w, to_w): (f64, f64),
    ) -> f64 {
        let input_start = loss.k_per_w * from_w - loss.growth * rise * rise;
        let (mut free_response, mut gain, mut gain_held) = (0.0, 0.0, 0.0);
        for ((lag, weight), state) in sampled.iter().zip(self.weight).zip(states.iter()) {
            free_response += weight * (lag.pole * state + lag.gain_start * input_start);
            gain += weight * lag.gain_end;
            gain_held += weight * (lag.gain_start + lag.gain_end);
        }
        let given_back = gain_held * stored_per_k2 * rise * rise;
        let driven = free_response + gain * loss.k_per_w * to_w + given_back;
        let square = gain * loss.growth + gain_held * stored_per_k2;
        let root = (1.0 + 4.0 * square * driven).max(0.0).sqrt();
        let end = 2.0 * driven / (1.0 + root);
        let stored = stored_per_k2 * (end * end - rise * rise);
        let input_end = loss.k_per_w * to_w - loss.growth * end * end;
        for (lag, state) in sampled.iter().zip(states) {
            *state = lag.after(*state, input_start - stored, input_end - stored);
        }
        end
    }
}

/// What takes of an actuator's heating before it comes to the poles, in one time step.
struct Taken<'a> {
    loss: &'a HeatLoss,
    /// What is stored for each square kelvin by which the rise's square changes (1/K).
    stored_per_k2: f64,
}

/// A first-order lag over one time step whose input runs straight (first-order hold; Astrom and Wittenmark 1997).
#[derive(Clone, Copy, Debug)]
pub(super) struct SampledLag {
    pole: f64,
    /// Gains of the input at the step's start and at its end.
    gain_start: f64,
    gain_end: f64,
}

impl SampledLag {
    fn new(time_s: f64, step_s: f64) -> Self {
        let rate = -(-step_s / time_s).exp_m1();
        let mean = rate * time_s / step_s;
        Self {
            pole: 1.0 - rate,
            gain_start: mean - (1.0 - rate),
            gain_end: 1.0 - mean,
        }
    }

    /// The lag's state at the step's end.
    pub(super) fn after(&self, state: f64, from: f64, to: f64) -> f64 {
        self.pole * state + self.gain_start * from + self.gain_end * to
    }
}

/// First-order lags that are sampled anew only where a time step is of another length than the one before: most of a drive's rows come
/// evenly.
pub(super) struct Lags<const N: usize> {
    time_s: [f64; N],
    step_s: f64,
    sampled: [SampledLag; N],
}

impl<const N: usize> Lags<N> {
    /// Lags of these time constants (s).
    pub(super) fn of(time_s: [f64; N]) -> Self {
        let step_s = USUAL_STEP_S;
        Self {
            time_s,
            step_s,
            sampled: time_s.map(|time_s| SampledLag::new(time_s, step_s)),
        }
    }

    /// Over a time step so long.
    pub(super) fn over(&mut self, step_s: f64) -> &[SampledLag; N] {
        if (step_s - self.step_s).abs() > ALIKE * self.step_s {
            self.step_s = step_s;
            self.sampled = self.time_s.map(|time_s| SampledLag::new(time_s, step_s));
        }
        &self.sampled
    }
}

impl HeatLoss {
    /// The heating that holds a rise: the rise that its power would hold without growth (K).
    pub(crate) fn heating(&self, rise: f64) -> f64 {
        rise * (1.0 + self.growth * rise)
    }

    /// The rise that a heating holds (K).
    pub(crate) fn rise(&self, heating: f64) -> f64 {
        let root = (1.0 + 4.0 * self.growth * heating).max(0.0).sqrt();
        2.0 * heating / (1.0 + root)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NETWORK: FosterNetwork = FosterNetwork {
        weight: [0.6, 0.3, 0.0, 0.0, 0.1],
        time_s: [1e-3, 0.03, 0.1, 0.5, 4.0],
        time_growth_s_per_k: 0.0,
    };

    fn losses(growth: f64) -> [HeatLoss; CHANNELS] {
        [HeatLoss {
            k_per_w: 6000.0,
            growth,
        }; CHANNELS]
    }

    fn held(duration_s: f64, power_w: f64) -> TimeStep {
        TimeStep {
            duration_s,
            from_w: [power_w; CHANNELS],
            to_w: [power_w; CHANNELS],
            ..TimeStep::default()
        }
    }

    #[test]
    fn a_step_of_the_power_answers_with_exponentials() {
        // 10 mW make 60 K in the end, by `1 - exp(-t / tau)` of each pole; exact at any length of the steps.
        let rises = NETWORK.rises(&[held(0.002, 0.01), held(0.018, 0.01)], &losses(0.0));
        for (t_s, rise) in [0.002, 0.02].into_iter().zip(rises) {
            let gone = |(weight, time_s): (f64, f64)| weight * (1.0 - f64::exp(-t_s / time_s));
            let exact: f64 = NETWORK
                .weight
                .into_iter()
                .zip(NETWORK.time_s)
                .map(gone)
                .sum();
            assert!(
                (rise[2] - 60.0 * exact).abs() < 1e-10,
                "{rise:?} at {t_s} s"
            );
        }
    }

    #[test]
    fn lags_are_those_of_every_step_whatever_came_before() {
        let mut lags = Lags::of([1e-3, 0.5]);
        for step_s in [1e-4, 1e-4, 0.02, 0.02 + 1e-6, 1e-4] {
            for (lag, time_s) in lags.over(step_s).iter().zip([1e-3, 0.5]) {
                let exact = SampledLag::new(time_s, step_s);
                assert_eq!(lag.after(1.0, 2.0, 3.0), exact.after(1.0, 2.0, 3.0));
            }
        }
    }

    #[test]
    fn a_ramp_of_the_power_is_followed_a_time_constant_behind() {
        // Long after its beginning a lag is behind a ramp by its slope times the time constant.
        let lag = SampledLag::new(0.5, 10.0);
        assert!((lag.after(0.0, 0.0, 20.0) - (20.0 - 2.0 * 0.5)).abs() < 1e-7);
        // One that is far faster than the step is where its input is, one that is far slower stays.
        assert!((SampledLag::new(1e-9, 1.0).after(5.0, 0.0, 7.0) - 7.0).abs() < 1e-7);
        assert!((SampledLag::new(1e9, 1.0).after(5.0, 0.0, 7.0) - 5.0).abs() < 1e-7);
    }

    #[test]
    fn what_grows_with_the_rise_is_followed_as_in_steps_a_hundred_times_shorter() {
        // One pole: (time + growth rise) slope = heating - rise - loss growth rise^2, by Euler's method.
        let (time_s, time_growth) = (5e-3, 4e-5);
        let network = FosterNetwork {
            weight: [1.0, 0.0, 0.0, 0.0, 0.0],
            time_s: [time_s, 0.03, 0.1, 0.5, 4.0],
            time_growth_s_per_k: time_growth,
        };
        assert!((network.initial_time_s() - time_s).abs() < 1e-12);
        let rises = network.rises(&vec![held(1e-4, 0.02); 200], &losses(2e-3));
        let mut exact = 0.0_f64;
        for rise in rises {
            for _ in 0..100 {
                let heating = 120.0 - exact - 2e-3 * exact * exact;
                exact += 1e-6 * heating / (time_s + time_growth * exact);
            }
            // A step is 1/50 of the time constant, and what is stored is taken evenly along it: second order, of 100 K.
            assert!(
                (rise[0] - exact).abs() < 100.0 * 0.02_f64.powi(2),
                "{rise:?} for {exact}"
            );
        }
    }

    #[test]
    fn at_rest_the_loss_and_the_heating_balance() {
        let loss = losses(2e-3)[0];
        // 20 mW: rise (1 + 0.002 rise) = 120 K.
        let rises = NETWORK.rises(&vec![held(5.0, 0.02); 100], &losses(2e-3));
        let rise = rises.last().unwrap()[0];
        assert!((loss.heating(rise) - 120.0).abs() < 1e-9, "{rise}");
        assert!((loss.rise(120.0) - rise).abs() < 1e-9);
        // A root worked by hand: 100 (1 + 0.002 * 100) = 120.
        assert!((loss.rise(120.0) - 100.0).abs() < 1e-12);
    }

    #[test]
    fn a_calibration_holds_the_network_in_f32() {
        let there_and_back = FosterNetwork::of(&NETWORK.heat());
        for pole in 0..POLES {
            let off = |a: f64, b: f64| (a - b).abs() <= f64::from(f32::EPSILON) * b;
            assert!(off(there_and_back.weight[pole], NETWORK.weight[pole]));
            assert!(off(there_and_back.time_s[pole], NETWORK.time_s[pole]));
        }
    }
}
