//! Licences, sources and duplicates of everything that is built, by `deny.toml`.
//!
//! The file is cargo-deny's, of which this reads a part; where cargo-deny is installed it runs too, and checks what needs
//! its database of advisories.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use anyhow::{Context, Result, bail};
use toml::{Table, Value};

use crate::cargo::{answers, cargo, run, workspace};
use crate::packages::{self, PLATFORMS, Package};

/// Fails where a package breaks the rules, and names all that do.
pub(crate) fn check() -> Result<()> {
    let text = fs::read_to_string(workspace().join("deny.toml"))?;
    let rules = Rules::read(&toml::from_str(&text)?);
    let mut selection = vec![
        "--workspace",
        "--all-features",
        "--edges",
        "normal,build,dev",
    ];
    for platform in PLATFORMS {
        selection.extend(["--target", platform]);
    }
    let built = packages::built(&selection)?;
    let broken = rules.broken_by(&built);
    if !broken.is_empty() {
        bail!("deny.toml does not allow:\n  {}", broken.join("\n  "));
    }
    println!(
        "{} packages: licences, sources and duplicates as deny.toml allows",
        built.len()
    );
    if answers("cargo-deny", "--version") {
        return run(&mut cargo(&["deny", "check"])).context("cargo-deny");
    }
    println!("advisories: not checked, for cargo-deny is not installed");
    Ok(())
}

/// What `deny.toml` allows.
struct Rules {
    licences: BTreeSet<String>,
    /// Licences of single packages besides.
    exceptions: BTreeMap<String, BTreeSet<String>>,
    registries: BTreeSet<String>,
    /// `name@version`: versions that may be there beside a newer one.
    old: BTreeSet<String>,
}

impl Rules {
    fn read(file: &Table) -> Self {
        let exceptions = list(file, "licenses", "exceptions");
        Self {
            licences: words(list(file, "licenses", "allow")),
            exceptions: exceptions
                .iter()
                .filter_map(|one| Some((word(one, "crate")?, words(one.get("allow")?.as_array()?))))
                .collect(),
            registries: words(list(file, "sources", "allow-registry")),
            old: list(file, "bans", "skip")
                .iter()
                .filter_map(|one| word(one, "crate"))
                .collect(),
        }
    }

    /// A sentence for each rule that a package breaks.
    fn broken_by(&self, packages: &BTreeSet<Package>) -> Vec<String> {
        let mut broken = Vec::new();
        for package in packages.iter().filter(|package| package.source.is_some()) {
            let Package { name, version, .. } = package;
            let licence = package.licence.as_deref().unwrap_or_default();
            if !self.allows_licence(name, licence) {
                broken.push(format!("{name} {version}: licence `{licence}`"));
            }
            let source = package.source.as_deref().unwrap_or_default();
            let registry = source.strip_prefix("registry+");
            if !registry.is_some_and(|registry| self.registries.contains(registry)) {
                broken.push(format!("{name} {version}: source {source}"));
            }
        }
        let mut versions: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for package in packages {
            let of_one_name = versions.entry(&package.name).or_default();
            of_one_name.push(&package.version);
        }
        for (name, versions) in versions {
            let not_skipped: Vec<&str> = versions
                .into_iter()
                .filter(|version| !self.old.iter().any(|old| names(old, name, version)))
                .collect();
            if not_skipped.len() > 1 {
                broken.push(format!("{name} in versions {}", not_skipped.join(", ")));
            }
        }
        broken
    }

    fn allows_licence(&self, name: &str, expression: &str) -> bool {
        let allowed = |licence: &str| {
            let exception = self.exceptions.get(name);
            self.licences.contains(licence) || exception.is_some_and(|own| own.contains(licence))
        };
        satisfied(expression, &allowed)
    }
}

/// Whether `old`, as `syn@1` or `rand_core@0.6`, is this package.
fn names(old: &str, name: &str, version: &str) -> bool {
    old.split_once('@').is_some_and(|(old_name, old_version)| {
        old_name == name
            && version
                .strip_prefix(old_version)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    })
}

/// Whether an SPDX expression holds where these licences are allowed: <https://spdx.github.io/spdx-spec/v2.3>, annex D. `/` is
/// an older way of writing OR. A licence WITH an exception only grants more than the licence.
fn satisfied(expression: &str, allowed: &impl Fn(&str) -> bool) -> bool {
    let spaced = expression
        .replace('(', " ( ")
        .replace(')', " ) ")
        .replace('/', " OR ");
    let mut tokens = spaced.split_whitespace().peekable();
    any(&mut tokens, allowed).unwrap_or(false) && tokens.next().is_none()
}

type Tokens<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

/// Terms joined by OR; nothing where the expression is none.
fn any(tokens: &mut Tokens, allowed: &impl Fn(&str) -> bool) -> Option<bool> {
    let mut holds = all(tokens, allowed)?;
    while tokens.next_if_eq(&"OR").is_some() {
        holds |= all(tokens, allowed)?;
    }
    Some(holds)
}

/// Terms joined by AND, which binds closer.
fn all(tokens: &mut Tokens, allowed: &impl Fn(&str) -> bool) -> Option<bool> {
    let mut holds = term(tokens, allowed)?;
    while tokens.next_if_eq(&"AND").is_some() {
        holds &= term(tokens, allowed)?;
    }
    Some(holds)
}

fn term(tokens: &mut Tokens, allowed: &impl Fn(&str) -> bool) -> Option<bool> {
    let token = tokens.next()?;
    if token == "(" {
        let holds = any(tokens, allowed)?;
        return tokens.next_if_eq(&")").map(|_| holds);
    }
    if tokens.next_if_eq(&"WITH").is_some() {
        tokens.next()?;
    }
    Some(allowed(token))
}

fn list<'a>(file: &'a Table, section: &str, key: &str) -> &'a [Value] {
    let found = file.get(section).and_then(|section| section.get(key));
    found.and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn words(values: &[Value]) -> BTreeSet<String> {
    values
        .iter()
        .filter_map(|value| Some(value.as_str()?.to_owned()))
        .collect()
}

fn word(value: &Value, key: &str) -> Option<String> {
    Some(value.get(key)?.as_str()?.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CRATES_IO: &str = "registry+https://github.com/rust-lang/crates.io-index";

    fn rules() -> Rules {
        let file = r#"
            [licenses]
            allow = ["MIT", "Unicode-3.0"]
            exceptions = [{ crate = "colored", allow = ["MPL-2.0"] }]
            [sources]
            allow-registry = ["https://github.com/rust-lang/crates.io-index"]
            [bans]
            skip = [{ crate = "syn@1", reason = "old" }]
        "#;
        Rules::read(&toml::from_str(file).expect("it is TOML"))
    }

    fn package(name: &str, version: &str, licence: &str, source: &str) -> Package {
        Package {
            name: name.to_owned(),
            version: version.to_owned(),
            licence: Some(licence.to_owned()),
            source: Some(source.to_owned()),
            ..Package::default()
        }
    }

    fn broken(packages: &[Package]) -> Vec<String> {
        rules().broken_by(&packages.iter().cloned().collect())
    }

    #[test]
    fn an_expression_holds_as_spdx_says() {
        let allowed = |licence: &str| ["MIT", "Unicode-3.0"].contains(&licence);
        for holds in [
            "MIT",
            "Apache-2.0 OR MIT",
            "Apache-2.0/MIT",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
            "GPL-3.0 OR MIT AND Unicode-3.0",
            "MIT WITH LLVM-exception",
        ] {
            assert!(satisfied(holds, &allowed), "{holds}");
        }
        for fails in [
            "",
            "GPL-3.0",
            "MIT AND GPL-3.0",
            "(MIT OR Apache-2.0) AND GPL-3.0",
            "MIT OR",
            "(MIT",
            "MIT MIT",
        ] {
            assert!(!satisfied(fails, &allowed), "{fails}");
        }
    }

    #[test]
    fn a_licence_is_allowed_for_all_or_for_one() {
        let packages = [
            package("colored", "2.2.0", "MPL-2.0", CRATES_IO),
            package("other", "1.0.0", "MPL-2.0", CRATES_IO),
        ];
        assert_eq!(broken(&packages), ["other 1.0.0: licence `MPL-2.0`"]);
    }

    #[test]
    fn a_package_comes_from_the_registry() {
        let git = "git+https://example.org/fork";
        assert_eq!(
            broken(&[package("fork", "1.0.0", "MIT", git)]),
            [format!("fork 1.0.0: source {git}")]
        );
    }

    #[test]
    fn a_second_version_must_be_listed() {
        let versions = |name, all: &[&str]| -> Vec<_> {
            all.iter()
                .map(|v| package(name, v, "MIT", CRATES_IO))
                .collect()
        };
        assert_eq!(broken(&versions("syn", &["1.0.109", "2.0.1"])), [""; 0]);
        assert_eq!(
            broken(&versions("syn", &["1.0.109", "2.0.1", "3.0.0"])),
            ["syn in versions 2.0.1, 3.0.0"]
        );
        assert_eq!(
            broken(&versions("rand", &["0.9.0", "0.10.0"])),
            ["rand in versions 0.10.0, 0.9.0"]
        );
    }

    #[test]
    fn a_listed_version_is_a_whole_number_of_parts() {
        assert!(names("rand_core@0.6", "rand_core", "0.6.4"));
        assert!(!names("rand_core@0.6", "rand_core", "0.60.0"));
        assert!(!names("rand_core@0.6", "rand", "0.6.4"));
    }
}
