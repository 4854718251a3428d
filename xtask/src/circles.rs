//! No circles of files: within a package a reader can begin with the file that uses no other, and go on.
//!
//! A file uses another where it names what that one defines, be it by way of a re-export. What only tests use is left out, and
//! so are the re-exports themselves, which pass on and use nothing.

use std::collections::{BTreeMap, BTreeSet};

use syn::visit::Visit;
use syn::{Attribute, Item, ItemMod, ItemUse, Macro, UseTree};

/// A module's path from the root of its package.
type Module = Vec<String>;

/// A path as it is written: `super::owner::Claim`.
type Written = Vec<String>;

/// What a module says of others.
#[derive(Debug, Default)]
struct Content {
    /// From the package's `src`, without `.rs`.
    file: String,
    /// What a name stands for here that was brought in by `use`.
    imports: BTreeMap<String, Written>,
    /// The modules of which all names are here.
    globs: Vec<Written>,
    /// What is defined here.
    items: BTreeSet<String>,
    /// What is used here.
    used: Vec<Written>,
}

/// The modules of a package.
#[derive(Debug, Default)]
struct Modules(BTreeMap<Module, Content>);

/// A file of a package's `src`, by its path from there, where it is there.
type Files<'a> = dyn Fn(&str) -> Option<String> + 'a;

impl Modules {
    /// All modules below the first of these roots that is there.
    fn read(files: &Files<'_>) -> Self {
        let mut modules = Self::default();
        if let Some(root) = ["lib", "main"]
            .into_iter()
            .find(|root| files(&format!("{root}.rs")).is_some())
        {
            modules.add_file(Vec::new(), root, "", files);
        }
        modules
    }

    /// Adds a module and those below it. `folder` is where those below it lie: empty, or ending in a slash.
    fn add_file(&mut self, module: Module, file: &str, folder: &str, files: &Files<'_>) {
        let source = files(&format!("{file}.rs")).expect("a module has a file");
        let parsed = syn::parse_file(&source).expect("a file that compiles can be read");
        self.add(module, parsed.items, file, folder, files);
    }

    fn add(
        &mut self,
        module: Module,
        items: Vec<Item>,
        file: &str,
        folder: &str,
        files: &Files<'_>,
    ) {
        let mut content = Content {
            file: file.to_owned(),
            ..Content::default()
        };
        for item in items {
            match item {
                Item::Mod(inner) if !is_for_tests(&inner.attrs) => {
                    self.add_inner(&module, inner, file, folder, files);
                }
                item => content.visit_item(&item),
            }
        }
        self.0.insert(module, content);
    }

    /// Adds a module that another declares, in its own file or in the other's.
    fn add_inner(
        &mut self,
        outer: &Module,
        inner: ItemMod,
        file: &str,
        folder: &str,
        files: &Files<'_>,
    ) {
        let name = inner.ident.to_string();
        let module = [outer.clone(), vec![name.clone()]].concat();
        let below = format!("{folder}{name}/");
        if let Some((_, items)) = inner.content {
            return self.add(module, items, file, &below, files);
        }
        let places = [format!("{folder}{name}"), format!("{below}mod")];
        // One whose file has another name is at a place of its own, or made when the package is built.
        if let Some(place) = places
            .iter()
            .find(|place| files(&format!("{place}.rs")).is_some())
        {
            self.add_file(module, place, &below, files);
        }
    }

    /// The module that defines what is written so in `from`. `None` where another package does.
    fn defines(&self, from: &Module, written: &[String]) -> Option<Module> {
        self.follow(from, written, 0)
    }

    fn follow(&self, from: &Module, written: &[String], steps: usize) -> Option<Module> {
        /// More than re-exports that lead to one another in any package.
        const MOST: usize = 20;
        let (mut module, mut rest) = self.start(from, written)?;
        while let Some((next, after)) = rest.split_first() {
            let inner = [module.clone(), vec![next.clone()]].concat();
            if !self.0.contains_key(&inner) {
                break;
            }
            (module, rest) = (inner, after);
        }
        let Some(name) = rest.first().filter(|_| steps < MOST) else {
            return Some(module);
        };
        let content = &self.0[&module];
        if content.items.contains(name) {
            return Some(module);
        }
        if let Some(import) = content.imports.get(name) {
            let onward = [import.as_slice(), &rest[1..]].concat();
            return self.follow(&module, &onward, steps + 1);
        }
        let through = content.globs.iter().find_map(|glob| {
            let onward = [glob.as_slice(), rest].concat();
            let found = self.follow(&module, &onward, steps + 1)?;
            self.0[&found].items.contains(name).then_some(found)
        });
        Some(through.unwrap_or(module))
    }

    /// Where a path begins, and what of it is left to follow.
    fn start<'a>(&self, from: &Module, written: &'a [String]) -> Option<(Module, &'a [String])> {
        let first = written.first()?;
        match first.as_str() {
            "crate" => Some((Vec::new(), &written[1..])),
            "self" => Some((from.clone(), &written[1..])),
            "super" => {
                let up = written.iter().take_while(|word| *word == "super").count();
                let depth = from.len().checked_sub(up)?;
                Some((from[..depth].to_vec(), &written[up..]))
            }
            name => {
                let here = &self.0[from];
                let is_module = self
                    .0
                    .contains_key(&[from.clone(), vec![name.to_owned()]].concat());
                // An import that begins with its own name is another package's.
                let is_import = here.imports.get(name).is_some_and(|it| it[0] != name);
                (is_module || is_import || here.items.contains(name))
                    .then(|| (from.clone(), written))
            }
        }
    }

    /// Which files each file uses.
    fn uses(&self) -> BTreeMap<&str, BTreeSet<&str>> {
        let mut uses: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for (module, content) in &self.0 {
            let of_file = uses.entry(&content.file).or_default();
            // A single name may be a variable's.
            let is_known =
                |written: &&Written| written.len() > 1 || content.imports.contains_key(&written[0]);
            let used = content.used.iter().filter(is_known);
            let defining = used.filter_map(|written| self.defines(module, written));
            of_file.extend(defining.map(|module| self.0[&module].file.as_str()));
        }
        uses
    }

    /// The circles: sets of files of which each leads to all others.
    fn circles(&self) -> BTreeSet<BTreeSet<String>> {
        let uses = self.uses();
        let reached: BTreeMap<&str, BTreeSet<&str>> = uses
            .keys()
            .map(|file| (*file, reached_from(file, &uses)))
            .collect();
        let circle_of = |file: &&str| -> BTreeSet<String> {
            let others = reached[file]
                .iter()
                .filter(|other| **other != *file && reached[**other].contains(file));
            others
                .chain([file])
                .map(|file| (*file).to_owned())
                .collect()
        };
        let circles = uses.keys().map(circle_of);
        circles.filter(|circle| circle.len() > 1).collect()
    }
}

/// What a source uses, tests left out: each path as it is written.
pub(crate) fn used(source: &str) -> Vec<Vec<String>> {
    let mut content = Content::default();
    content.visit_file(&syn::parse_file(source).expect("a file that compiles can be read"));
    content.used
}

fn reached_from<'a>(
    file: &'a str,
    uses: &BTreeMap<&'a str, BTreeSet<&'a str>>,
) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut open = vec![file];
    while let Some(next) = open.pop() {
        for used in uses.get(next).into_iter().flatten() {
            if reached.insert(*used) {
                open.push(used);
            }
        }
    }
    reached
}

impl Content {
    /// Adds what a `use` brings in, its path so far given.
    fn import(&mut self, tree: &UseTree, path: &[String], is_passed_on: bool) {
        let with = |name: &syn::Ident| [path, &[name.to_string()]].concat();
        let (name, written) = match tree {
            UseTree::Path(inner) => {
                return self.import(&inner.tree, &with(&inner.ident), is_passed_on);
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.import(tree, path, is_passed_on);
                }
                return;
            }
            UseTree::Glob(_) => {
                self.globs.push(path.to_vec());
                if !is_passed_on {
                    self.used.push(path.to_vec());
                }
                return;
            }
            UseTree::Name(name) if name.ident == "self" => {
                (path.last().cloned().unwrap_or_default(), path.to_vec())
            }
            UseTree::Name(name) => (name.ident.to_string(), with(&name.ident)),
            UseTree::Rename(renamed) => (renamed.rename.to_string(), with(&renamed.ident)),
        };
        if !is_passed_on {
            self.used.push(written.clone());
        }
        self.imports.insert(name, written);
    }

    fn define(&mut self, item: &Item) {
        let name = match item {
            Item::Const(it) => &it.ident,
            Item::Enum(it) => &it.ident,
            Item::Fn(it) => &it.sig.ident,
            Item::Static(it) => &it.ident,
            Item::Struct(it) => &it.ident,
            Item::Trait(it) => &it.ident,
            Item::Type(it) => &it.ident,
            Item::Union(it) => &it.ident,
            _ => return,
        };
        self.items.insert(name.to_string());
    }
}

impl<'ast> Visit<'ast> for Content {
    fn visit_item(&mut self, item: &'ast Item) {
        if is_for_tests(attributes(item)) {
            return;
        }
        self.define(item);
        syn::visit::visit_item(self, item);
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let is_passed_on = !matches!(item.vis, syn::Visibility::Inherited);
        self.import(&item.tree, &[], is_passed_on);
    }

    /// `pub(in crate::chip)` says who may use, and uses nothing.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let written: Written = path
            .segments
            .iter()
            .map(|it| it.ident.to_string())
            .collect();
        self.used.push(written);
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, it: &'ast Macro) {
        self.used.extend(paths_in(&it.tokens.to_string()));
        syn::visit::visit_macro(self, it);
    }
}

/// What looks like a path among a macro's tokens.
fn paths_in(tokens: &str) -> Vec<Written> {
    let joined = tokens.replace(" :: ", "::");
    joined
        .split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'))
        .map(|word| word.split("::").map(str::to_owned).collect::<Written>())
        .filter(|written| written.len() > 1 && written.iter().all(|name| !name.is_empty()))
        .collect()
}

/// Whether an item is there only when tests are built.
pub(crate) fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let told = match &attribute.meta {
            syn::Meta::List(list) if list.path.is_ident("cfg") => list.tokens.to_string(),
            meta => return meta.path().is_ident("test"),
        };
        told == "test" || told.starts_with("all") && told.contains("test")
    })
}

pub(crate) fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(it) => &it.attrs,
        Item::Enum(it) => &it.attrs,
        Item::Fn(it) => &it.attrs,
        Item::Impl(it) => &it.attrs,
        Item::Mod(it) => &it.attrs,
        Item::Static(it) => &it.attrs,
        Item::Struct(it) => &it.attrs,
        Item::Trait(it) => &it.attrs,
        Item::Type(it) => &it.attrs,
        Item::Use(it) => &it.attrs,
        _ => &[],
    }
}

#[cfg(test)]
mod tests;
