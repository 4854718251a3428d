//! `explain`: what a fault or a limit is, its cause and its remedy, or what an effect or a word of a diagnosis says. The pages
//! are those of the docs; an effect's is what `effect show` prints.

use std::fmt;

use mirror_model::effect::built_in;
use serde::Serialize;

use crate::commands::lab::shown_effect;
use crate::error::ToolError;
use crate::names::nearest;
use crate::report;
use crate::terms::TERMS;

/// The pages of these names in `docs/faults`.
macro_rules! pages {
    [$($name:literal),* $(,)?] => {
        [$(($name, include_str!(concat!("../../../docs/faults/", $name, ".md")))),*]
    };
}

/// Faults and limits, those of the board and the mirror's own: name and page, by name.
const FAULTS: [(&str, &str); 28] = pages![
    "bandwidth",
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

/// All pages.
fn pages() -> impl Iterator<Item = (&'static str, &'static str)> {
    FAULTS.into_iter().chain(TERMS)
}

/// What has a page, and after it all effects.
fn names() -> Vec<String> {
    let effects = built_in().into_iter();
    let effects = effects.map(|effect| effect.info().id.to_string());
    let pages = pages().map(|(name, _)| name.to_owned());
    pages.chain(effects).collect()
}

#[derive(Serialize)]
struct Explanation {
    name: String,
    page: String,
}

/// Prints the page of `name`, or the names that there are.
pub(super) fn run(name: Option<&str>, json: bool) -> Result<(), ToolError> {
    let Some(name) = name else {
        report::print(&Names { names: names() }, json);
        return Ok(());
    };
    let page = pages().find(|(known, _)| *known == name);
    let page = page.map(|(_, page)| page.to_owned());
    let page = page.or_else(|| shown_effect(name));
    let name = name.to_owned();
    let page = page.ok_or_else(|| ToolError::NoSuchFault {
        nearest: nearest(&name, names()),
        name: name.clone(),
    })?;
    report::print(&Explanation { name, page }, json);
    Ok(())
}

/// What has happened where a fault or a limit of this name is told: the first sentence of its page.
pub(super) fn sentence(name: &str) -> Option<String> {
    let (_, page) = FAULTS.into_iter().find(|(known, _)| *known == name)?;
    let told = page.split("\n\n").nth(1)?.replace('\n', " ");
    let ends = [". ", "; ", ": "]
        .into_iter()
        .filter_map(|end| told.find(end));
    let end = ends.min().unwrap_or(told.len());
    Some(told[..end].trim_end_matches('.').to_owned())
}

#[derive(Serialize)]
struct Names {
    names: Vec<String>,
}

impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.names.iter().try_for_each(|name| writeln!(f, "{name}"))
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.page)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::names::BANDWIDTH;
    use crate::terms::terms;
    use control_core::Limit;
    use protection::Fault;
    use std::collections::BTreeSet;
    use std::path::Path;

    #[test]
    fn every_fault_and_limit_has_a_page_and_every_page_is_of_one() {
        let faults = Fault::ALL.map(Fault::name);
        let limits = Limit::ALL.map(Limit::name);
        let limits = limits.into_iter().chain([BANDWIDTH]);
        let named: BTreeSet<&str> = faults.into_iter().chain(limits).collect();
        let explained: BTreeSet<&str> = FAULTS.iter().map(|(name, _)| *name).collect();
        assert_eq!(named, explained);
        assert_eq!(
            pages_in("faults"),
            named.into_iter().map(String::from).collect()
        );
    }

    /// The names of the pages in a folder of `docs`.
    fn pages_in(folder: &str) -> BTreeSet<String> {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
        std::fs::read_dir(docs.join(folder))
            .expect("the folder of the pages")
            .map(|file| file.expect("a file").path())
            .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
            .collect()
    }

    #[test]
    fn an_effect_is_explained_and_no_name_has_two_meanings() {
        let names = names();
        let different: BTreeSet<&String> = names.iter().collect();
        assert_eq!(names.len(), different.len());
        assert_eq!(nearest("creeep", names).as_deref(), Some("creep"));
        let page = shown_effect("creep").expect("an effect");
        assert!(page.contains("equation"), "{page}");
        assert_eq!(shown_effect("creeep"), None);
    }

    #[test]
    fn every_word_of_a_diagnosis_has_a_page_that_begins_with_what_it_is_and_ends_with_its_source() {
        assert_eq!(pages_in("terms"), terms().map(String::from).collect());
        for (name, page) in TERMS {
            let parts: Vec<&str> = page.split("\n\n").collect();
            assert_eq!(parts[0], format!("# {name}"));
            assert!(
                parts.len() == 4 && parts[3].starts_with("Source: "),
                "{name}"
            );
        }
    }

    #[test]
    fn every_page_begins_with_a_sentence_for_one_line() {
        for (name, _) in FAULTS {
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
        for (name, page) in FAULTS {
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
