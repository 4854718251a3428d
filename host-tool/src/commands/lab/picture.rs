//! Measured and modelled curves with what is left between them: in the terminal, and as SVG.

use identification::Dataset;
use identification::dataset::Channel;
use identification::prediction::predict;
use mirror_model::{Model, Runaway};
use plotters::prelude::*;

use crate::error::ToolError;
use crate::picture::{ERROR, INK, MEASURED, panel, text_plot};

/// One experiment's curves against what it is best seen against.
struct Curve {
    experiment: String,
    x_name: &'static str,
    /// (x, measured, modelled) in order.
    points: Vec<(f64, f64, f64)>,
}

/// The curves of a session: of the displacement, or of the currents where there is none.
pub(super) struct Curves {
    y_name: &'static str,
    curves: Vec<Curve>,
}

const WIDTH: u32 = 900;
const ROW_HEIGHT: u32 = 260;

impl Curves {
    pub(super) fn new(model: &Model, data: &Dataset) -> Result<Self, Runaway> {
        let predicted = predict(model, data)?;
        let shown = if data.has_displacement() {
            Channel::Displacement
        } else {
            Channel::Current(0)
        };
        let (y_name, unit) = if data.has_displacement() {
            ("z (um)", 1.0)
        } else {
            ("I1 (mA)", 1e3)
        };
        let curve = |index: usize| {
            let of_it: Vec<_> = data
                .observations
                .iter()
                .zip(&predicted)
                .filter(|(seen, _)| seen.experiment == index && seen.channel == shown)
                .collect();
            let experiment = data.experiments[index].clone();
            // Sweeps and ladders are looked at against the drive, everything else against time.
            let by_drive = ["sweep", "repeat"]
                .iter()
                .any(|kind| experiment.starts_with(kind));
            let points = of_it
                .iter()
                .map(|(seen, modelled)| {
                    let x = if by_drive {
                        data.drive(seen)[0]
                    } else {
                        seen.t_s
                    };
                    (x, unit * seen.value, unit * **modelled)
                })
                .collect();
            let x_name = if by_drive { "drive (V)" } else { "time (s)" };
            Curve {
                experiment,
                x_name,
                points,
            }
        };
        let curves = (0..data.experiments.len())
            .map(curve)
            .filter(|curve| curve.points.len() > 1)
            .collect();
        Ok(Self { y_name, curves })
    }

    /// What is left, experiment by experiment, as dots.
    pub(super) fn in_the_terminal(&self) -> String {
        self.curves
            .iter()
            .map(|curve| {
                let points: Vec<_> = curve
                    .points
                    .iter()
                    .map(|(x, seen, model)| (*x, seen - model))
                    .collect();
                let title = format!(
                    "{}: measured less modelled, {} against {}",
                    curve.experiment, self.y_name, curve.x_name
                );
                text_plot(&title, &points)
            })
            .collect()
    }

    /// A row for every experiment: both curves on the left, what is left on the right.
    pub(super) fn as_svg(&self) -> Result<String, ToolError> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|error| ToolError::Picture {
            reason: error.to_string(),
        })?;
        Ok(svg)
    }

    fn draw(&self, svg: &mut String) -> Result<(), Box<dyn std::error::Error>> {
        let rows = self.curves.len().max(1);
        let size = (WIDTH, ROW_HEIGHT * rows as u32);
        let area = SVGBackend::with_string(svg, size).into_drawing_area();
        area.fill(&WHITE)?;
        for (row, curve) in area.split_evenly((rows, 1)).iter().zip(&self.curves) {
            let (left, right) = row.split_horizontally(WIDTH / 2);
            let measured: Vec<_> = curve
                .points
                .iter()
                .map(|(x, seen, _)| (*x, *seen))
                .collect();
            let modelled: Vec<_> = curve
                .points
                .iter()
                .map(|(x, _, model)| (*x, *model))
                .collect();
            let rest: Vec<_> = curve
                .points
                .iter()
                .map(|(x, seen, model)| (*x, seen - model))
                .collect();
            let title = format!("{}: measured (dots), model (line)", curve.experiment);
            let lines = [(&modelled[..], INK)];
            panel(
                &left,
                &title,
                (curve.x_name, self.y_name),
                &lines,
                &[(&measured[..], MEASURED)],
            )?;
            let title = "measured less model";
            panel(
                &right,
                title,
                (curve.x_name, self.y_name),
                &[],
                &[(&rest[..], ERROR)],
            )?;
        }
        area.present()?;
        Ok(())
    }
}
