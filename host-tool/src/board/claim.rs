//! Having a board: a tool locks a file beside the board's socket and writes into it who it is. The lock goes with the
//! process, however that ends; the file stays and means nothing without it.

use std::fs::{File, TryLockError};
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

use tokio::time::{Instant, sleep};

use super::answer::ANSWER_TIMEOUT;
use super::find::Found;
use super::owner::{Owner, place, read};
use super::stop_mark::StopMark;
use crate::error::ToolError;
use crate::system::private_file;
use crate::verbosity::note;

/// From one look at the lock to the next.
const RETRY: Duration = Duration::from_millis(20);

/// A board is this process's until it is dropped.
#[derive(Debug)]
pub(super) struct Claim {
    _locked: File,
    /// Who had it before, and was waited for.
    pub(super) before: Option<Owner>,
}

/// What an attempt to lock came to.
enum Attempt {
    Taken(File),
    /// By another, who may not have written down who it is yet.
    Busy(Option<Owner>),
}

/// How long a tool that only looks waits: most that have a board for a moment have let go by then, and nobody minds.
pub(super) const GLANCE: Duration = Duration::from_millis(300);

/// What became of an attempt to take a board.
pub(super) enum Claimed {
    /// It is this process's. `None` where there is no place for a lock; the link itself then lets in one at a time.
    Ours(Option<Claim>),
    /// Another has it, who may not have written down who it is.
    Anothers(Option<Owner>),
}

impl Claim {
    /// Takes the board, and waits while another has it, which is said at once.
    ///
    /// # Errors
    /// Where the other does not let go, or stops the board meanwhile.
    pub(super) async fn take(found: &Found, mark: &StopMark) -> Result<Option<Self>, ToolError> {
        let say = |owner: &Owner| {
            note(format_args!(
                "waiting for the board {}: it is in use by {owner}",
                found.name
            ));
        };
        match Self::within(found, ANSWER_TIMEOUT, say, || mark.check(found)).await? {
            Claimed::Ours(claim) => Ok(claim),
            Claimed::Anothers(owner) => Err(in_use(found, owner.as_ref())),
        }
    }

    /// Takes the board if nobody else has it for longer than a moment.
    pub(super) async fn at_a_glance(found: &Found) -> Claimed {
        let taken = Self::within(found, GLANCE, |_| (), || Ok(())).await;
        taken.unwrap_or(Claimed::Anothers(None))
    }

    async fn within(
        found: &Found,
        patience: Duration,
        say: impl Fn(&Owner),
        go_on: impl Fn() -> Result<(), ToolError>,
    ) -> Result<Claimed, ToolError> {
        let Some(path) = place(found) else {
            return Ok(Claimed::Ours(None));
        };
        let start = Instant::now();
        let mut before = None;
        loop {
            match attempt(&path) {
                Err(_) => return Ok(Claimed::Ours(None)),
                Ok(Attempt::Taken(file)) => {
                    return Ok(Claimed::Ours(Some(Self {
                        _locked: file,
                        before,
                    })));
                }
                Ok(Attempt::Busy(owner)) => {
                    if let (None, Some(owner)) = (&before, &owner) {
                        say(owner);
                    }
                    before = before.or(owner);
                }
            }
            go_on()?;
            if start.elapsed() > patience {
                return Ok(Claimed::Anothers(before));
            }
            sleep(RETRY).await;
        }
    }
}

/// That another has the board.
pub(super) fn in_use(found: &Found, owner: Option<&Owner>) -> ToolError {
    ToolError::InUse {
        board: found.name.clone(),
        owner: owner.map_or("another process".to_owned(), Owner::to_string),
    }
}

fn attempt(path: &Path) -> io::Result<Attempt> {
    let mut file = private_file().create(true).truncate(false).open(path)?;
    match file.try_lock() {
        Ok(()) => {
            let owner = serde_json::to_string(&Owner::this_process())?;
            file.set_len(0)?;
            file.write_all(owner.as_bytes())?;
            Ok(Attempt::Taken(file))
        }
        Err(TryLockError::WouldBlock) => Ok(Attempt::Busy(read(&mut file))),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::{PermissionsExt, symlink};

    use board_sockets::make_folder;

    use super::super::find::Place;
    use super::super::owner::owner;
    use super::super::stop_mark::announce_stop;
    use super::*;

    fn board(directory: &Path) -> Found {
        let path = directory.join("a.sock");
        fs::write(&path, "").expect("a file");
        Found {
            name: "a".to_owned(),
            place: Place::Socket { path },
        }
    }

    #[tokio::test]
    async fn a_board_is_one_s_own_until_one_lets_go() {
        let directory = tempfile::tempdir().expect("a directory");
        let found = board(directory.path());
        assert_eq!(owner(&found), None, "nobody was there");
        let mark = StopMark::read(&found);
        let take = || Claim::take(&found, &mark);
        let claim = take().await.expect("free").expect("a place");
        assert_eq!(claim.before, None);
        let now = owner(&found).expect("it is taken");
        assert_eq!(now.process, std::process::id());
        assert_eq!(Some(now.clone()), owner(&found), "asking changes nothing");

        let Claimed::Anothers(told) = Claim::at_a_glance(&found).await else {
            panic!("it is taken");
        };
        assert_eq!(told, Some(now.clone()));
        let mut waiting = Box::pin(take());
        let early = tokio::time::timeout(3 * RETRY, &mut waiting).await;
        assert!(early.is_err(), "it waits");
        drop(claim);
        let second = waiting.await.expect("free").expect("a place");
        assert_eq!(second.before, Some(now), "it knows whom it waited for");
        drop(second);
        assert_eq!(owner(&found), None, "what the file says is nothing");
    }

    #[tokio::test]
    async fn who_waits_for_a_board_that_is_stopped_meanwhile_does_not_get_it() {
        let directory = tempfile::tempdir().expect("a directory");
        let found = board(directory.path());
        // An earlier stop is no reason not to begin.
        announce_stop(&found);
        let mark = StopMark::read(&found);
        let claim = Claim::take(&found, &mark).await.expect("free");
        let mut waiting = Box::pin(Claim::take(&found, &mark));
        let early = tokio::time::timeout(3 * RETRY, &mut waiting).await;
        assert!(early.is_err(), "it waits");
        // Another process: this one's stops within the same second are the same.
        fs::write(directory.path().join("a.stopped"), "another").expect("a file");
        let said = waiting.await.expect_err("it was stopped").to_string();
        assert!(said.contains("was turned off"), "{said}");
        drop(claim);
        assert!(mark.check(&found).is_err(), "afterwards too");
    }

    #[test]
    fn file_and_directory_are_private_and_links_are_not_followed() {
        let directory = tempfile::tempdir().expect("a directory");
        let private = directory.path().join("one/two");
        make_folder(&private).expect("made");
        make_folder(&private).expect("there already");
        let lock = private.join("a.lock");
        assert!(matches!(attempt(&lock), Ok(Attempt::Taken(_))));
        let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode() & 0o777;
        assert_eq!((mode(&private), mode(&lock)), (0o700, 0o600));

        let precious = directory.path().join("precious");
        fs::write(&precious, "precious").expect("a file");
        let link = private.join("b.lock");
        symlink(&precious, &link).expect("a link");
        assert!(attempt(&link).is_err());
        assert_eq!(fs::read(&precious).expect("there"), b"precious");
    }

    #[test]
    fn what_others_write_is_nobody_or_shown_without_harm() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.lock");
        for (text, command) in [
            ("", None),
            ("{", None),
            (&"x".repeat(10_000), None),
            (
                r#"{"process": 7, "command": "a\u001b[2Jb\n", "since": ""}"#,
                Some("a[2Jb"),
            ),
        ] {
            fs::write(&path, text).expect("a file");
            let holder = File::open(&path).expect("there");
            holder.lock().expect("free");
            let Ok(Attempt::Busy(owner)) = attempt(&path) else {
                panic!("it is taken");
            };
            assert_eq!(owner.as_ref().map(|owner| &*owner.command), command);
        }
    }
}
