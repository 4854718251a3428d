//! Mistakes in the sources of the driver board's drivers, each as a patch, and which test on the silicon twin finds it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;

use crate::cargo::workspace;
use crate::copy::{SourceCopy, check_fit};
use crate::images::{self, Board};
use crate::test_programs::{self, TestProgram};

/// Where they are: the first line of each says what it does.
const PATCHES: &str = "hil/tests/mistakes/sources";

/// How a patch's second line begins that no test can find.
const NOT_CAUGHT: &str = "Not caught: ";

/// What looks at a flashed image, the shortest first: a program of tests, and those of them that do.
const EXAMINERS: [(&str, &[&str]); 6] = [
    ("tests/mistakes", &["a_start"]),
    ("tests/silicon", &[]),
    ("tests/acceptance", &[]),
    ("tests/flashed", &[]),
    ("tests/unplugged", &[]),
    ("tests/faults", &[]),
];

/// A program of tests that takes ten times as long as the longest of them does waits for something that will not come.
const LONGEST: Duration = Duration::from_secs(400);

/// Fails where one of them no longer fits the sources.
pub(crate) fn fit() -> Result<()> {
    for patch in patches()? {
        check_fit(&patch)
            .context("a mistake for `cargo xtask mistakes`: change it with what it changes")?;
    }
    Ok(())
}

/// Builds the image with one mistake at a time, and prints what finds it.
///
/// # Errors
/// Where the image without a mistake fails, a patch does not fit or build, one is not found that nothing explains, or fewer than
/// 95 of a hundred are found.
pub(crate) fn try_all() -> Result<()> {
    let examiners = examiners()?;
    images::build(Board::Stm32g474)?;
    let sound = find(&examiners, &images::path(Board::Stm32g474))?;
    ensure!(sound.is_none(), "without any mistake: {sound:?}");
    let mistakes = build_all()?;
    let found = mistakes
        .par_iter()
        .map(|mistake| find(&examiners, &mistake.image));
    let found = found.collect::<Result<Vec<_>>>()?;
    let (mut caught, mut missed) = (0, Vec::new());
    for (mistake, found) in mistakes.iter().zip(&found) {
        let how = match (found, &mistake.not_caught) {
            (Some(tests), _) => tests.clone(),
            (None, Some(why)) => format!("not: {why}"),
            (None, None) => {
                missed.push(&mistake.what);
                "nothing".to_owned()
            }
        };
        println!("| {} | {how} |", mistake.what);
        caught += usize::from(found.is_some());
    }
    println!("{caught} of {} are caught", mistakes.len());
    ensure!(
        missed.is_empty(),
        "nothing finds, and nothing explains: {missed:#?}"
    );
    ensure!(caught * 100 >= mistakes.len() * 95, "fewer than 95 %");
    Ok(())
}

/// An image with a mistake.
struct Mistake {
    what: String,
    /// Why no test can find it.
    not_caught: Option<String>,
    image: PathBuf,
}

/// One after the other: cargo builds in one folder at a time.
fn build_all() -> Result<Vec<Mistake>> {
    let copy = SourceCopy::make("mistakes")?;
    let build = |patch: PathBuf| {
        copy.apply(&patch)?;
        let built = copy.build_image()?;
        copy.revert(&patch)?;
        let image = built.with_file_name(patch.file_stem().context("it has a name")?);
        fs::copy(built, &image)?;
        let (what, not_caught) = head(&fs::read_to_string(&patch)?);
        Ok(Mistake {
            what,
            not_caught,
            image,
        })
    };
    patches()?.into_iter().map(build).collect()
}

/// In the order of their names.
fn patches() -> Result<Vec<PathBuf>> {
    let folder = fs::read_dir(workspace().join(PATCHES)).context(PATCHES)?;
    let mut patches = folder
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<Vec<PathBuf>>>()?;
    patches.sort();
    Ok(patches)
}

/// What a patch says of itself before its changes: what it does, and why no test can find it, where none can.
fn head(patch: &str) -> (String, Option<String>) {
    let mut lines = patch.lines();
    let what = lines.next().unwrap_or_default();
    let not_caught = lines.next().and_then(|line| line.strip_prefix(NOT_CAUGHT));
    (what.to_owned(), not_caught.map(str::to_owned))
}

type Examiner = (TestProgram, &'static [&'static str]);

/// Programs of tests, each with the parts of the names of the tests in it that count.
fn examiners() -> Result<Vec<Examiner>> {
    let mut built = test_programs::build_and_lint()?;
    EXAMINERS
        .iter()
        .map(|(name, tests)| {
            let at = built.iter().position(|program| program.name == *name);
            let at = at.with_context(|| format!("{name} was not built"))?;
            Ok((built.swap_remove(at), *tests))
        })
        .collect()
}

/// The tests that fail with this image, of the first program of which any do.
fn find(examiners: &[Examiner], image: &Path) -> Result<Option<String>> {
    for (program, tests) in examiners {
        let printed = image.with_extension("printed");
        let mut command = program.command();
        command
            .args(*tests)
            .envs([("MIRROR_EMULATOR", "g474")])
            .env("MIRROR_IMAGE", image)
            .stdout(fs::File::create(&printed)?)
            .stderr(Stdio::null());
        let begun = Instant::now();
        let mut running = command.spawn()?;
        let status = loop {
            if let Some(status) = running.try_wait()? {
                break Some(status);
            }
            if begun.elapsed() > LONGEST {
                running.kill()?;
                running.wait()?;
                break None;
            }
            thread::sleep(Duration::from_millis(100));
        };
        let printed = String::from_utf8_lossy(&fs::read(&printed)?).into_owned();
        match status {
            Some(status) if status.success() => {}
            Some(_) => return Ok(Some(format!("{}: {}", program.name, failed(&printed)))),
            None => return Ok(Some(format!("{}: it does not end", program.name))),
        }
    }
    Ok(None)
}

/// Names of the tests that a test program says have failed.
fn failed(printed: &str) -> String {
    let failed = printed.lines().filter_map(|line| {
        let test = line.strip_prefix("test ")?.strip_suffix(" ... FAILED")?;
        Some(test.to_owned())
    });
    failed.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_that_fail_are_named() {
        let printed = "test one ... ok\ntest two ... FAILED\ntest a::b ... FAILED\n";
        assert_eq!(failed(printed), "two, a::b");
    }

    #[test]
    fn every_mistake_says_what_it_is() {
        for patch in patches().expect("a folder") {
            let (what, _) = head(&fs::read_to_string(&patch).expect("text"));
            assert!(!what.is_empty() && !what.starts_with("diff"), "{patch:?}");
        }
        let (what, why) = head("It is wrong\nNot caught: nobody looks\n\ndiff --git\n");
        assert_eq!(
            (what.as_str(), why.as_deref()),
            ("It is wrong", Some("nobody looks"))
        );
    }
}
