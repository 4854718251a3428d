//! The virtual mirror must not know the model it tests.

/// Every crate of this workspace is a path dependency of the workspace: none may stand in this one's manifest, so none
/// can come in by way of another either.
#[test]
fn it_depends_on_no_crate_of_this_workspace() {
    let workspace: toml::Table = include_str!("../../../../Cargo.toml")
        .parse()
        .expect("workspace manifest");
    let manifest: toml::Table = include_str!("../Cargo.toml").parse().expect("manifest");
    let of_this_workspace = |name: &str| {
        workspace["workspace"]["dependencies"][name]
            .get("path")
            .is_some()
    };
    let mut seen = 0;
    for table in ["dependencies", "dev-dependencies", "build-dependencies"] {
        let Some(table) = manifest.get(table).and_then(toml::Value::as_table) else {
            continue;
        };
        for (name, dependency) in table {
            assert!(
                dependency.get("path").is_none(),
                "{name} is a path dependency"
            );
            assert!(
                !of_this_workspace(name),
                "{name} is a crate of this workspace"
            );
            seen += 1;
        }
    }
    assert!(seen > 5, "the manifest was read");
}
