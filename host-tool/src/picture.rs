//! Plots in the terminal.

use std::fmt::Write;
use std::ops::Range;

const TERMINAL_WIDTH: usize = 64;
const TERMINAL_HEIGHT: usize = 9;

/// Dots in the terminal, under a title, with the extremes beside them.
pub(crate) fn text_plot(title: &str, points: &[(f64, f64)]) -> String {
    let (across, up) = (
        range(points.iter().map(|(x, _)| *x)),
        range(points.iter().map(|(_, y)| *y)),
    );
    let mut cells = vec![vec![' '; TERMINAL_WIDTH]; TERMINAL_HEIGHT];
    let place = |value: f64, range: &Range<f64>, cells: usize| {
        let part = (value - range.start) / (range.end - range.start);
        ((part * cells as f64) as usize).min(cells - 1)
    };
    if up.contains(&0.0) {
        cells[TERMINAL_HEIGHT - 1 - place(0.0, &up, TERMINAL_HEIGHT)].fill('-');
    }
    for (x, y) in points {
        let row = TERMINAL_HEIGHT - 1 - place(*y, &up, TERMINAL_HEIGHT);
        cells[row][place(*x, &across, TERMINAL_WIDTH)] = '*';
    }
    let mut plot = format!("\n  {title}\n");
    for (number, row) in cells.iter().enumerate() {
        let label = match number {
            0 => format!("{:>10.3}", up.end),
            last if last == TERMINAL_HEIGHT - 1 => format!("{:>10.3}", up.start),
            _ => " ".repeat(10),
        };
        let line: String = row.iter().collect();
        let _ = writeln!(plot, "{label} |{}", line.trim_end());
    }
    let _ = writeln!(plot, "{:>10}  {:<32}{:>32}", "", across.start, across.end);
    plot
}

/// From the smallest to the largest value, and a little more where they are one.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    if low < high {
        low..high
    } else {
        low.min(0.0)..high.max(0.0) + 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rising_line_goes_from_bottom_left_to_top_right() {
        let points: Vec<_> = (0..=100).map(|i| (f64::from(i), f64::from(i))).collect();
        let plot = text_plot("rising", &points);
        let rows: Vec<&str> = plot.lines().filter(|line| line.contains('|')).collect();
        assert!(rows[0].ends_with('*') && rows[0].trim_start().starts_with("100.000 |"));
        assert!(rows[TERMINAL_HEIGHT - 1].contains("0.000 |*"));
    }

    #[test]
    fn one_value_or_none_is_drawn_too() {
        assert!(text_plot("flat", &[(1.0, 2.0), (1.0, 2.0)]).contains('*'));
        assert!(!text_plot("empty", &[]).contains('*'));
    }
}
