//! What was measured and what a model says of it, experiment by experiment.

use charts::{Look, Panel, Series};
use identification::Dataset;
use identification::dataset::Channel;

/// One experiment's curves against what it is best seen against.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The experiment.
    pub experiment: String,
    /// Name and unit of the abscissa.
    pub x_name: &'static str,
    /// Abscissa, measured and modelled, in order.
    pub points: Vec<(f64, f64, f64)>,
}

/// The curves of a session: of the displacement, or of the first current where there is none.
#[derive(Clone, Debug)]
pub struct Curves {
    /// What the ordinate is of.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Those with two points at least.
    pub curves: Vec<Curve>,
}

impl Curves {
    /// Of a session, and a model's predictions of it.
    pub fn new(data: &Dataset, predicted: &[f64]) -> Self {
        let (shown, quantity, unit, scale) = if data.has_displacement() {
            (Channel::Displacement, "z", "µm", 1.0)
        } else {
            (Channel::Current(0), "I1", "mA", 1e3)
        };
        let curve = |index: usize| {
            let experiment = data.experiments[index].clone();
            // Sweeps and ladders are looked at against the drive, everything else against time.
            let by_drive = ["sweep", "repeat"]
                .iter()
                .any(|kind| experiment.starts_with(kind));
            let of_it = data.observations.iter().zip(predicted);
            let points = of_it
                .filter(|(seen, _)| seen.experiment == index && seen.channel == shown)
                .map(|(seen, modelled)| {
                    let x = if by_drive {
                        data.drive(seen)[0]
                    } else {
                        seen.t_s
                    };
                    (x, scale * seen.value, scale * modelled)
                })
                .collect();
            Curve {
                experiment,
                x_name: if by_drive { "drive (V)" } else { "time (s)" },
                points,
            }
        };
        let curves = (0..data.experiments.len())
            .map(curve)
            .filter(|curve| curve.points.len() > 1)
            .collect();
        Self {
            quantity,
            unit,
            curves,
        }
    }

    /// Two charts for every experiment: both curves, and what is left between them.
    pub fn panels(&self) -> Vec<[Panel; 2]> {
        self.curves.iter().map(|curve| self.of(curve)).collect()
    }

    fn of(&self, curve: &Curve) -> [Panel; 2] {
        let points = |of: fn(&(f64, f64, f64)) -> f64| -> Vec<(f64, f64)> {
            curve
                .points
                .iter()
                .map(|point| (point.0, of(point)))
                .collect()
        };
        let series = |name: &str, look, points| Series {
            name: name.into(),
            look,
            points,
        };
        let Self { quantity, unit, .. } = self;
        let panel = |title: String, y: String, series| Panel {
            title,
            x: curve.x_name.into(),
            y,
            series,
        };
        [
            panel(
                curve.experiment.clone(),
                format!("{quantity} ({unit})"),
                vec![
                    series("measured", Look::Measured, points(|p| p.1)),
                    series("model", Look::Model, points(|p| p.2)),
                ],
            ),
            panel(
                format!("{}: what is left", curve.experiment),
                format!("residual of {quantity} ({unit})"),
                vec![series(
                    "measured less model",
                    Look::Residual,
                    points(|p| p.1 - p.2),
                )],
            ),
        ]
    }
}
