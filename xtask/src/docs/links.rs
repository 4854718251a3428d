//! Links of a folder of HTML pages: each leads to a file that is there, and to a place that is in it; nothing that a page is
//! made of comes from elsewhere.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

/// Attributes that name another file or place, and whether a browser fetches it by itself.
const REFERENCES: [(&str, bool); 3] = [("href", false), ("src", true), ("data", true)];

/// Counts the links of all pages below a folder, or tells those that are broken.
pub(super) fn check(book: &Path) -> Result<usize> {
    let mut pages = Vec::new();
    pages_below(book, &mut pages)?;
    let mut places: BTreeMap<PathBuf, BTreeSet<String>> = BTreeMap::new();
    let mut texts = Vec::new();
    for page in pages {
        let text = fs::read_to_string(&page)?;
        let named = elements(&text).filter_map(|element| attribute(element, "id"));
        places.insert(page.canonicalize()?, named.collect());
        texts.push((page, text));
    }
    let (mut count, mut broken) = (0, Vec::new());
    for (page, text) in &texts {
        for (link, is_fetched) in links(text) {
            count += 1;
            if let Some(wrong) = wrong(page, &link, is_fetched, &places) {
                let page = page.strip_prefix(book).unwrap_or(page);
                broken.push(format!("{}: {wrong}", page.display()));
            }
        }
    }
    match broken.len() {
        0 => Ok(count),
        _ => bail!(
            "links of the book that are broken:\n  {}",
            broken.join("\n  ")
        ),
    }
}

pub(super) fn pages_below(folder: &Path, pages: &mut Vec<PathBuf>) -> Result<()> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            pages_below(&path, pages)?;
        } else if path.extension().is_some_and(|end| end == "html") {
            pages.push(path);
        }
    }
    pages.sort();
    Ok(())
}

/// What is wrong with a link of a page.
fn wrong(
    page: &Path,
    link: &str,
    is_fetched: bool,
    places: &BTreeMap<PathBuf, BTreeSet<String>>,
) -> Option<String> {
    if link.starts_with("data:") || link.starts_with("mailto:") {
        return None;
    }
    if link.contains("://") || link.starts_with("//") {
        return is_fetched.then(|| format!("{link} comes from elsewhere"));
    }
    let (file, place) = link.split_once('#').unwrap_or((link, ""));
    let target = match file {
        "" => page.to_owned(),
        file => page.parent()?.join(file),
    };
    let Ok(target) = target.canonicalize() else {
        return Some(format!("{link} is not there"));
    };
    if target.is_dir() {
        return Some(format!("{link} is a folder"));
    }
    let is_there = place.is_empty()
        || places
            .get(&target)
            .is_some_and(|places| places.contains(place));
    (!is_there).then(|| format!("{link}: that page has no such place"))
}

/// The references of a page, and whether a browser fetches each by itself.
fn links(html: &str) -> impl Iterator<Item = (String, bool)> {
    elements(html).flat_map(|element| {
        let is_link = element.starts_with("link ");
        REFERENCES.iter().filter_map(move |(name, is_fetched)| {
            Some((attribute(element, name)?, *is_fetched || is_link))
        })
    })
}

/// What stands between `<` and `>`; scripts and comments are passed over.
fn elements(html: &str) -> impl Iterator<Item = &str> {
    let mut rest = html;
    std::iter::from_fn(move || {
        loop {
            let (_, after) = rest.split_once('<')?;
            if let Some(comment) = after.strip_prefix("!--") {
                rest = comment.split_once("-->")?.1;
                continue;
            }
            let (element, behind) = after.split_once('>')?;
            rest = match element.starts_with("script") {
                true => behind.split_once("</script")?.1,
                false => behind,
            };
            return Some(element);
        }
    })
}

/// The value of an element's attribute.
fn attribute(element: &str, name: &str) -> Option<String> {
    let (_, value) = element.split_once(&format!(" {name}=\""))?;
    let (value, _) = value.split_once('"')?;
    Some(value.replace("&amp;", "&"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is wrong with a book of two pages.
    fn said(first: &str) -> String {
        let folder = tempfile();
        fs::create_dir_all(folder.join("a")).expect("a folder");
        fs::write(folder.join("first.html"), first).expect("a page");
        fs::write(
            folder.join("a/b.html"),
            "<h1 class=\"x\" id=\"title\">b</h1>",
        )
        .expect("a page");
        let said = match check(&folder) {
            Ok(count) => count.to_string(),
            Err(error) => error.to_string(),
        };
        fs::remove_dir_all(folder).expect("a folder");
        said
    }

    /// A folder of this test's own.
    fn tempfile() -> PathBuf {
        let name = format!("{:?}", std::thread::current().id());
        let number: String = name.chars().filter(char::is_ascii_digit).collect();
        std::env::temp_dir().join(format!("links-{}-{number}", std::process::id()))
    }

    #[test]
    fn what_is_there_is_found() {
        let links = r##"<a href="a/b.html">b</a><a class="y" href="a/b.html#title">b</a><a href="#here">h</a><p id="here">
            <a href="https://example.org/">elsewhere</a><!-- <a href="gone.html"> --><script>'<a href="gone.html">'</script>"##;
        assert_eq!(said(links), "4");
    }

    #[test]
    fn what_is_not_there_is_told() {
        for (link, wrong) in [
            (r#"<a href="gone.html">"#, "gone.html is not there"),
            (r#"<a href="a/b.html#gone">"#, "no such place"),
            (r##"<a href="#gone">"##, "no such place"),
            (r#"<a href="a">"#, "a is a folder"),
            (r#"<img alt="" src="gone.png">"#, "gone.png is not there"),
            (
                r#"<link rel="stylesheet" href="https://example.org/a.css">"#,
                "comes from elsewhere",
            ),
            (
                r#"<script src="//example.org/a.js"></script>"#,
                "comes from elsewhere",
            ),
        ] {
            assert!(said(link).contains(wrong), "{link}: {}", said(link));
        }
    }
}
