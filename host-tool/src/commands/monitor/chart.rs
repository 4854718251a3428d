//! The recent past as curves.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};

use super::state::{PAST_S, Point, State};

/// An axis spans at least so much, so that noise does not fill it: micrometres, and kelvins.
const LEAST_SPAN: f64 = 2.0;
const ACTUATORS: [Color; 4] = [Color::Cyan, Color::Yellow, Color::Green, Color::Magenta];

/// Seconds before now, and a value.
type Curve = Vec<(f64, f64)>;

/// Where the plate is asked to be, as a line, and what the sensor reads, as dots.
pub(super) fn draw_position(state: &State, frame: &mut Frame, area: Rect) {
    let pose = curve(state, |point| Some(point.pose_um));
    let sensor = curve(state, |point| point.sensor_um);
    let title = match sensor.is_empty() {
        true => "z (um): pose",
        false => "z (um): line pose, dots sensor",
    };
    let line = Dataset::default()
        .marker(Marker::Braille)
        .graph_type(GraphType::Line)
        .style(Style::new().fg(Color::Cyan))
        .data(&pose);
    let dots = Dataset::default()
        .marker(Marker::Dot)
        .graph_type(GraphType::Scatter)
        .style(Style::new().fg(Color::Yellow))
        .data(&sensor);
    let bounds = bounds(&[&pose, &sensor]);
    draw(vec![line, dots], bounds, title, frame, area);
}

/// Temperature rises of the four actuators.
pub(super) fn draw_rises(state: &State, frame: &mut Frame, area: Rect) {
    let curves: [Curve; 4] = std::array::from_fn(|i| curve(state, |point| point.rise_k[i]));
    let datasets = curves.iter().zip(ACTUATORS).map(|(curve, colour)| {
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(colour))
            .data(curve)
    });
    let bounds = bounds(&curves.each_ref().map(Vec::as_slice));
    draw(datasets.collect(), bounds, "temp. rise (K)", frame, area);
}

fn curve(state: &State, value: impl Fn(&Point) -> Option<f64>) -> Curve {
    let points = state.past.iter();
    let of = |point: &Point| Some((-state.age_s(point.tick), value(point)?));
    points
        .filter_map(of)
        .filter(|(_, value)| value.is_finite())
        .collect()
}

/// Lowest and highest value, apart by [`LEAST_SPAN`] at least.
fn bounds(curves: &[&[(f64, f64)]]) -> [f64; 2] {
    let values = || {
        curves
            .iter()
            .flat_map(|curve| curve.iter().map(|(_, value)| *value))
    };
    let low = values().min_by(f64::total_cmp).unwrap_or_default();
    let high = values().max_by(f64::total_cmp).unwrap_or_default();
    let missing = (LEAST_SPAN - (high - low)).max(0.0);
    [low - 0.5 * missing, high + 0.5 * missing]
}

fn draw(
    datasets: Vec<Dataset>,
    [low, high]: [f64; 2],
    title: &'static str,
    frame: &mut Frame,
    area: Rect,
) {
    let seconds = Axis::default()
        .bounds([-PAST_S, 0.0])
        .labels([format!("-{PAST_S:.0} s"), "now".to_owned()]);
    let values = Axis::default()
        .bounds([low, high])
        .labels([format!("{low:.1}"), format!("{high:.1}")]);
    let chart = Chart::new(datasets)
        .block(Block::bordered().title(title))
        .legend_position(None)
        .x_axis(seconds)
        .y_axis(values);
    frame.render_widget(chart, area);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_holds_its_values_and_noise_does_not_fill_it() {
        assert_eq!(bounds(&[]), [-1.0, 1.0]);
        assert_eq!(bounds(&[&[(0.0, 5.0)], &[(0.0, 5.5)]]), [4.25, 6.25]);
        assert_eq!(bounds(&[&[(0.0, -3.0), (0.0, 90.0)]]), [-3.0, 90.0]);
    }
}
