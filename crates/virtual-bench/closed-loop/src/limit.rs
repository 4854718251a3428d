//! The ideal-controller bound: what the mirror itself allows a controller that knows all of it.

use control_core::CHANNELS;
use emulated_board::{Device, Mirror};
use virtual_mirror::ConfigError;

use crate::TICK_S;
use crate::sine::Sine;

/// Further above what is asked than this a mirror has been too warm (um).
const ABOVE_UM: f64 = 0.01;
/// Trials of a share: it is known to a thousandth then.
const TRIALS: u32 = 10;

/// Time in which the mirror as it is now is within 5 % of the step at the highest drive all the way up, or at none all
/// the way down (s).
pub(crate) fn fastest_s(now: &impl Mirror, drive_v: f64, from_um: f64, to_um: f64) -> f64 {
    let mut mirror = now.clone();
    let volts = if to_um > from_um { drive_v } else { 0.0 };
    let goal = to_um - 0.05 * (to_um - from_um);
    let mut ticks = 0;
    while (mirror.state().z_um - goal) * (to_um - from_um) < 0.0 && ticks < 100_000 {
        mirror.step([volts; CHANNELS], TICK_S);
        ticks += 1;
    }
    f64::from(ticks) * TICK_S
}

/// The loop of a sine that the ideal controller leaves (um): it knows the mirror, and is where it is asked to be whenever a
/// drive between none and `drive_v` takes it there.
///
/// # Errors
/// Where a number of `config` is out of range.
pub(crate) fn loop_um(config: &impl Device, drive_v: f64, sine: &Sine) -> Result<f64, ConfigError> {
    Ok(sine.width_um(&followed(config, drive_v, sine)?))
}

/// The largest part of a sine, its upper end kept, that the ideal controller follows without a loop.
///
/// # Errors
/// Where a number of `config` is out of range.
pub(crate) fn share(config: &impl Device, drive_v: f64, sine: &Sine) -> Result<f64, ConfigError> {
    let (mut within, mut beyond) = (0.0, 1.0);
    for _ in 0..TRIALS {
        let share = 0.5 * (within + beyond);
        let above = followed(config, drive_v, &sine.upper(share))?;
        if above.into_iter().any(|above| above > ABOVE_UM) {
            beyond = share;
        } else {
            within = share;
        }
    }
    Ok(within)
}

/// How far the ideal controller is from a sine, tick by tick (um).
fn followed(config: &impl Device, drive_v: f64, sine: &Sine) -> Result<Vec<f64>, ConfigError> {
    const REST_S: f64 = 1.0;
    const PART_S: f64 = 0.01;
    let mut mirror = IdealController::new(config, drive_v)?;
    for _ in 0..(REST_S / PART_S) as usize {
        mirror.reach(sine.low_um, PART_S);
    }
    Ok(sine.errors_um(0.0, |asked_um| mirror.reach(asked_um, TICK_S)))
}

/// A mirror without its resonance, which no drive of a tick holds, and the highest drive.
struct IdealController<M> {
    mirror: M,
    drive_v: f64,
}

impl<M: Mirror> IdealController<M> {
    fn new(config: &impl Device<Mirror = M>, drive_v: f64) -> Result<Self, ConfigError> {
        Ok(Self {
            mirror: config.without_inertia()?,
            drive_v,
        })
    }

    /// So many seconds (s) at one drive, at whose end the mirror is at `z_um`, or as near as a drive takes it; returns where it
    /// is (um).
    fn reach(&mut self, z_um: f64, seconds: f64) -> f64 {
        let ends_um = |square: f64| {
            let mut trial = self.mirror.clone();
            trial.step([square.sqrt(); CHANNELS], seconds);
            trial.state().z_um
        };
        // In a tick the displacement is all but a straight line of the drive's square.
        let highest = self.drive_v * self.drive_v;
        let (mut low, mut high) = ((0.0, ends_um(0.0)), (highest, ends_um(highest)));
        let mut square = 0.0;
        for _ in 0..3 {
            let part = (z_um - low.1) / (high.1 - low.1);
            square = low.0 + part.clamp(0.0, 1.0) * (high.0 - low.0);
            if !(0.0..=1.0).contains(&part) {
                break;
            }
            let middle = (square, ends_um(square));
            if middle.1 < z_um {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.mirror.step([square.sqrt(); CHANNELS], seconds);
        self.mirror.state().z_um
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use virtual_mirror::MirrorConfig;

    const DRIVE_V: f64 = 3.5;

    fn sine(hz: f64) -> Sine {
        Sine::new((10.0, 40.0), hz)
    }

    #[test]
    fn the_ideal_controller_follows_a_slow_sine_all_the_way() {
        let config = MirrorConfig::bench();
        assert!(loop_um(&config, DRIVE_V, &sine(20.0)).expect("a mirror") < ABOVE_UM);
        assert!(share(&config, DRIVE_V, &sine(20.0)).expect("a mirror") > 0.99);
    }

    #[test]
    fn where_cooling_opens_a_loop_a_part_of_the_sine_closes_it() {
        let (config, fast) = (MirrorConfig::bench(), sine(400.0));
        let open = loop_um(&config, DRIVE_V, &fast).expect("a mirror");
        let share = share(&config, DRIVE_V, &fast).expect("a mirror");
        assert!(open > 1.0, "{open} um");
        assert!((0.05..0.95).contains(&share), "{share}");
        let closed = loop_um(&config, DRIVE_V, &fast.upper(share)).expect("a mirror");
        // Up and down each as far off the sine as the share lets it.
        assert!(closed < 2.0 * ABOVE_UM, "{closed} um");
        let more = loop_um(&config, DRIVE_V, &fast.upper(1.1 * share)).expect("a mirror");
        assert!(more > ABOVE_UM, "{more} um");
    }
}
