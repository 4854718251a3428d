//! A file of several charts.

use crate::STYLE;
use crate::panel::{HEIGHT, Panel, WIDTH};
use std::fmt::Write;

/// A file with rows of panels, which stands alone.
pub fn sheet(rows: &[Vec<Panel>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let (width, height) = (WIDTH * columns as f64, HEIGHT * rows.len() as f64);
    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}"><style>{STYLE}.ground{{fill:#fff}}@media (prefers-color-scheme:dark){{.ground{{fill:#14181d}}}}</style><rect class="ground" width="{width}" height="{height}"/>"#
    );
    for (row, panels) in rows.iter().enumerate() {
        for (column, panel) in panels.iter().enumerate() {
            let (x, y) = (WIDTH * column as f64, HEIGHT * row as f64);
            let place = format!(r#"<svg x="{x}" y="{y}" width="{WIDTH}" height="{HEIGHT}" "#);
            let drawn = panel.to_svg();
            let content = drawn.strip_prefix("<svg ").unwrap_or(&drawn);
            let _ = write!(svg, "{place}{content}");
        }
    }
    svg.push_str("</svg>\n");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_its_panels_side_by_side() {
        let panel = Panel {
            title: "t".into(),
            x: "x".into(),
            y: "y".into(),
            series: vec![],
        };
        let svg = sheet(&[vec![panel.clone(), panel.clone()], vec![panel]]);
        assert!(svg.starts_with("<svg xmlns") && svg.contains(r#"viewBox="0 0 920 520""#));
        assert!(svg.contains(r#"<svg x="460" y="0" "#) && svg.contains(r#"<svg x="0" y="260" "#));
        assert_eq!(svg.matches("<svg").count(), svg.matches("</svg>").count());
    }
}
