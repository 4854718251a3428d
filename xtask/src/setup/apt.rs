//! How a package is installed by apt without any other being removed or downgraded.
//!
//! A machine may hold a newer part of the same software than the release that apt prefers has, as Debian's `qemu-utils` from
//! backports beside a `qemu-system-common` that it breaks. Then the preferred version costs that part, and the version of the
//! other release does not. So every release is simulated first, and the first that costs nothing is taken.

use std::fmt;

/// What `apt-get --simulate install` says would happen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Simulation {
    /// Nothing is removed and nothing downgraded.
    Harmless,
    /// These packages would be removed or downgraded.
    Costs(Vec<String>),
    /// apt finds no way; its words.
    Impossible(String),
}

impl Simulation {
    /// Reads what apt printed in the C locale, and whether it succeeded.
    pub(super) fn read(succeeded: bool, said: &str) -> Self {
        if !succeeded {
            let mut lines = said.lines().map(str::trim);
            let reason = lines.find(|line| line.contains(" : ") || line.starts_with("E: "));
            return Self::Impossible(reason.unwrap_or("apt does not say why").to_owned());
        }
        let removed = said.lines().filter_map(|line| {
            let mut words = line.strip_prefix("Remv ")?.split_whitespace();
            words.next()
        });
        let downgraded = said
            .lines()
            .skip_while(|line| !line.contains("will be DOWNGRADED"))
            .skip(1)
            .take_while(|line| line.starts_with(' '))
            .flat_map(str::split_whitespace);
        let lost: Vec<String> = removed.chain(downgraded).map(str::to_owned).collect();
        match lost.is_empty() {
            true => Self::Harmless,
            false => Self::Costs(lost),
        }
    }
}

impl fmt::Display for Simulation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Harmless => write!(f, "costs nothing"),
            Self::Costs(packages) => {
                write!(f, "would remove or downgrade {}", packages.join(", "))
            }
            Self::Impossible(reason) => write!(f, "is impossible: {reason}"),
        }
    }
}

/// The packages that an installation would add, from what `apt-get --simulate install` says.
pub(super) fn added(said: &str) -> Vec<String> {
    said.lines()
        .filter_map(|line| {
            let (name, rest) = line.strip_prefix("Inst ")?.split_once(' ')?;
            // An upgrade tells in brackets what is there.
            let version = rest.strip_prefix('(')?.split_whitespace().next()?;
            Some(format!("{name}={version}"))
        })
        .collect()
}

/// Which version to install: the one that apt prefers, or that of a release.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum From {
    Preferred,
    Release(String),
}

impl From {
    /// The words that tell `apt-get install` so.
    pub(super) fn words(&self) -> Vec<&str> {
        match self {
            Self::Preferred => vec![],
            Self::Release(name) => vec!["--target-release", name],
        }
    }
}

impl fmt::Display for From {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Preferred => write!(f, "the version that apt prefers"),
            Self::Release(name) => write!(f, "the version of {name}"),
        }
    }
}

/// The versions to try, from what `apt-cache madison PACKAGE` prints: `package | version | address release/part ...`.
pub(super) fn candidates(madison: &str) -> Vec<From> {
    let mut all = vec![From::Preferred];
    for line in madison.lines() {
        let source = line.split('|').nth(2).unwrap_or_default();
        let release = source.split_whitespace().nth(1).unwrap_or_default();
        let Some((release, _)) = release.split_once('/') else {
            continue;
        };
        let named = From::Release(release.to_owned());
        if !all.contains(&named) {
            all.push(named);
        }
    }
    all
}

/// The first candidate that costs nothing, or why there is none.
pub(super) fn choose<E>(
    candidates: Vec<From>,
    mut simulate: impl FnMut(&From) -> Result<Simulation, E>,
) -> Result<Result<From, Vec<String>>, E> {
    let mut refused = Vec::new();
    for candidate in candidates {
        match simulate(&candidate)? {
            Simulation::Harmless => return Ok(Ok(candidate)),
            other => refused.push(format!("{candidate} {other}")),
        }
    }
    Ok(Err(refused))
}

/// What apt 2.6.1 printed for `apt-get --simulate install --no-install-recommends qemu-system-arm` on Debian 12.
#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    /// Nothing of QEMU was there.
    const INSTALLS: &str = include_str!("apt/installs.txt");
    /// `qemu-utils` of bookworm-backports was there, as in what follows.
    const REFUSES: &str = include_str!("apt/refuses.txt");
    /// The same with `--target-release bookworm-backports`.
    const INSTALLS_NEWER: &str = include_str!("apt/installs-newer.txt");
    /// The same with `qemu-utils-`.
    const REMOVES: &str = include_str!("apt/removes.txt");
    /// The same with `qemu-utils/bookworm`.
    const DOWNGRADES: &str = include_str!("apt/downgrades.txt");
    /// `apt-cache madison qemu-system-arm`.
    const MADISON: &str = include_str!("apt/madison.txt");

    fn qemu_utils() -> Simulation {
        Simulation::Costs(vec!["qemu-utils".to_owned()])
    }

    fn backports() -> From {
        From::Release("bookworm-backports".to_owned())
    }

    #[test]
    fn an_installation_that_only_adds_is_harmless() {
        assert_eq!(Simulation::read(true, INSTALLS), Simulation::Harmless);
        assert_eq!(Simulation::read(true, INSTALLS_NEWER), Simulation::Harmless);
    }

    #[test]
    fn a_removed_or_downgraded_package_is_named() {
        assert_eq!(Simulation::read(true, REMOVES), qemu_utils());
        assert_eq!(Simulation::read(true, DOWNGRADES), qemu_utils());
    }

    #[test]
    fn what_would_be_added_is_named_with_its_version() {
        let added = added(REMOVES);
        assert!(
            added.contains(&"qemu-system-arm=1:7.2+dfsg-7+deb12u18+b3".to_owned()),
            "{added:?}"
        );
        assert_eq!(
            super::added(
                "Inst perl [5.36.0-7+deb12u2] (5.36.0-7+deb12u3 Debian)\nRemv qemu-utils [1:10]"
            ),
            [""; 0]
        );
    }

    #[test]
    fn the_reason_of_a_refusal_is_kept() {
        let Simulation::Impossible(reason) = Simulation::read(false, REFUSES) else {
            panic!("apt refused");
        };
        assert!(reason.starts_with("qemu-utils : Breaks: qemu-system-common"));
    }

    #[test]
    fn the_preferred_version_is_tried_first_and_then_every_release() {
        let bookworm = From::Release("bookworm".to_owned());
        assert_eq!(
            candidates(MADISON),
            [From::Preferred, backports(), bookworm]
        );
        assert_eq!(candidates(""), [From::Preferred]);
    }

    #[test]
    fn the_release_that_keeps_everything_is_chosen() {
        for preferred in [(false, REFUSES), (true, REMOVES), (true, DOWNGRADES)] {
            let chosen = choose(candidates(MADISON), |candidate| {
                let (succeeded, said) = match candidate {
                    From::Release(name) if name == "bookworm-backports" => (true, INSTALLS_NEWER),
                    _ => preferred,
                };
                Ok::<_, Infallible>(Simulation::read(succeeded, said))
            });
            assert_eq!(chosen, Ok(Ok(backports())));
        }
    }

    #[test]
    fn where_every_version_costs_something_nothing_is_chosen() {
        let chosen = choose(vec![From::Preferred, backports()], |_| {
            Ok::<_, Infallible>(Simulation::read(true, REMOVES))
        });
        let costs = "would remove or downgrade qemu-utils";
        assert_eq!(
            chosen,
            Ok(Err(vec![
                format!("the version that apt prefers {costs}"),
                format!("the version of bookworm-backports {costs}"),
            ]))
        );
    }
}
