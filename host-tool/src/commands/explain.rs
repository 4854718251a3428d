//! `explain`: what a fault or a limit is, its cause, and its remedy. The pages are those of the docs.

use std::fmt;

use serde::Serialize;

use crate::error::ToolError;
use crate::names::nearest;
use crate::report;

/// The pages of these names in `docs/faults`.
macro_rules! pages {
    [$($name:literal),* $(,)?] => {
        [$(($name, include_str!(concat!("../../../docs/faults/", $name, ".md")))),*]
    };
}

/// Name and page, by name.
const PAGES: [(&str, &str); 27] = pages![
    "calibration-bad",
    "calibration-drifted",
    "calibration-outdated",
    "cooling",
    "drive-high",
    "drive-low",
    "firmware-panic",
    "frozen-sense",
    "hard-fault",
    "implausible-sense",
    "lease-lapsed",
    "not-a-number",
    "open-heater",
    "output-over-voltage",
    "over-current",
    "over-temperature",
    "position-high",
    "position-low",
    "power-high",
    "resistance-unknown",
    "room-warm",
    "short-circuit",
    "supply-out-of-range",
    "temperature-high",
    "tick-overrun",
    "tilt-unknown",
    "watchdog-reset",
];

#[derive(Serialize)]
struct Explanation {
    name: &'static str,
    page: &'static str,
}

/// Prints the page of `name`, or the names that there are.
pub(super) fn run(name: Option<&str>, json: bool) -> Result<(), ToolError> {
    let Some(name) = name else {
        let names = PAGES.map(|(name, _)| name).to_vec();
        report::print(&Names { names }, json);
        return Ok(());
    };
    let found = PAGES.into_iter().find(|(known, _)| *known == name);
    let (name, page) = found.ok_or_else(|| ToolError::NoSuchFault {
        name: name.to_owned(),
        nearest: nearest(name, PAGES.iter().map(|(name, _)| name)),
    })?;
    report::print(&Explanation { name, page }, json);
    Ok(())
}

/// What has happened where a fault or a limit of this name is told: the first sentence of its page.
pub(super) fn sentence(name: &str) -> Option<String> {
    let (_, page) = PAGES.into_iter().find(|(known, _)| *known == name)?;
    let told = page.split("\n\n").nth(1)?.replace('\n', " ");
    let ends = [". ", "; ", ": "]
        .into_iter()
        .filter_map(|end| told.find(end));
    let end = ends.min().unwrap_or(told.len());
    Some(told[..end].trim_end_matches('.').to_owned())
}

#[derive(Serialize)]
struct Names {
    names: Vec<&'static str>,
}

impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.names.iter().try_for_each(|name| writeln!(f, "{name}"))
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.page)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Limit;
    use protection::Fault;
    use std::collections::BTreeSet;
    use std::path::Path;

    #[test]
    fn every_fault_and_limit_has_a_page_and_every_page_is_of_one() {
        let faults = Fault::ALL.map(Fault::name);
        let limits = Limit::ALL.map(Limit::name);
        let named: BTreeSet<&str> = faults.into_iter().chain(limits).collect();
        let explained: BTreeSet<&str> = PAGES.iter().map(|(name, _)| *name).collect();
        assert_eq!(named, explained);
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/faults");
        let files: BTreeSet<String> = std::fs::read_dir(folder)
            .expect("the folder of the pages")
            .map(|file| file.expect("a file").path())
            .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
            .collect();
        assert_eq!(files, named.iter().map(|name| (*name).to_owned()).collect());
    }

    #[test]
    fn every_page_begins_with_a_sentence_for_one_line() {
        for (name, _) in PAGES {
            let sentence = sentence(name).expect(name);
            assert!(
                sentence.len() > 15 && !sentence.contains('\n'),
                "{sentence}"
            );
        }
        assert_eq!(sentence("unheard-of"), None);
    }

    #[test]
    fn every_page_tells_what_happened_its_cause_and_its_remedy() {
        for (name, page) in PAGES {
            let mut parts = page.split("\n\n");
            assert_eq!(parts.next(), Some(format!("# {name}").as_str()));
            let (what, rest) = page[name.len() + 4..]
                .split_once("\n\n## Cause\n\n")
                .expect("a cause");
            let (cause, remedy) = rest.split_once("\n\n## Remedy\n\n").expect("a remedy");
            for text in [what, cause, remedy] {
                assert!(text.len() > 15 && !text.contains('#'), "{name}: {text}");
            }
        }
    }
}
