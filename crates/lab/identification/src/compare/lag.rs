//! What the error does in time: after jumps of the drive, and along sines of different frequency.

use super::ladder::STEADY_S;
use super::reading::{Reading, SURE, highest, scale};
use crate::Unit;
use crate::dataset::Dataset;

/// Holds of so many readings after a jump show a course in time.
const READINGS: usize = 10;
/// Excesses of which one is at least this share of the other are much the same.
const SAME: f64 = 0.4;
/// Readings this close to the middle of a sine, in parts of its amplitude, measure how wide its loop is: its slope is within 2 % there.
const NEAR: f64 = 0.2;
/// Loops that differ by less than this part of their width are alike.
const PART: f64 = 0.03;

/// Loops that are apart by less than lumped equations can follow are alike.
const ALIKE_UM: f64 = 0.1;

/// What jumps show, then what sines show.
pub(super) fn sentences(data: &Dataset, readings: &[Vec<Reading>], unit: Unit) -> Vec<String> {
    let jumps = data.experiments.iter().zip(readings);
    let mut sentences: Vec<String> = jumps
        .flat_map(|(name, readings)| after_jumps(data, name, readings, unit))
        .collect();
    let mut loops: Vec<Loop> = readings.iter().filter_map(|r| Loop::of(data, r)).collect();
    loops.sort_by(|a, b| a.hz.total_cmp(&b.hz));
    let alike = match unit {
        Unit::Micrometre => ALIKE_UM,
        Unit::Milliampere => 0.0,
    };
    sentences.extend(along_sines(&loops, alike, unit));
    sentences
}

/// How the error moves after each jump: at once, and slowly.
fn after_jumps(data: &Dataset, name: &str, readings: &[Reading], unit: Unit) -> Vec<String> {
    let (_, worth) = scale(readings);
    let held = readings.chunk_by(|a, b| a.drive == b.drive);
    held.filter_map(|hold| {
        let first = &hold[0];
        let interval = &data.intervals[first.interval];
        let jumped_s = first.t_s - interval.duration_s;
        let last = hold.last()?;
        let long = last.t_s - jumped_s;
        if hold.len() < READINGS || interval.from_v != interval.to_v || long < 2.0 * STEADY_S {
            return None;
        }
        let settled = hold.iter().find(|r| r.t_s - jumped_s >= STEADY_S)?;
        let early = hold
            .iter()
            .take_while(|r| r.t_s - jumped_s < STEADY_S)
            .map(|r| (r.error() - settled.error(), r.t_s - jumped_s))
            .max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
        let slow = last.error() - settled.error();
        let mut parts = Vec::new();
        if early.0.abs() > worth {
            parts.push(format!(
                "{:+.2} {unit} off {:.1} ms after it and gone within {STEADY_S} s: a lag, or ringing",
                early.0,
                1e3 * early.1
            ));
        }
        if slow.abs() > worth {
            parts.push(format!(
                "then moving by {slow:+.2} {unit} until {long:.0} s: creep, or something warms"
            ));
        }
        (!parts.is_empty()).then(|| {
            format!(
                "{name}, the error after the jump to {:.2} V: {}",
                highest(first.drive),
                parts.join("; ")
            )
        })
    })
    .collect()
}

/// How far the branches of a sine are apart at its middle, down less up.
struct Loop {
    hz: f64,
    measured: f64,
    modelled: f64,
    noise: f64,
    /// What is worth a word of this sine's errors.
    worth: f64,
}

impl Loop {
    /// None where the drive does not swing.
    fn of(data: &Dataset, readings: &[Reading]) -> Option<Self> {
        let swings =
            |r: &Reading| data.intervals[r.interval].from_v != data.intervals[r.interval].to_v;
        if readings.len() < 4 * READINGS || !readings.iter().all(swings) {
            return None;
        }
        let drives: Vec<f64> = readings.iter().map(|r| r.drive[0]).collect();
        let (low, high) = drives
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(*v), b.max(*v))
            });
        let (middle, amplitude) = (0.5 * (low + high), 0.5 * (high - low));
        // A sine passes through four amplitudes in a period.
        let swept = || readings.iter().map(|r| &data.intervals[r.interval]);
        let path: f64 = swept().map(|i| (i.to_v[0] - i.from_v[0]).abs()).sum();
        let long: f64 = swept().map(|i| i.duration_s).sum();
        let rising = |r: &Reading| {
            let interval = &data.intervals[r.interval];
            interval.to_v[0] > interval.from_v[0]
        };
        let near: Vec<_> = readings
            .iter()
            .filter(|r| (r.drive[0] - middle).abs() < NEAR * amplitude)
            .collect();
        let count = near.len();
        let apart = |value: &dyn Fn(&Reading) -> f64| {
            let (bottom, top) = readings
                .iter()
                .map(value)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                    (a.min(v), b.max(v))
                });
            let slope = (top - bottom) / (high - low);
            let mean = |up: bool| {
                let of: Vec<f64> = near
                    .iter()
                    .filter(|r| rising(r) == up)
                    .map(|r| value(r) - slope * (r.drive[0] - middle))
                    .collect();
                (!of.is_empty()).then(|| of.iter().sum::<f64>() / of.len() as f64)
            };
            Some(mean(false)? - mean(true)?)
        };
        Some(Self {
            hz: path / (4.0 * amplitude) / long,
            measured: apart(&|r| r.measured)?,
            modelled: apart(&|r| r.modelled)?,
            noise: 2.0 * readings[0].noise / (count as f64).sqrt(),
            worth: scale(readings).1,
        })
    }
}

fn along_sines(loops: &[Loop], alike: f64, unit: Unit) -> Option<String> {
    let (first, last) = (loops.first()?, loops.last()?);
    let widths: Vec<String> = loops
        .iter()
        .map(|l| {
            format!(
                "{:.2} ({:.2}) {unit} at {} Hz",
                l.measured,
                l.modelled,
                round(l.hz)
            )
        })
        .collect();
    let worth = |l: &Loop| {
        let least = alike.max(SURE * l.noise).max(l.worth);
        least.max(PART * l.measured.abs())
    };
    let excess = |l: &Loop| {
        let excess = l.measured - l.modelled;
        if excess.abs() > worth(l) { excess } else { 0.0 }
    };
    let slow = excess(first);
    // Wide loops hide an excess of the size that the slow one shows.
    let telling = |l: &&Loop| worth(l) < SAME * slow.abs();
    let fast = excess(loops[1..].iter().rev().find(telling).unwrap_or(last));
    let trend = match () {
        () if loops.iter().all(|l| excess(l) == 0.0) => "as modelled",
        () if loops.len() == 1 && slow > 0.0 => "wider than modelled: memory, or a lag",
        () if slow.min(fast) > SAME * slow.max(fast) && slow > 0.0 => {
            "too wide by much the same at every frequency: memory that knows no rate"
        }
        () if fast > 2.0 * slow.abs() => {
            "wider than modelled where it is fast: a lag is missing or too short"
        }
        () if slow > 2.0 * fast.abs() => {
            "wider than modelled where it is slow: creep, or something warms"
        }
        () => "not as modelled, in no simple order of frequency",
    };
    Some(format!(
        "loops measured (and modelled): {}: {trend}",
        widths.join(", ")
    ))
}

/// Three digits: what was counted off the drive is no more exact.
fn round(hz: f64) -> f64 {
    let unit = 10f64.powf(hz.log10().floor() - 2.0);
    // Dividing by the inverse prints as a person writes it.
    (hz / unit).round() / (1.0 / unit).round().max(1.0) * unit.max(1.0).round()
}

#[cfg(test)]
mod tests {
    use super::round;

    #[test]
    fn frequencies_have_three_digits() {
        assert_eq!(round(0.0100049), 0.01);
        assert_eq!(round(1449.6), 1450.0);
        assert_eq!(round(7.3891), 7.39);
    }
}
