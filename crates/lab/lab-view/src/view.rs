//! A model and a session as a page shows them: charts, and errors with the digits that `host-tool compare` prints.

use crate::curves::Curves;
use charts::{Look, Panel, Series};
use identification::prediction::predict;
use identification::{Comparison, Dataset, StageErrors, compare_predicted};
use mirror_model::{Model, Runaway};
use serde::Serialize;

/// What is shown of a model and a session.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct View {
    /// The error over the whole session, root mean square with its unit.
    pub error: String,
    /// That of the currents, where they were measured beside a displacement.
    pub current_error: Option<String>,
    /// By experiment.
    pub experiments: Vec<ExperimentView>,
    /// By stage, where currents were measured.
    pub stages: Vec<StageView>,
    /// What a person would say.
    pub sentences: Vec<String>,
}

/// One experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExperimentView {
    /// Its name.
    pub experiment: String,
    /// Root mean square of the error, in the session's unit.
    pub rms: String,
    /// The largest error, with its sign.
    pub largest: String,
    /// The root mean square in percent of the experiment's span, where something moves.
    pub percent_of_span: Option<String>,
    /// Root mean square of the currents' error (mA), where they were measured.
    pub current_rms: Option<String>,
    /// Measured and modelled, and what is left: two `svg` elements, or none of an experiment of one reading.
    pub charts: Vec<String>,
}

/// One stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageView {
    /// Its name.
    pub stage: &'static str,
    /// What its error is of.
    pub what: &'static str,
    /// The error, with its unit.
    pub error: String,
    /// The error over the warming, an `svg` element, where there are points of it.
    pub chart: Option<String>,
}

impl View {
    /// Of a model as it is.
    ///
    /// # Errors
    /// [`Runaway`] if it has no finite answer.
    pub fn new(model: &Model, data: &Dataset) -> Result<Self, Runaway> {
        let predicted = predict(model, data)?;
        let compared = compare_predicted(model, data, &predicted);
        let curves = Curves::new(data, &predicted);
        let unit = micro(&compared.unit.to_string());
        Ok(Self {
            error: format!("{:.3} {unit}", compared.rms),
            current_error: compared
                .current_rms_ma
                .filter(|_| data.has_displacement())
                .map(|rms| format!("{rms:.4} mA")),
            experiments: experiments(&compared, &curves),
            stages: stages(&compared.stages),
            sentences: compared.sentences.iter().map(|said| micro(said)).collect(),
        })
    }
}

/// Text with the micrometre as it is written in print.
fn micro(text: &str) -> String {
    let words = text.split(' ').map(|word| match word.strip_prefix("um") {
        Some(rest) if !rest.starts_with(|c: char| c.is_alphanumeric()) => format!("µm{rest}"),
        _ => word.to_owned(),
    });
    words.collect::<Vec<_>>().join(" ")
}

fn experiments(compared: &Comparison, curves: &Curves) -> Vec<ExperimentView> {
    let panels = curves.panels();
    let charts = |name: &str| {
        let of_it = curves.curves.iter().zip(&panels);
        let mut of_it = of_it.filter(|(curve, _)| curve.experiment == name);
        let drawn = of_it.next().map(|(_, panels)| panels.each_ref());
        drawn.map_or(Vec::new(), |panels| panels.map(Panel::to_svg).into())
    };
    let view = |e: &identification::ExperimentError| ExperimentView {
        experiment: e.experiment.clone(),
        rms: format!("{:.3}", e.rms),
        largest: format!("{:+.3}", e.largest),
        percent_of_span: e.percent_of_span.map(|percent| format!("{percent:.2}")),
        current_rms: e.current_rms_ma.map(|rms| format!("{rms:.4}")),
        charts: charts(&e.experiment),
    };
    compared.experiments.iter().map(view).collect()
}

fn stages(errors: &StageErrors) -> Vec<StageView> {
    let chart = |title: &str, y: &str, points: Vec<(f64, f64)>| {
        let panel = Panel {
            title: title.into(),
            x: "modelled warming (K)".into(),
            y: y.into(),
            series: vec![Series {
                name: "measured less model, steady drives".into(),
                look: Look::Residual,
                points,
            }],
        };
        (!panel.series[0].points.is_empty()).then(|| panel.to_svg())
    };
    let points = errors.points.iter();
    let cold = errors.r_at_low_v_percent.map(|percent| StageView {
        stage: "resistance",
        what: "R at low drives, mean",
        error: format!("{percent:+.2} %"),
        chart: None,
    });
    let heat = errors.r_at_equal_p_percent.map(|percent| StageView {
        stage: "heat",
        what: "R at equal power, rms",
        error: format!("{percent:.2} %"),
        chart: chart(
            "heat",
            "residual of R at equal power (%)",
            points
                .clone()
                .map(|p| (p.warming_k, p.r_at_equal_p_percent))
                .collect(),
        ),
    });
    let shape = errors.z_at_equal_r_um.map(|um| StageView {
        stage: "curvature, shape, memory or sensor",
        what: "z at equal R, rms",
        error: format!("{um:.2} µm"),
        chart: chart(
            "curvature, shape, memory or sensor",
            "residual of z at equal R (µm)",
            points
                .filter_map(|p| Some((p.warming_k, p.z_at_equal_r_um?)))
                .collect(),
        ),
    });
    [cold, heat, shape].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn micrometres_are_written_as_in_print_and_words_stay() {
        assert_eq!(
            micro("0.52 um, sum of 3 um; umbra"),
            "0.52 µm, sum of 3 µm; umbra"
        );
    }
}
