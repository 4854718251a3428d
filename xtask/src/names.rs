//! No two types of a package share a name: whoever reads it, or searches for it, finds what is meant.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use syn::visit::Visit;
use syn::{Item, ItemMod};

use crate::cargo::workspace;
use crate::circles::{attributes, is_for_tests};
use crate::packages::{list, metadata, text};
use crate::sources::sources;

/// Types of which a build has one: each board has its own, or each system.
const OF_ONE_BUILD: [&str; 4] = ["BoardFlash", "Interrupts", "StandIn", "TickTime"];

/// The types that a source defines, tests left out.
#[derive(Default)]
struct Types(Vec<String>);

impl Types {
    fn of(source: &str) -> Vec<String> {
        let mut types = Self::default();
        types.visit_file(&syn::parse_file(source).expect("a file that compiles can be read"));
        types.0
    }
}

impl<'ast> Visit<'ast> for Types {
    fn visit_item(&mut self, item: &'ast Item) {
        if is_for_tests(attributes(item)) {
            return;
        }
        let name = match item {
            Item::Enum(it) => Some(&it.ident),
            Item::Struct(it) => Some(&it.ident),
            Item::Trait(it) => Some(&it.ident),
            Item::Union(it) => Some(&it.ident),
            _ => None,
        };
        self.0.extend(name.map(ToString::to_string));
        syn::visit::visit_item(self, item);
    }

    fn visit_item_mod(&mut self, it: &'ast ItemMod) {
        if !is_for_tests(&it.attrs) {
            syn::visit::visit_item_mod(self, it);
        }
    }
}

/// The names that more than one of these sources gives to a type.
fn shared(sources: &[(String, String)]) -> BTreeMap<String, BTreeSet<String>> {
    let mut files: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (file, source) in sources {
        for name in Types::of(source) {
            files.entry(name).or_default().insert(file.clone());
        }
    }
    files.retain(|name, files| files.len() > 1 && !OF_ONE_BUILD.contains(&name.as_str()));
    files
}

/// The sources of the package in this folder.
fn read(package: &Path) -> Vec<(String, String)> {
    let folder = package.join("src");
    let files = sources(&folder).into_iter();
    files
        .map(|file| {
            let source = fs::read_to_string(&file).expect("a source");
            (file.display().to_string(), source)
        })
        .collect()
}

#[test]
fn no_two_types_of_a_package_share_a_name() {
    let metadata = metadata().expect("cargo tells the packages");
    let ours = list(&metadata["packages"]).iter().filter(|package| {
        let manifest = text(&package["manifest_path"]);
        manifest.starts_with(&*workspace().to_string_lossy())
    });
    let mut packages = 0;
    for package in ours {
        let manifest = Path::new(text(&package["manifest_path"]));
        let folder = manifest.parent().expect("a manifest lies in a folder");
        if folder.join("src").exists() {
            packages += 1;
            let shared = shared(&read(folder));
            assert!(shared.is_empty(), "{}: {shared:#?}", text(&package["name"]));
        }
    }
    assert!(packages > 30, "{packages} packages were read");
}

#[test]
fn a_name_that_two_files_give_is_found_and_that_of_a_test_is_not() {
    let file = |name: &str, source: &str| (name.to_owned(), source.to_owned());
    let found = shared(&[
        file("a.rs", "pub struct Bench; enum Kind { One }"),
        file(
            "b.rs",
            "trait Bench {} #[cfg(test)] mod tests { struct Kind; }",
        ),
        file("c.rs", "fn bench() {} use crate::a::Bench;"),
    ]);
    let names: Vec<_> = found.keys().collect();
    assert_eq!(names, ["Bench"]);
    assert_eq!(found["Bench"].len(), 2);
}
