//! Why a board is not found: what the system shows of it, and what to do.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use board_sockets::{boards_directory, check_folder, is_listening};
use mirror_protocol::usb::{BOOTLOADER_PRODUCT_ID, BOOTLOADER_VENDOR_ID};
use mirror_protocol::usb::{PRODUCT, PRODUCT_ID, VENDOR_ID};
use serde::Serialize;

/// ST-Link debuggers, as on a Nucleo board (ST's vendor id).
const DEBUGGER_PRODUCT_IDS: [u16; 5] = [0x3748, 0x374b, 0x374d, 0x374e, 0x3753];

const INSTALL_RULE: &str = "install the rule that comes with this tool: \
     `sudo cp packaging/70-mirror-driver.rules /etc/udev/rules.d/ && sudo udevadm control --reload \
     && sudo udevadm trigger`, then plug the board in again";

/// Where to look. Tests look elsewhere.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// Kernel objects.
    pub sysfs: PathBuf,
    /// USB device nodes.
    pub usb_nodes: PathBuf,
    /// Directories of udev rules.
    pub udev_rules: Vec<PathBuf>,
    /// Sockets of emulated boards.
    pub boards: PathBuf,
    /// Opens a device node for reading and writing.
    pub open: fn(&Path) -> io::Result<()>,
}

/// Something that was found out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What it is.
    pub kind: FindingKind,
    /// What was found, in words.
    pub what: String,
    /// What to do about it.
    pub remedy: Option<String>,
}

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FindingKind {
    /// A board that can be used.
    Ready,
    /// A board that another process has.
    InUse,
    /// A chip whose option bytes are not as its board wants them.
    OptionBytes,
    /// A board that does not answer as it should.
    NotAnswering,
    /// A board whose device node may not be opened.
    NoPermission,
    /// A board whose device node cannot be opened for another reason.
    NoNode,
    /// A board, or another of its kind, in its bootloader.
    Bootloader,
    /// Another device with the board's USB identity.
    Stranger,
    /// A debugger without the board's own USB.
    DebuggerOnly,
    /// Nothing on USB that could be a board.
    NothingOnUsb,
    /// A system without USB.
    NoUsb,
    /// The socket of an emulated board that is gone.
    DeadSocket,
    /// The folder of emulated boards, where other users could have put them there.
    UntrustedFolder,
}

impl Surroundings {
    /// This machine.
    pub fn of_this_machine() -> Self {
        Self {
            sysfs: "/sys".into(),
            usb_nodes: "/dev/bus/usb".into(),
            udev_rules: [
                "/etc/udev/rules.d",
                "/run/udev/rules.d",
                "/usr/lib/udev/rules.d",
            ]
            .map(PathBuf::from)
            .into(),
            boards: boards_directory(),
            open: |node| {
                let mut options = fs::File::options();
                options.read(true).write(true).open(node).map(drop)
            },
        }
    }

    /// What stands in the way of boards. Boards in whose way nothing stands are not in it; they can be
    /// asked themselves.
    pub fn examine(&self) -> Vec<Finding> {
        let mut findings = self.examine_usb();
        findings.extend(match self.examine_folder() {
            Some(untrusted) => vec![untrusted],
            None => self.dead_sockets(),
        });
        findings
    }

    fn examine_usb(&self) -> Vec<Finding> {
        let Ok(devices) = UsbDevice::all(&self.sysfs) else {
            return vec![Finding {
                kind: FindingKind::NoUsb,
                what: "this system shows no USB bus".to_owned(),
                remedy: Some(
                    "in a container or a virtual machine, hand the board's USB device through to it"
                        .to_owned(),
                ),
            }];
        };
        let boards: Vec<&UsbDevice> = devices.iter().filter(|device| device.is_board()).collect();
        let mut findings: Vec<Finding> = devices
            .iter()
            .filter_map(|device| self.examine_device(device, !boards.is_empty()))
            .collect();
        if boards.is_empty() && findings.is_empty() {
            findings.push(Finding {
                kind: FindingKind::NothingOnUsb,
                what: "no driver board is on USB, nor one in its bootloader".to_owned(),
                remedy: Some(
                    "is the board powered, and is the cable one for data? Many cables only charge. \
                     `dmesg --follow` shows whether the system notices it when you plug it in. \
                     Without a board: `cargo xtask emulate`"
                        .to_owned(),
                ),
            });
        }
        findings
    }

    fn examine_device(&self, device: &UsbDevice, has_board: bool) -> Option<Finding> {
        let name = device.describe();
        let (kind, what, remedy) = if device.is_board() {
            return self.examine_node(device);
        } else if device.ids == (VENDOR_ID, PRODUCT_ID) {
            (
                FindingKind::Stranger,
                format!("{name} has the driver board's USB identity, and is none"),
                "nothing: that identity is one for tests, which others use too".to_owned(),
            )
        } else if device.ids == (BOOTLOADER_VENDOR_ID, BOOTLOADER_PRODUCT_ID) {
            (
                FindingKind::Bootloader,
                format!("{name} is a microcontroller in its bootloader, perhaps a driver board"),
                "give it firmware: `host-tool update FILE`; or plug it in again, without the BOOT0 \
                 jumper, to start what it has"
                    .to_owned(),
            )
        } else if device.is_debugger() && !has_board {
            (
                FindingKind::DebuggerOnly,
                format!("{name} is a debugger, and the board's own USB is not connected"),
                "connect the board's own USB too (PA11 and PA12 on a Nucleo), or write the firmware \
                 first: `cargo xtask flash`"
                    .to_owned(),
            )
        } else {
            return None;
        };
        Some(Finding {
            kind,
            what,
            remedy: Some(remedy),
        })
    }

    /// Whether the board's node can be opened; `None` where it can.
    fn examine_node(&self, device: &UsbDevice) -> Option<Finding> {
        let node = device.node(&self.usb_nodes);
        let error = (self.open)(&node).err()?;
        let name = device.describe();
        if error.kind() != io::ErrorKind::PermissionDenied {
            return Some(Finding {
                kind: FindingKind::NoNode,
                what: format!("{name}: {} cannot be opened: {error}", node.display()),
                remedy: Some(
                    "plug it in again; in a container, hand /dev/bus/usb through to it".to_owned(),
                ),
            });
        }
        let remedy = match self.has_rule() {
            true => {
                "the udev rule is there: plug the board in again. Over ssh, where nobody sits at \
                     the machine, add yourself to the group that owns the node, or use sudo"
                    .to_owned()
            }
            false => INSTALL_RULE.to_owned(),
        };
        Some(Finding {
            kind: FindingKind::NoPermission,
            what: format!("{name}: you may not open {}", node.display()),
            remedy: Some(remedy),
        })
    }

    /// Whether a udev rule names the board.
    fn has_rule(&self) -> bool {
        let names_it = |text: &str| {
            let named = |id: u16| text.contains(&format!("{id:04x}"));
            named(VENDOR_ID) && named(PRODUCT_ID)
        };
        entries(&self.udev_rules)
            .filter(|path| path.extension().is_some_and(|ending| ending == "rules"))
            .filter_map(|path| fs::read_to_string(path).ok())
            .any(|rules| {
                rules
                    .lines()
                    .any(|line| !line.starts_with('#') && names_it(line))
            })
    }

    /// Whether emulated boards are where nobody else can put one; `None` where they are, or where there are none.
    fn examine_folder(&self) -> Option<Finding> {
        let untrusted = check_folder(&self.boards).err()?;
        self.boards.exists().then(|| Finding {
            kind: FindingKind::UntrustedFolder,
            what: format!("emulated boards are not looked for: {untrusted}"),
            remedy: Some(format!(
                "if the folder is yours, `chmod 700 {}`; if not, name another by MIRROR_BOARDS",
                self.boards.display()
            )),
        })
    }

    fn dead_sockets(&self) -> Vec<Finding> {
        entries(std::slice::from_ref(&self.boards))
            .filter(|path| path.extension().is_some_and(|ending| ending == "sock"))
            .filter(|path| !is_listening(path))
            .map(|path| Finding {
                kind: FindingKind::DeadSocket,
                what: format!(
                    "the emulated board at {} ended without tidying up",
                    path.display()
                ),
                remedy: Some(format!(
                    "start it again with `cargo xtask emulate`, or remove the file: `rm {}`",
                    path.display()
                )),
            })
            .collect()
    }
}

/// What lies in `directories`, as far as they are there, by name.
fn entries(directories: &[PathBuf]) -> impl Iterator<Item = PathBuf> {
    let mut paths: Vec<PathBuf> = directories
        .iter()
        .filter_map(|directory| fs::read_dir(directory).ok())
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .collect();
    paths.sort();
    paths.into_iter()
}

/// A device as sysfs shows it.
struct UsbDevice {
    ids: (u16, u16),
    bus: u16,
    device: u16,
    product: Option<String>,
    serial: Option<String>,
}

impl UsbDevice {
    fn all(sysfs: &Path) -> io::Result<Vec<Self>> {
        let directory = sysfs.join("bus/usb/devices");
        fs::read_dir(&directory)?;
        // Interfaces lie beside the devices, and have no vendor.
        Ok(entries(&[directory])
            .filter_map(|path| Self::read(&path))
            .collect())
    }

    fn read(path: &Path) -> Option<Self> {
        let text = |name: &str| {
            let text = fs::read_to_string(path.join(name)).ok()?;
            Some(text.trim().to_owned())
        };
        let hex = |name: &str| u16::from_str_radix(&text(name)?, 16).ok();
        let decimal = |name: &str| text(name)?.parse().ok();
        Some(Self {
            ids: (hex("idVendor")?, hex("idProduct")?),
            bus: decimal("busnum")?,
            device: decimal("devnum")?,
            product: text("product"),
            serial: text("serial"),
        })
    }

    fn is_board(&self) -> bool {
        self.ids == (VENDOR_ID, PRODUCT_ID)
            && self
                .product
                .as_deref()
                .is_none_or(|product| product == PRODUCT)
    }

    fn is_debugger(&self) -> bool {
        self.ids.0 == BOOTLOADER_VENDOR_ID && DEBUGGER_PRODUCT_IDS.contains(&self.ids.1)
    }

    fn node(&self, usb_nodes: &Path) -> PathBuf {
        usb_nodes.join(format!("{:03}/{:03}", self.bus, self.device))
    }

    fn describe(&self) -> String {
        let product = self.product.as_deref().unwrap_or("a device without a name");
        let serial = self
            .serial
            .as_deref()
            .map(|serial| format!(", serial number {serial}"));
        format!(
            "{product} (USB {:04x}:{:04x}{})",
            self.ids.0,
            self.ids.1,
            serial.unwrap_or_default()
        )
    }
}
