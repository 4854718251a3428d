//! A chart of two axes.

use crate::axis::Axis;
use crate::escaped;
use std::collections::HashSet;
use std::fmt::Write;

/// Size of a panel, in the units of its drawing.
pub(crate) const WIDTH: f64 = 460.0;
pub(crate) const HEIGHT: f64 = 260.0;
/// Where the frame lies in it.
const LEFT: f64 = 56.0;
const RIGHT: f64 = WIDTH - 10.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = HEIGHT - 42.0;
/// Dots in one square of this size are drawn once: nobody sees the second.
const SAME: f64 = 0.5;
/// From one entry of the legend to the next: its sign, and so much a letter.
const SIGN: f64 = 26.0;
const LETTER: f64 = 6.0;

/// How points are drawn: by form first, by colour besides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// What was measured: dots.
    Measured,
    /// What a model says, or what was asked for: a line.
    Model,
    /// What is left between the two: small dots, about a line at zero.
    Residual,
    /// One of several lines, told apart by their dashes; there are [`LINES`] of them.
    Line(usize),
}

/// Lines of one panel that are told apart.
pub const LINES: usize = 4;

impl Look {
    fn class(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Model => "model",
            Self::Residual => "residual",
            Self::Line(number) => ["line-0", "line-1", "line-2", "line-3"][number % LINES],
        }
    }

    fn is_line(self) -> bool {
        matches!(self, Self::Model | Self::Line(_))
    }
}

/// Points of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// What they are, for the legend.
    pub name: String,
    /// How they are drawn.
    pub look: Look,
    /// Abscissa and ordinate, in the order in which a line joins them. Points that are not finite are left out.
    pub points: Vec<(f64, f64)>,
}

/// A chart of two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What stands above it.
    pub title: String,
    /// Name and unit of the abscissa.
    pub x: String,
    /// Name and unit of the ordinate.
    pub y: String,
    /// What it shows; lines lie above dots.
    pub series: Vec<Series>,
}

impl Panel {
    /// The chart as an `svg` element, for a page that has [`STYLE`](crate::STYLE).
    pub fn to_svg(&self) -> String {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let x = Axis::holding(points().map(|point| point.0), LEFT..RIGHT);
        let is_residual = |series: &Series| series.look == Look::Residual;
        // What is left is seen against nothing left.
        let zero = self.series.iter().any(is_residual).then_some(0.0);
        let y = Axis::holding(points().map(|point| point.1).chain(zero), BOTTOM..TOP);
        let mut svg = opening(
            WIDTH,
            HEIGHT,
            &format!("{}: {} against {}", self.title, self.y, self.x),
        );
        let _ = write!(
            svg,
            r#"<text class="title" x="{LEFT}" y="14">{}</text>"#,
            escaped(&self.title)
        );
        self.legend(&mut svg);
        for (value, text) in x.ticks() {
            let at = x.place(value);
            let _ = write!(
                svg,
                r#"<path class="grid" d="M{at:.2} {TOP}V{BOTTOM}"/><text class="tick" text-anchor="middle" x="{at:.2}" y="{:.0}">{text}</text>"#,
                BOTTOM + 14.0
            );
        }
        for (value, text) in y.ticks() {
            let at = y.place(value);
            let _ = write!(
                svg,
                r#"<path class="grid" d="M{LEFT} {at:.2}H{RIGHT}"/><text class="tick" text-anchor="end" x="{:.0}" y="{:.2}">{text}</text>"#,
                LEFT - 5.0,
                at + 3.5
            );
        }
        if let Some(zero) = zero {
            let _ = write!(
                svg,
                r#"<path class="zero" d="M{LEFT} {:.2}H{RIGHT}"/>"#,
                y.place(zero)
            );
        }
        let _ = write!(
            svg,
            r#"<path class="frame" d="M{LEFT} {TOP}H{RIGHT}V{BOTTOM}H{LEFT}Z"/>"#
        );
        let (dots, lines): (Vec<_>, Vec<_>) = self
            .series
            .iter()
            .partition(|series| !series.look.is_line());
        for series in dots.into_iter().chain(lines) {
            let class = series.look.class();
            let path = path(series, &x, &y);
            let _ = write!(svg, r#"<path class="{class}" d="{path}"/>"#);
        }
        let middle = 0.5 * (TOP + BOTTOM);
        let _ = write!(
            svg,
            r#"<text text-anchor="middle" x="{:.0}" y="{:.0}">{}</text><text text-anchor="middle" transform="translate(13 {middle:.0})rotate(-90)">{}</text></svg>"#,
            0.5 * (LEFT + RIGHT),
            HEIGHT - 8.0,
            escaped(&self.x),
            escaped(&self.y)
        );
        svg
    }

    fn legend(&self, svg: &mut String) {
        let mut at = LEFT;
        for series in &self.series {
            let class = series.look.class();
            let sign = match series.look.is_line() {
                true => format!("M{at:.1} 29h18"),
                false => format!(
                    "M{:.1} 29h0M{:.1} 29h0M{:.1} 29h0",
                    at + 2.0,
                    at + 9.0,
                    at + 16.0
                ),
            };
            let _ = write!(
                svg,
                r#"<path class="{class}" d="{sign}"/><text x="{:.1}" y="33">{}</text>"#,
                at + 22.0,
                escaped(&series.name)
            );
            at += SIGN + LETTER * series.name.chars().count() as f64 + 10.0;
        }
    }
}

/// An `svg` element of this size up to its content, with what a screen reader says of it.
pub(crate) fn opening(width: f64, height: f64, label: &str) -> String {
    format!(
        r#"<svg class="chart" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" aria-label="{}">"#,
        escaped(label)
    )
}

/// The path of a line, or of dots, each a line of no length with round ends.
fn path(series: &Series, x: &Axis, y: &Axis) -> String {
    let is_finite = |point: &&(f64, f64)| point.0.is_finite() && point.1.is_finite();
    let places = series.points.iter().filter(is_finite);
    let places = places.map(|(a, b)| (x.place(*a), y.place(*b)));
    let mut path = String::new();
    let mut seen = HashSet::new();
    for (a, b) in places {
        let _ = match series.look {
            look if look.is_line() && path.is_empty() => write!(path, "M{a:.2} {b:.2}"),
            look if look.is_line() => write!(path, "L{a:.2} {b:.2}"),
            _ if seen.insert(((a / SAME) as i32, (b / SAME) as i32)) => {
                write!(path, "M{a:.1} {b:.1}h0")
            }
            _ => Ok(()),
        };
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(points: Vec<(f64, f64)>) -> String {
        let series = |look, name: &str| Series {
            name: name.into(),
            look,
            points: points.clone(),
        };
        let panel = Panel {
            title: "sweep <1>".into(),
            x: "drive (V)".into(),
            y: "z (µm)".into(),
            series: vec![
                series(Look::Measured, "measured"),
                series(Look::Model, "model"),
            ],
        };
        panel.to_svg()
    }

    #[test]
    fn measured_and_model_differ_in_form() {
        let svg = panel(vec![(0.0, 0.0), (1.0, 10.0)]);
        assert!(svg.contains("sweep &lt;1&gt;") && !svg.contains("<1>"));
        assert!(
            svg.contains(r#"class="measured" d="M70.6 211.6h0M435.4 50.4h0""#),
            "{svg}"
        );
        assert!(
            svg.contains(r#"class="model" d="M70.59 211.56L435.41 50.44""#),
            "{svg}"
        );
    }

    #[test]
    fn several_lines_differ_in_form() {
        let line = |number| Series {
            name: format!("channel {number}"),
            look: Look::Line(number),
            points: vec![(0.0, number as f64), (1.0, 3.0)],
        };
        let panel = Panel {
            title: "t".into(),
            x: "x".into(),
            y: "y".into(),
            series: (0..LINES).map(line).collect(),
        };
        let svg = panel.to_svg();
        for number in 0..LINES {
            let class = format!("class=\"line-{number}\"");
            // In the legend and in the frame.
            assert_eq!(svg.matches(&class).count(), 2, "{svg}");
            assert!(crate::STYLE.contains(&format!(".line-{number} ")));
        }
    }

    #[test]
    fn what_is_left_is_seen_against_zero() {
        let panel = |look| Panel {
            title: "t".into(),
            x: "x".into(),
            y: "y".into(),
            series: vec![Series {
                name: "left".into(),
                look,
                points: vec![(0.0, -3.0), (1.0, -4.0)],
            }],
        };
        assert!(panel(Look::Residual).to_svg().contains(">0</text>"));
        assert!(!panel(Look::Model).to_svg().contains(">0</text>"));
    }

    #[test]
    fn dots_on_dots_are_drawn_once_and_rubbish_not_at_all() {
        let mut points = vec![
            (0.0, 0.0),
            (1.0, 1.0),
            (f64::NAN, 1.0),
            (1.0, f64::INFINITY),
        ];
        points.extend((0..100_000).map(|index| (1e-6 * f64::from(index), 0.5)));
        let svg = panel(points);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        let dots = svg.split("class=\"measured\"").nth(2).expect("dots");
        let dots = dots.split('"').nth(1).expect("a path");
        // 0.1 of the width is 36 units, two dots each; and two corners.
        assert!(
            dots.matches('M').count() < 80,
            "{}",
            dots.matches('M').count()
        );
    }

    #[test]
    fn nothing_at_all_is_an_empty_frame() {
        assert!(panel(vec![]).contains(r#"class="frame""#));
    }
}
