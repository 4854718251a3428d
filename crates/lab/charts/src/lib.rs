//! Charts as SVG, with one look: what was measured is dots, a model is a line, on paper and without colour too.
//!
//! [`Panel`] is a chart of two axes; [`Strips`] sets one number against a distribution, row by row. Either is one `svg` element
//! for a page that has [`STYLE`]; [`sheet`] makes a file of several that stands alone.

mod axis;
mod panel;
mod sheet;
mod strips;

pub use panel::{LINES, Look, Panel, Series};
pub use sheet::sheet;
pub use strips::{Strip, Strips};

/// The style sheet of all charts: light and dark, and black on white on paper. It has plain colours and classes only, for what shows
/// SVG beside browsers (Inkscape, librsvg, office programs) knows neither custom properties nor media, and sees the light one.
pub const STYLE: &str = include_str!("style.css");

/// Text as SVG and HTML have it.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // What XML cannot hold.
            c if c.is_control() && c != '\n' && c != '\t' => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_knows_no_custom_properties_sees_every_colour() {
        assert!(!STYLE.contains("var(") && !STYLE.contains("--"));
    }

    #[test]
    fn text_is_no_markup() {
        assert_eq!(
            escaped("a<b & \"c\">\u{1}"),
            "a&lt;b &amp; &quot;c&quot;&gt;\u{fffd}"
        );
    }
}
