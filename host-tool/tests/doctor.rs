//! `doctor` in front of systems made of files.

mod common;

use std::fs;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixListener;
use std::path::Path;

use common::{host_tool, no_boards};
use host_tool::doctor::{Finding, FindingKind, Surroundings};
use mirror_protocol::usb::{
    BOOTLOADER_PRODUCT_ID, BOOTLOADER_VENDOR_ID, PRODUCT, PRODUCT_ID, VENDOR_ID,
};
use tempfile::TempDir;

const RULES: &str = include_str!("../../packaging/70-mirror-driver.rules");

struct System(TempDir);

impl System {
    fn new() -> Self {
        let system = Self(tempfile::tempdir().expect("a directory"));
        for directory in ["sys/bus/usb/devices", "nodes", "rules", "boards"] {
            fs::create_dir_all(system.path(directory)).expect("a directory");
        }
        system.set_mode("boards", 0o700);
        system
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn set_mode(&self, name: &str, mode: u32) {
        let mode = fs::Permissions::from_mode(mode);
        fs::set_permissions(self.path(name), mode).expect("ours");
    }

    fn plug(&self, port: &str, ids: (u16, u16), product: &str) {
        let directory = self.path("sys/bus/usb/devices").join(port);
        fs::create_dir(&directory).expect("a new port");
        for (name, text) in [
            ("idVendor", format!("{:04x}", ids.0)),
            ("idProduct", format!("{:04x}", ids.1)),
            ("busnum", "3".to_owned()),
            ("devnum", "14".to_owned()),
            ("product", product.to_owned()),
            ("serial", "0042".to_owned()),
        ] {
            fs::write(directory.join(name), text + "\n").expect("a file");
        }
    }

    fn examine(&self, open: fn(&Path) -> io::Result<()>) -> Vec<Finding> {
        let surroundings = Surroundings {
            sysfs: self.path("sys"),
            usb_nodes: self.path("nodes"),
            udev_rules: vec![self.path("rules")],
            boards: self.path("boards"),
            open,
        };
        surroundings.examine()
    }
}

fn opens(_node: &Path) -> io::Result<()> {
    Ok(())
}

fn denies(node: &Path) -> io::Result<()> {
    assert!(node.ends_with("nodes/003/014"), "{}", node.display());
    Err(io::ErrorKind::PermissionDenied.into())
}

/// The one finding, its words, and its remedy.
fn only(findings: Vec<Finding>) -> (FindingKind, String, String) {
    let [finding] = &findings[..] else {
        panic!("{findings:?}");
    };
    let remedy = finding.remedy.clone().expect("a remedy");
    (finding.kind, finding.what.clone(), remedy)
}

#[test]
fn nothing_is_said_of_a_board_that_can_be_opened() {
    let system = System::new();
    system.plug("1-2", (VENDOR_ID, PRODUCT_ID), PRODUCT);
    assert_eq!(system.examine(opens), []);
}

#[test]
fn without_permission_it_tells_of_the_rule_where_there_is_none() {
    let system = System::new();
    system.plug("1-2", (VENDOR_ID, PRODUCT_ID), PRODUCT);
    let (kind, what, remedy) = only(system.examine(denies));
    assert_eq!(kind, FindingKind::NoPermission);
    assert!(what.contains("0042") && what.contains("003/014"), "{what}");
    assert!(remedy.contains("70-mirror-driver.rules"), "{remedy}");

    fs::write(system.path("rules/70-mirror-driver.rules"), RULES).expect("a file");
    let (kind, _, remedy) = only(system.examine(denies));
    assert_eq!(kind, FindingKind::NoPermission);
    assert!(remedy.contains("plug the board in again"), "{remedy}");
}

#[test]
fn a_node_that_is_not_there_is_another_matter_than_permission() {
    let system = System::new();
    system.plug("1-2", (VENDOR_ID, PRODUCT_ID), PRODUCT);
    let (kind, what, _) = only(system.examine(|node| fs::File::open(node).map(drop)));
    assert_eq!(kind, FindingKind::NoNode);
    assert!(what.contains("No such file"), "{what}");
}

#[test]
fn what_is_on_usb_instead_is_named() {
    for (ids, product, kind, word) in [
        (
            (BOOTLOADER_VENDOR_ID, BOOTLOADER_PRODUCT_ID),
            "STM32  BOOTLOADER",
            FindingKind::Bootloader,
            "update",
        ),
        (
            (0x0483, 0x374e),
            "STLINK-V3",
            FindingKind::DebuggerOnly,
            "flash",
        ),
        (
            (VENDOR_ID, PRODUCT_ID),
            "A keyboard",
            FindingKind::Stranger,
            "tests",
        ),
        (
            (0x1d6b, 0x0002),
            "xHCI Host Controller",
            FindingKind::NothingOnUsb,
            "cable",
        ),
    ] {
        let system = System::new();
        system.plug("usb1", ids, product);
        let (found, what, remedy) = only(system.examine(opens));
        assert_eq!(found, kind, "{what}");
        assert!(remedy.contains(word), "{remedy}");
    }
}

#[test]
fn a_debugger_beside_a_board_is_as_it_should_be() {
    let system = System::new();
    system.plug("1-2", (VENDOR_ID, PRODUCT_ID), PRODUCT);
    system.plug("1-3", (0x0483, 0x374b), "STLINK-V2.1");
    fs::create_dir(system.path("sys/bus/usb/devices/1-3:1.0")).expect("an interface");
    assert_eq!(system.examine(opens), []);
}

#[test]
fn a_system_without_usb_and_a_dead_socket_are_told() {
    let system = System::new();
    fs::remove_dir_all(system.path("sys")).expect("it goes");
    drop(UnixListener::bind(system.path("boards/old.sock")).expect("a socket"));
    let _alive = UnixListener::bind(system.path("boards/alive.sock")).expect("a socket");
    let findings = system.examine(opens);
    let kinds: Vec<FindingKind> = findings.iter().map(|finding| finding.kind).collect();
    assert_eq!(kinds, [FindingKind::NoUsb, FindingKind::DeadSocket]);
    assert!(findings[1].what.contains("old.sock"), "{findings:?}");
}

#[test]
fn a_folder_of_boards_that_others_write_to_is_told_and_not_looked_into() {
    let system = System::new();
    system.plug("1-2", (VENDOR_ID, PRODUCT_ID), PRODUCT);
    drop(UnixListener::bind(system.path("boards/old.sock")).expect("a socket"));
    system.set_mode("boards", 0o770);
    let (kind, what, remedy) = only(system.examine(opens));
    assert_eq!(kind, FindingKind::UntrustedFolder);
    assert!(what.contains("mode 770"), "{what}");
    assert!(remedy.contains("chmod 700"), "{remedy}");
    fs::remove_dir_all(system.path("boards")).expect("ours");
    assert_eq!(system.examine(opens), [], "no boards are no fault");
}

#[test]
fn the_rules_name_board_and_bootloader() {
    for (vendor, product) in [
        (VENDOR_ID, PRODUCT_ID),
        (BOOTLOADER_VENDOR_ID, BOOTLOADER_PRODUCT_ID),
    ] {
        let rule = format!(
            "SUBSYSTEM==\"usb\", ATTR{{idVendor}}==\"{vendor:04x}\", \
             ATTR{{idProduct}}==\"{product:04x}\", TAG+=\"uaccess\""
        );
        assert!(RULES.lines().any(|line| line == rule), "{rule}");
    }
}

#[test]
fn the_command_says_so_and_fails_where_no_board_is_ready() {
    let boards = no_boards();
    drop(UnixListener::bind(boards.path().join("gone.sock")).expect("a socket"));
    let said = host_tool(boards.path(), &["doctor"]);
    assert_eq!(said.code, 1);
    assert!(
        said.out.contains("gone.sock ended without tidying up"),
        "{}",
        said.out
    );
    assert!(
        said.sentence().contains("no board is ready"),
        "{}",
        said.err
    );
    let report: serde_json::Value =
        serde_json::from_str(&host_tool(boards.path(), &["doctor", "--json"]).out).expect("JSON");
    let findings = report["findings"].as_array().expect("findings");
    assert!(
        findings
            .iter()
            .any(|finding| finding["kind"] == "dead-socket")
    );
}
