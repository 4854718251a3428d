//! The emulator: the one that is there, or one from the system's packages that costs no other package.

use super::package::{self, said_in};
use super::unpack::unpack;
use crate::cargo::program;
use anyhow::{Context, Result, bail};

/// The emulator's program, and the package of Debian, Fedora and Arch that has it.
const QEMU: &str = "qemu-system-arm";

/// The first QEMU with the machine `mps2-an386` (<https://wiki.qemu.org/ChangeLog/5.2#Arm>).
const OLDEST: Version = (5, 2);
/// The oldest that all tests ran under, Debian 12's.
const TESTED: Version = (7, 2);

const BY_HAND: &str = "install QEMU for Arm yourself: Debian and Ubuntu `apt-get install --no-remove qemu-system-arm`, Fedora \
                       `dnf install qemu-system-arm`, Arch `pacman -S qemu-system-arm`";

/// Major and minor.
type Version = (u32, u32);

/// What is to be done about the QEMU that is there or not.
#[derive(Debug, PartialEq, Eq)]
enum Present {
    Tested,
    /// It has what is needed, and nobody has tried it.
    Untested(Version),
    TooOld(Version),
    Missing,
}

impl Present {
    /// From what `qemu-system-arm --version` printed, if it ran.
    fn read(said: Option<&str>) -> Self {
        match said.and_then(version) {
            None => Self::Missing,
            Some(version) if version < OLDEST => Self::TooOld(version),
            Some(version) if version < TESTED => Self::Untested(version),
            Some(_) => Self::Tested,
        }
    }
}

/// The version in `QEMU emulator version 7.2.22 (...)`.
fn version(said: &str) -> Option<Version> {
    let (_, after) = said.split_once("version ")?;
    let mut numbers = after.split(|c: char| !c.is_ascii_digit());
    Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
}

/// Makes sure that the emulator is there.
pub fn qemu() -> Result<()> {
    match present() {
        Present::Tested => return Ok(()),
        Present::Untested((major, minor)) => {
            let (tested_major, tested_minor) = TESTED;
            eprintln!(
                "{QEMU} is of version {major}.{minor}; the tests have run under {tested_major}.{tested_minor} and newer."
            );
            return Ok(());
        }
        Present::TooOld((major, minor)) => {
            let (oldest_major, oldest_minor) = OLDEST;
            bail!(
                "{QEMU} {major}.{minor} does not emulate the board; it takes {oldest_major}.{oldest_minor}, or better \
                 a release of these years. Nothing was changed: upgrade it, or put a newer one before it in PATH"
            );
        }
        Present::Missing => {}
    }
    eprintln!("The emulator ({QEMU}) is missing; installing it from the system's packages.");
    if let Some(reason) = package::install(QEMU).context(BY_HAND)? {
        eprintln!(
            "It is not installed:\n  {reason}\nUnpacking it for this workspace alone; the system stays as it is."
        );
        unpack(QEMU).context(BY_HAND)?;
    }
    match present() {
        Present::Tested | Present::Untested(_) => Ok(()),
        Present::TooOld(_) | Present::Missing => bail!("{QEMU} is still not there; {BY_HAND}"),
    }
}

fn present() -> Present {
    let output = program(QEMU).arg("--version").output();
    let said = output.ok().filter(|output| output.status.success());
    Present::read(said.map(|output| said_in(&output.stdout)).as_deref())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_is_read() {
        let debian = "QEMU emulator version 7.2.22 (Debian 1:7.2+dfsg-7+deb12u18+b2)\nCopyright";
        assert_eq!(version(debian), Some((7, 2)));
        assert_eq!(version("QEMU emulator version 10.0.2"), Some((10, 0)));
        assert_eq!(version("no emulator"), None);
    }

    #[test]
    fn an_emulator_that_does_is_used() {
        let of = |version: &str| Present::read(Some(&format!("QEMU emulator version {version}")));
        assert_eq!(of("10.0.2"), Present::Tested);
        assert_eq!(of("7.2.0"), Present::Tested);
        assert_eq!(of("6.2.0"), Present::Untested((6, 2)));
        assert_eq!(of("4.2.1"), Present::TooOld((4, 2)));
        assert_eq!(Present::read(None), Present::Missing);
    }
}
