//! Which pages the book has, and in which order: those of the page of contents as it has them, and each other below the one
//! that leads to it, and to the most others.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, bail};

/// The page of contents. Its lines that begin with bold words open a part, and its lists that begin with links hold the pages.
const CONTENTS: &str = "docs/README.md";
/// Of lists in the summary that mdBook reads.
const INDENT: usize = 4;

/// The pages of the book, by their place in the repository.
pub(super) struct Contents {
    /// What they are called.
    titles: BTreeMap<PathBuf, String>,
    /// Files that pages lead to, or show.
    files: BTreeSet<PathBuf>,
    /// In the order of the book.
    entries: Vec<Entry>,
}

enum Entry {
    Part(String),
    /// A page, and how deep it lies: 0 is beside the parts.
    Page(PathBuf, usize),
}

impl Entry {
    fn page(&self) -> Option<&PathBuf> {
        match self {
            Self::Part(_) => None,
            Self::Page(page, _) => Some(page),
        }
    }
}

impl Contents {
    /// All that `first` leads to.
    pub(super) fn of(root: &Path, first: &Path) -> Result<Self> {
        let mut titles = BTreeMap::new();
        let mut files = BTreeSet::new();
        // The pages that each page leads to.
        let mut leads: BTreeMap<PathBuf, BTreeSet<PathBuf>> = BTreeMap::new();
        let mut open = vec![first.to_owned()];
        while let Some(page) = open.pop() {
            if titles.contains_key(&page) {
                continue;
            }
            let text = fs::read_to_string(root.join(&page))
                .with_context(|| format!("the page {}", page.display()))?;
            for target in targets(&page, &text) {
                if target.extension().is_some_and(|end| end == "md") {
                    open.push(target.clone());
                    leads.entry(page.clone()).or_default().insert(target);
                } else if root.join(&target).is_file() {
                    files.insert(target);
                } else {
                    let (page, target) = (page.display(), target.display());
                    bail!("{page} leads to {target}, which is no file");
                }
            }
            titles.insert(page.clone(), title(&page, &text)?);
        }
        let mut entries = listed_in(&fs::read_to_string(root.join(CONTENTS))?);
        for page in [Path::new(CONTENTS), first] {
            entries.insert(0, Entry::Page(page.to_owned(), 0));
        }
        let listed: BTreeSet<&PathBuf> = entries.iter().filter_map(Entry::page).collect();
        let others = titles.keys().filter(|page| !listed.contains(page));
        let others: BTreeSet<PathBuf> = others.cloned().collect();
        let above = |page: &PathBuf| {
            let of_it = leads
                .iter()
                .filter(|(from, to)| listed.contains(from) && to.contains(page));
            let above = of_it.max_by_key(|(_, to)| to.intersection(&others).count());
            above.map(|(from, _)| from.clone())
        };
        let mut placed = Vec::new();
        for page in &others {
            let above = above(page);
            placed.push((
                page,
                above.with_context(|| {
                    format!(
                        "no page that is listed in {CONTENTS} leads to {}",
                        page.display()
                    )
                })?,
            ));
        }
        for (page, above) in placed {
            insert_below(&mut entries, page, &above);
        }
        Ok(Self {
            titles,
            files,
            entries,
        })
    }

    /// How many pages there are.
    pub(super) fn pages(&self) -> usize {
        self.titles.len()
    }

    /// Copies pages, and files that they lead to, each to the same place below `folder`.
    pub(super) fn copy(&self, root: &Path, folder: &Path) -> Result<()> {
        for path in self.titles.keys().chain(&self.files) {
            let copy = folder.join(path);
            fs::create_dir_all(copy.parent().context("a file lies in a folder")?)?;
            fs::copy(root.join(path), copy).with_context(|| path.display().to_string())?;
        }
        Ok(())
    }

    /// The list of pages that mdBook reads.
    pub(super) fn summary(&self) -> String {
        let mut summary = String::from("# Summary\n\n");
        for entry in &self.entries {
            let _ = match entry {
                Entry::Part(name) => writeln!(summary, "\n# {name}\n"),
                Entry::Page(page, depth) => {
                    let bullet = match depth {
                        0 => "\n".to_owned(),
                        depth => format!("{}- ", " ".repeat(INDENT * (depth - 1))),
                    };
                    let title = &self.titles[page];
                    writeln!(summary, "{bullet}[{title}]({})", page.display())
                }
            };
        }
        summary
    }
}

/// Parts and pages that the page of contents lists.
fn listed_in(text: &str) -> Vec<Entry> {
    let mut entries = Vec::new();
    let mut in_part = false;
    for line in text.lines() {
        if let Some((part, _)) = line
            .strip_prefix("**")
            .and_then(|rest| rest.split_once("**"))
        {
            entries.push(Entry::Part(part.to_owned()));
            in_part = true;
            continue;
        }
        let item = line.trim_start();
        let bullet = item.split_once(' ').filter(|(bullet, rest)| {
            let is_bullet = *bullet == "-" || bullet.trim_end_matches('.').parse::<u32>().is_ok();
            is_bullet && rest.starts_with('[')
        });
        let depth = match (bullet, line.starts_with('[')) {
            (Some(_), _) if in_part => 1 + usize::from(item.len() < line.len()),
            (None, true) if in_part => 0,
            _ => continue,
        };
        let pages = targets(Path::new(CONTENTS), item).into_iter();
        entries.extend(pages.map(|page| Entry::Page(page, depth)));
    }
    entries
}

/// Puts a page behind those that lie below another.
fn insert_below(entries: &mut Vec<Entry>, page: &Path, above: &PathBuf) {
    let mut depth = None;
    let behind = entries.iter().position(|entry| match (depth, entry) {
        (None, Entry::Page(other, at)) if other == above => {
            depth = Some(*at);
            false
        }
        (Some(depth), Entry::Page(_, at)) => *at <= depth,
        (Some(_), Entry::Part(_)) => true,
        (None, _) => false,
    });
    let entry = Entry::Page(page.to_owned(), depth.unwrap_or(0) + 1);
    entries.insert(behind.unwrap_or(entries.len()), entry);
}

/// What a page calls itself.
fn title(page: &Path, text: &str) -> Result<String> {
    let title = text.lines().find_map(|line| line.strip_prefix("# "));
    let title = title.with_context(|| format!("{} has no title", page.display()))?;
    Ok(title.trim().to_owned())
}

/// What a page leads to in the repository, from its root.
fn targets(page: &Path, text: &str) -> Vec<PathBuf> {
    let folder = page.parent().unwrap_or(Path::new(""));
    let targets = text.split("](").skip(1);
    targets
        .filter_map(|target| target.split([')', '#']).next())
        .filter(|target| !target.is_empty() && !target.contains("://"))
        .map(|target| normal(&folder.join(target)))
        .collect()
}

/// Without `..` in it.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                normal.pop();
            }
            part => normal.push(part),
        }
    }
    normal
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cargo::workspace;

    #[test]
    fn the_contents_are_parts_and_pages_at_their_depth() {
        let text = "\
# The book

- **You**: [a](a.md)

**Guide**: what to type

1. [Start](guide/start.md): all
   - [More](guide/more.md)

**Rest**

- [One](b.md) and [two](../c.md#d)

[Words](words.md). All others.
";
        let entries = listed_in(text);
        let told: Vec<String> = entries
            .iter()
            .map(|entry| match entry {
                Entry::Part(name) => format!("# {name}"),
                Entry::Page(page, depth) => format!("{depth} {}", page.display()),
            })
            .collect();
        assert_eq!(
            told,
            [
                "# Guide",
                "1 docs/guide/start.md",
                "2 docs/guide/more.md",
                "# Rest",
                "1 docs/b.md",
                "1 c.md",
                "0 docs/words.md"
            ]
        );
    }

    #[test]
    fn every_page_is_in_the_book_once() {
        let contents = Contents::of(workspace(), Path::new("README.md")).expect("the pages");
        let summary = contents.summary();
        assert!(contents.pages() > 60, "{}", contents.pages());
        assert_eq!(summary.matches("](").count(), contents.pages(), "{summary}");
        for page in ["(docs/faults/open-heater.md)", "(CONTRIBUTING.md)"] {
            assert_eq!(summary.matches(page).count(), 1, "{page}");
        }
    }
}
