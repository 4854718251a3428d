use std::collections::BTreeSet;
use std::fs;

use super::Modules;
use crate::cargo::workspace;
use crate::packages::{list, metadata, text};

#[test]
fn there_are_no_circles_of_files() {
    let metadata = metadata().expect("cargo tells the packages");
    let mut found = BTreeSet::new();
    let mut packages = 0;
    for package in list(&metadata["packages"]) {
        let manifest = text(&package["manifest_path"]);
        if !text(&package["source"]).is_empty()
            || !manifest.starts_with(&*workspace().to_string_lossy())
        {
            continue;
        }
        let source = manifest.trim_end_matches("Cargo.toml").to_owned() + "src/";
        let modules = Modules::read(&|file| fs::read_to_string(format!("{source}{file}")).ok());
        packages += usize::from(!modules.0.is_empty());
        for circle in modules.circles() {
            found.insert((text(&package["name"]).to_owned(), circle));
        }
    }
    assert!(packages > 30, "{packages} packages were read");
    assert!(found.is_empty(), "{found:#?}");
}

/// The circles among files that a test makes up.
fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let modules = Modules::read(&|path| {
        let file = files.iter().find(|(name, _)| *name == path);
        file.map(|(_, source)| (*source).to_owned())
    });
    let circles = modules.circles().into_iter();
    circles
        .map(|circle| circle.into_iter().collect::<Vec<_>>().join(" "))
        .collect()
}

#[test]
fn two_files_that_use_each_other_are_a_circle() {
    let link = "use super::owner::Claim; pub struct Link(Claim);";
    let owner = "pub struct Claim; fn of(_: crate::board::link::Link) {}";
    let files = [
        ("lib.rs", "mod board;"),
        ("board/mod.rs", "mod link; mod owner;"),
        ("board/link.rs", link),
        ("board/owner.rs", owner),
    ];
    assert_eq!(circles_of(&files), ["board/link board/owner"]);
}

#[test]
fn a_file_that_only_passes_on_is_in_no_circle() {
    let files = [
        ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"),
        ("a.rs", "pub struct A;"),
        ("b.rs", "use crate::A; pub struct B(A);"),
    ];
    assert_eq!(circles_of(&files), [""; 0]);
}

#[test]
fn a_file_that_uses_what_it_passes_on_is_in_one() {
    let files = [
        ("lib.rs", "mod a; pub use a::A; pub struct B(A);"),
        ("a.rs", "pub struct A; fn of(_: crate::B) {}"),
    ];
    assert_eq!(circles_of(&files), ["a lib"]);
}

#[test]
fn a_circle_by_way_of_the_root_is_one() {
    let files = [
        (
            "lib.rs",
            "mod a; pub struct Failed; pub fn all() { a::one() }",
        ),
        (
            "a.rs",
            "use crate::Failed; pub fn one() -> Failed { Failed }",
        ),
    ];
    assert_eq!(circles_of(&files), ["a lib"]);
}

#[test]
fn what_tests_use_is_no_circle() {
    let files = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "use crate::b::B; pub struct A(B);"),
        (
            "b.rs",
            "pub struct B; #[cfg(test)] mod tests { use crate::a::A; } #[test] fn it() { crate::a::A; }",
        ),
    ];
    assert_eq!(circles_of(&files), [""; 0]);
}

#[test]
fn paths_in_macros_and_through_globs_are_uses() {
    let files = [
        ("main.rs", "mod a; mod b;"),
        (
            "a.rs",
            "pub use crate::b::*; pub fn a() { print!(\"{}\", crate::b::b()) }",
        ),
        ("b.rs", "pub fn b() { crate::a::a() }"),
    ];
    assert_eq!(circles_of(&files), ["a b"]);
}
