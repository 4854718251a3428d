//! Numbers against distributions: a row each, on one logarithmic axis.

use crate::escaped;
use crate::panel::opening;
use std::fmt::Write;

const WIDTH: f64 = 760.0;
/// Of a row.
const ROW: f64 = 22.0;
const LEFT: f64 = 170.0;
/// Where 0 lies: beside the frame, so that dots there are seen.
const ZERO: f64 = LEFT + 12.0;
const RIGHT: f64 = WIDTH - 16.0;
const TOP: f64 = 34.0;
/// How far the dots of a distribution lie from the middle of their row at most, so that many alike are seen to be many.
const SPREAD: f64 = 5.0;
/// Rows over which the dots are spread: a sequence without a pattern to the eye, the golden ratio's multiples.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// One number, what is compared with it, and from where on it counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// What it is of.
    pub name: String,
    /// The number, 0 or more.
    pub score: f64,
    /// From where on it counts.
    pub threshold: f64,
    /// The distribution where nothing is there.
    pub null: Vec<f64>,
}

/// Rows on one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Strips {
    /// Name of the axis.
    pub x: String,
    /// The rows, from above.
    pub strips: Vec<Strip>,
}

impl Strips {
    /// The chart as an `svg` element, for a page that has [`STYLE`](crate::STYLE).
    pub fn to_svg(&self) -> String {
        let bottom = TOP + ROW * self.strips.len() as f64;
        let height = bottom + 40.0;
        let numbers = self.strips.iter().flat_map(|strip| {
            let finite = [strip.score, strip.threshold];
            finite.into_iter().chain(strip.null.iter().copied())
        });
        let largest = numbers.filter(|n| n.is_finite()).fold(10.0, f64::max);
        let decades = (1.0 + largest).log10().ceil();
        let place = |value: f64| ZERO + (1.0 + value.max(0.0)).log10() / decades * (RIGHT - ZERO);
        let mut svg = opening(
            WIDTH,
            height,
            &format!(
                "{} of each effect, against its null distribution and threshold",
                self.x
            ),
        );
        legend(&mut svg);
        for value in std::iter::once(0.0).chain((0..=decades as i32).map(|d| 10.0_f64.powi(d))) {
            let at = place(value);
            if at > RIGHT {
                continue;
            }
            let _ = write!(
                svg,
                r#"<path class="grid" d="M{at:.2} {TOP}V{bottom}"/><text class="tick" text-anchor="middle" x="{at:.2}" y="{}">{value}</text>"#,
                bottom + 14.0
            );
        }
        for (row, strip) in self.strips.iter().enumerate() {
            let middle = TOP + ROW * (row as f64 + 0.5);
            draw(&mut svg, strip, middle, place);
        }
        let _ = write!(
            svg,
            r#"<path class="frame" d="M{LEFT} {TOP}H{RIGHT}V{bottom}H{LEFT}Z"/><text text-anchor="middle" x="{}" y="{}">{}</text></svg>"#,
            0.5 * (LEFT + RIGHT),
            height - 8.0,
            escaped(&self.x)
        );
        svg
    }
}

fn legend(svg: &mut String) {
    let (a, b, c) = (LEFT, LEFT + 220.0, LEFT + 330.0);
    let _ = write!(
        svg,
        r#"<path class="null" d="M{} 15h0M{} 18h0M{} 13h0"/><text x="{}" y="19">mirrors that lack nothing (null)</text>"#,
        a + 2.0,
        a + 8.0,
        a + 14.0,
        a + 22.0
    );
    let _ = write!(
        svg,
        r#"<path class="threshold" d="M{b} 8v14"/><text x="{}" y="19">threshold</text>{}<text x="{}" y="19">this session</text>"#,
        b + 8.0,
        diamond(c, 15.0, "score"),
        c + 12.0
    );
}

fn draw(svg: &mut String, strip: &Strip, middle: f64, place: impl Fn(f64) -> f64) {
    let mut dots = String::new();
    for (index, value) in strip
        .null
        .iter()
        .filter(|value| value.is_finite())
        .enumerate()
    {
        let off = 2.0 * (GOLDEN * index as f64).fract() - 1.0;
        let _ = write!(dots, "M{:.1} {:.1}h0", place(*value), middle + SPREAD * off);
    }
    let _ = write!(
        svg,
        r#"<text text-anchor="end" x="{}" y="{:.1}">{}</text><path class="null" d="{dots}"/>"#,
        LEFT - 8.0,
        middle + 4.0,
        escaped(&strip.name)
    );
    if strip.threshold.is_finite() {
        let at = place(strip.threshold);
        let _ = write!(
            svg,
            r#"<path class="threshold" d="M{at:.1} {:.1}v16"/>"#,
            middle - 8.0
        );
    }
    if strip.score.is_finite() {
        let class = if strip.score > strip.threshold {
            "above"
        } else {
            "score"
        };
        svg.push_str(&diamond(place(strip.score), middle, class));
    }
}

fn diamond(x: f64, y: f64, class: &str) -> String {
    format!(
        r#"<path class="{class}" d="M{:.1} {y:.1}l5.5-5.5 5.5 5.5-5.5 5.5Z"/>"#,
        x - 5.5
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_beyond_its_threshold_lies_right_of_it_and_looks_other() {
        let strip = |name: &str, score| Strip {
            name: name.into(),
            score,
            threshold: 62.3,
            null: vec![0.0, 1.0, 9.0, f64::INFINITY],
        };
        let strips = Strips {
            x: "score".into(),
            strips: vec![strip("creep & co", 99_999.0), strip("none", 0.0)],
        };
        let svg = strips.to_svg();
        assert_eq!(svg.matches(r#"class="above""#).count(), 1);
        assert!(svg.contains("creep &amp; co") && !svg.contains("inf"));
        // Five decades on 562 units from 182: a null score of 9 is at one fifth.
        assert!(svg.contains("M294.4 "), "{svg}");
        assert!(svg.contains(r#"class="above" d="M738.5"#), "{svg}");
    }
}
