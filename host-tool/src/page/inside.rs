//! What a page carries: JSON, compressed, as text.

use std::io::{Read, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use lab_view::{Chosen, Opening};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::tried::Tried;

/// The format of [`Inside`] that this tool writes and reads.
const FORMAT: u32 = 1;
/// What is around it in the page.
const OPEN: &str = r#"<script type="application/gzip" id="inside">"#;
const CLOSE: &str = "</script>";
/// The most that it may be, unpacked (bytes): a thousand times a page's session. What claims to be more is no report.
const MOST: u64 = 500_000_000;

/// A fitted model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FittedModel {
    /// What it is called in the page.
    pub(crate) name: String,
    /// The model.
    pub(crate) toml: String,
    /// Its effects, as the page's switches have them.
    pub(crate) effects: Vec<Chosen>,
}

/// What a page carries.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Inside {
    format: u32,
    /// Version of the tool that wrote it.
    pub(crate) version: String,
    /// What was evaluated.
    pub(crate) opening: Opening,
    /// Rows of the session that were left out before.
    pub(crate) rows_left_out: usize,
    /// What a board reached with a calibration, where that was asked for.
    #[serde(default)]
    pub(crate) tried: Option<Tried>,
    /// The fitted models: without any effect that was found missing, then with each.
    pub(crate) models: Vec<FittedModel>,
    /// The diagnosis, and the comparison with each model.
    pub(crate) results: Value,
}

impl Inside {
    pub(super) fn new(
        opening: Opening,
        rows_left_out: usize,
        tried: Option<Tried>,
        models: Vec<FittedModel>,
        results: Value,
    ) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            opening,
            rows_left_out,
            tried,
            models,
            results,
        }
    }

    /// As an element of the page.
    pub(super) fn to_element(&self) -> String {
        let json = serde_json::to_vec(self).expect("plain data");
        format!("{OPEN}{}{CLOSE}", STANDARD.encode(packed(&json)))
    }

    /// From a page.
    ///
    /// # Errors
    /// Why it cannot be read, to follow "is no whole report: ".
    pub(crate) fn read(page: &[u8]) -> Result<Self, String> {
        let page = std::str::from_utf8(page).map_err(|_| "it is not text")?;
        let (_, rest) = page.split_once(OPEN).ok_or("it holds no session")?;
        let (packed, later) = rest.split_once(CLOSE).ok_or("it ends in the middle")?;
        // What lies behind is what a browser computes with.
        if !later.trim_end().ends_with("</html>") {
            return Err("it ends in the middle".into());
        }
        let packed = STANDARD
            .decode(packed)
            .map_err(|_| "its session is damaged")?;
        let mut json = Vec::new();
        GzDecoder::new(&packed[..])
            .take(MOST)
            .read_to_end(&mut json)
            .map_err(|_| "its session is damaged")?;
        let json: Value = serde_json::from_slice(&json).map_err(|_| "its session is damaged")?;
        match json["format"].as_u64() {
            Some(format) if format == u64::from(FORMAT) => {}
            Some(format) => {
                return Err(format!("it has format {format}, this tool reads {FORMAT}"));
            }
            None => return Err("its session is damaged".into()),
        }
        serde_json::from_value(json).map_err(|error| format!("its session is damaged, {error}"))
    }
}

/// A page before what it carries and after it; all of it before, where it carries nothing.
pub(super) fn around(page: &str) -> [&str; 2] {
    let (before, rest) = page.split_once(OPEN).unwrap_or((page, ""));
    let (_, after) = rest.split_once(CLOSE).unwrap_or_default();
    [before, after]
}

/// Compressed, as browsers unpack it.
pub(super) fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::best());
    let packed = packer.write_all(bytes).and_then(|()| packer.finish());
    packed.expect("writing to memory does not fail")
}

#[cfg(test)]
mod tests {
    use super::*;
    use lab_view::MeasuredText;

    fn inside() -> Inside {
        let opening = Opening {
            model: "preset".into(),
            files: vec![MeasuredText {
                name: "a</script>.csv".into(),
                text: "t_s,V_V\n0,0\n1,0.1\n".repeat(50),
            }],
            own_effects: vec![],
        };
        let models = vec![FittedModel {
            name: "fitted".into(),
            toml: String::new(),
            effects: vec![Chosen {
                id: "creep".into(),
                form: String::new(),
                values: vec![0.1 + 0.2, 1.0 / 3.0, 5e-324],
            }],
        }];
        Inside::new(
            opening,
            3,
            None,
            models,
            serde_json::json!({"misfit": 0.1 + 0.2}),
        )
    }

    #[test]
    fn what_goes_into_a_page_comes_out_to_the_last_bit() {
        let page = format!("<html><p>{}</p></html>", inside().to_element());
        assert_eq!(Inside::read(page.as_bytes()), Ok(inside()));
        assert_eq!(
            around(&page).map(str::len),
            ["<html><p>".len(), "</p></html>".len()]
        );
    }

    #[test]
    fn what_is_cut_changed_or_no_report_is_told() {
        let page = format!("<html>{}</html>", inside().to_element());
        let said = |page: &str| Inside::read(page.as_bytes()).expect_err("not whole");
        assert!(said("<html></html>").contains("holds no session"));
        for cut in [60, 200, page.len() - "</html>".len()] {
            assert!(said(&page[..cut]).contains("ends in the middle"));
        }
        // A byte of the compressed data, far from both ends.
        let at = page.find("</script>").expect("an end") - 40;
        let other = if &page[at..=at] == "A" { "B" } else { "A" };
        let changed = format!("{}{other}{}", &page[..at], &page[at + 1..]);
        assert!(said(&changed).contains("damaged"));
        assert!(
            Inside::read(&[0xff, 0xfe])
                .expect_err("no text")
                .contains("not text")
        );
        let mut newer = inside();
        newer.format = 9;
        let newer = format!("{}</html>", newer.to_element());
        assert!(said(&newer).contains("format 9"));
    }
}
