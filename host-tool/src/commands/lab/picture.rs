//! Measured and modelled curves with what is left between them: in the terminal, and as SVG.

use charts::sheet;
use lab_view::Curves;

use crate::picture::text_plot;

/// What is left, experiment by experiment, as dots.
pub(super) fn in_the_terminal(curves: &Curves) -> String {
    let (quantity, unit) = (curves.quantity, curves.unit);
    let plots = curves.curves.iter().map(|curve| {
        let points = curve.points.iter();
        let left: Vec<_> = points.map(|(x, seen, model)| (*x, seen - model)).collect();
        let title = format!(
            "{}: measured less modelled, {quantity} ({unit}) against {}",
            curve.experiment, curve.x_name
        );
        text_plot(&title, &left)
    });
    plots.collect()
}

/// A row for every experiment: both curves on the left, what is left on the right.
pub(super) fn as_svg(curves: &Curves) -> String {
    let rows: Vec<_> = curves.panels().into_iter().map(Vec::from).collect();
    sheet(&rows)
}
