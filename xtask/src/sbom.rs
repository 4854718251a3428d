//! A software bill of materials in CycloneDX 1.5 (<https://cyclonedx.org/docs/1.5/json/>): every package that the tool, or the
//! driver board's firmware, is built from, with macros and without what only build scripts and tests use.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use anyhow::Result;
use serde_json::{Value, json};

use crate::cargo::{TARGET, workspace};
use crate::packages::{self, Package};

/// What is released: name, and the words that select its packages for `cargo tree`.
const RELEASED: [(&str, &[&str]); 3] = [
    (
        "host-tool",
        &["--package", "host-tool", "--edges", "normal"],
    ),
    (
        "mirror-emulator",
        &["--package", "mirror-emulator", "--edges", "normal"],
    ),
    (
        "mirror-firmware",
        &[
            "--package",
            "mirror-firmware",
            "--edges",
            "normal",
            "--target",
            TARGET,
            "--features",
            "board-stm32g474",
        ],
    ),
];

/// Writes `NAME.cdx.json` of all that is released into `folder`, counted from the workspace.
pub(crate) fn write(folder: &Path) -> Result<()> {
    let folder = workspace().join(folder);
    fs::create_dir_all(&folder)?;
    for (name, selection) in RELEASED {
        let packages = packages::built(selection)?;
        let path = folder.join(format!("{name}.cdx.json"));
        fs::write(&path, format!("{:#}\n", bill(name, &packages)))?;
        println!("{}: {} packages", path.display(), packages.len());
    }
    Ok(())
}

/// The bill of what `name` is made of.
fn bill(name: &str, packages: &BTreeSet<Package>) -> Value {
    let (itself, parts): (Vec<_>, Vec<_>) =
        packages.iter().partition(|package| package.name == name);
    json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": { "component": itself.first().map(|package| component(package, "application")) },
        "components": parts.iter().map(|package| component(package, "library")).collect::<Vec<_>>(),
    })
}

fn component(package: &Package, kind: &str) -> Value {
    let Package { name, version, .. } = package;
    let mut component = json!({
        "type": kind,
        "name": name,
        "version": version,
        "bom-ref": format!("{name}@{version}"),
    });
    if package.source.is_some() {
        // Package URL of a crate: https://github.com/package-url/purl-spec.
        component["purl"] = json!(format!("pkg:cargo/{name}@{version}"));
    }
    if let Some(licence) = &package.licence {
        // SPDX has no `/`, which older packages write for OR.
        let expression = licence.replace(" / ", "/").replace('/', " OR ");
        component["licenses"] = json!([{ "expression": expression }]);
    }
    if let Some(checksum) = &package.checksum {
        component["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
    }
    component
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bill_names_what_it_is_of_and_every_part() {
        let tool = Package {
            name: "host-tool".to_owned(),
            version: "0.1.0".to_owned(),
            licence: Some("MIT OR Apache-2.0".to_owned()),
            ..Package::default()
        };
        let part = Package {
            name: "ctrlc".to_owned(),
            version: "3.5.2".to_owned(),
            licence: Some("MIT/Apache-2.0".to_owned()),
            source: Some("registry+https://github.com/rust-lang/crates.io-index".to_owned()),
            checksum: Some("00ff".to_owned()),
            ..Package::default()
        };
        let bill = bill("host-tool", &BTreeSet::from([tool, part]));
        assert_eq!(bill["metadata"]["component"]["name"], "host-tool");
        assert_eq!(
            bill["components"],
            json!([{
                "type": "library",
                "name": "ctrlc",
                "version": "3.5.2",
                "bom-ref": "ctrlc@3.5.2",
                "purl": "pkg:cargo/ctrlc@3.5.2",
                "licenses": [{ "expression": "MIT OR Apache-2.0" }],
                "hashes": [{ "alg": "SHA-256", "content": "00ff" }],
            }])
        );
    }

    #[test]
    fn the_bills_of_this_workspace_hold_what_is_linked_and_nothing_else() {
        let names = |selection| -> BTreeSet<String> {
            let packages = packages::built(selection).expect("cargo tells the packages");
            packages.into_iter().map(|package| package.name).collect()
        };
        let [(_, tool), _, (_, firmware)] = RELEASED.map(|(name, words)| (name, names(words)));
        assert!(tool.contains("host-tool") && tool.contains("nusb"));
        assert!(!tool.contains("proptest"), "it is for tests only");
        assert!(firmware.contains("embassy-stm32") && firmware.contains("control-core"));
        assert!(
            !firmware.contains("semihosting"),
            "it is for the emulated board"
        );
        assert!(!firmware.contains("nalgebra"), "it is for the build script");
    }
}
