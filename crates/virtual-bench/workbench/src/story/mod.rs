//! The whole story in one sitting: a mirror with something hidden in it is measured, compared with the model, diagnosed, the
//! model mended, the board calibrated and the mirror moved, all by the tool's own commands, on a board without an emulator.
//!
//! The mirror is moved to the same positions after each step that changes what the board knows. What was hidden is told at
//! the end.

mod mirror;
mod person;
mod table;
#[cfg(test)]
mod tests;
mod told;

use std::fs;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use mirror_model::Model;
use serde_json::Value;
use xtask::cargo::target_directory;

use self::mirror::HiddenIn;
pub(crate) use self::person::Person;
use self::person::{Move, There, number, texts};
use self::told::{Chapter, Story};

/// The model that the story begins with, and the one that the factory's calibration was made from.
const START: &str = "paper";
const FACTORY: &str = "reconciled";
/// Measurements that are made because a diagnosis asks for them, one after the other.
const MORE: usize = 2;
/// The mirrors of the table in the docs: as many as there are effects, each with another one. Nothing was developed on them.
const FIRST_OF_ALL: u64 = 9331;

/// Which story, and where it goes.
#[derive(clap::Args)]
pub(crate) struct StoryArguments {
    /// Which mirror, and what is hidden in it: any number.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Tell the stories of every effect, on mirrors that nothing was developed on, and write docs/figures/story.md anew: an hour.
    #[arg(long, conflicts_with = "seed")]
    full: bool,
}

/// Tells a story, or all of them.
pub(crate) fn run(arguments: &StoryArguments) -> Result<()> {
    let root = target_directory().join("story");
    if !arguments.full {
        let story = tell(arguments.seed, &root)?;
        println!("{}\n{}", table::HEADING, table::row(&story));
        return Ok(());
    }
    let mut rows = Vec::new();
    for seed in FIRST_OF_ALL..FIRST_OF_ALL + mirror::listed().len() as u64 {
        // One that cannot be told to its end leaves the others.
        let row = tell(seed, &root).map_or_else(
            |error| format!("| {seed} | {} | {error:#} |", mirror::effect(seed)),
            |story| table::row(&story),
        );
        println!("{row}");
        rows.push(row);
    }
    println!("written to {}", table::write(&rows)?.display());
    Ok(())
}

/// Tells the story of one mirror, in a folder of its own under `root`.
fn tell(seed: u64, root: &Path) -> Result<Story> {
    let begun = Instant::now();
    let folder = root.join(seed.to_string());
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let hidden = HiddenIn::draw(seed)?;
    let person = Person::sit_down(&hidden.config, &folder)?;
    let rest = person.rests()?;
    let mut plot = Plot {
        person,
        first_rest: rest,
        rest,
        chapters: Vec::new(),
    };
    let as_it_came = plot.person.moves_it(rest)?;
    let rest = plot.measure()?;
    plot.chapter("The board as the factory left it", FACTORY, as_it_came)?;
    plot.rest = rest;
    plot.know_the_model()?;
    let (verdict, suspects) = plot.diagnose()?;
    plot.add(&suspects)?;
    let refusal = plot.calibrate()?;
    plot.report()?;
    let story = Story {
        seed,
        hidden,
        verdict,
        suspects,
        chapters: plot.chapters,
        refusal,
        took: begun.elapsed(),
    };
    println!(
        "Told in {:.0} s, of {:.0} s of the board's time. Hidden was: {}.\n",
        story.took.as_secs_f64(),
        plot.person.board_time_s(),
        story.hidden.effect
    );
    Ok(story)
}

/// A story as far as it has been told.
struct Plot {
    person: Person,
    /// Where the mirror rested before it was ever driven.
    first_rest: There,
    /// What the positions of the calibration in use count from.
    rest: There,
    chapters: Vec<Chapter>,
}

/// The files of a story, in its folder.
const SESSION: &str = "session";
const FITTED: &str = "fitted.toml";
const BETTER: &str = "better.toml";
const PAGE: &str = "report.html";
const TRIAL: &str = "trial.json";

impl Plot {
    /// Measures a session, and returns where the mirror rested before.
    fn measure(&self) -> Result<There> {
        let rest = self.person.rests()?;
        let room = self.person.thermometer();
        self.person.types(&format!(
            "host-tool measure session --ambient {room} -o {SESSION}"
        ))?;
        Ok(rest)
    }

    /// Tells what was tried with the calibration in use, which `model` was inverted for.
    fn chapter(&mut self, title: &str, model: &str, moves: Vec<Move>) -> Result<()> {
        let compared = self
            .person
            .types(&format!("host-tool compare {model} {SESSION}"))?;
        let chapter = Chapter {
            title: title.to_owned(),
            session_rms_um: number(&compared, "rms")?,
            rest_um: self.rest.from(self.first_rest).plate_um,
            moves,
        };
        chapter.print();
        self.chapters.push(chapter);
        Ok(())
    }

    /// The model without anything beyond it.
    fn know_the_model(&mut self) -> Result<()> {
        self.person
            .types(&format!("host-tool fit {START} {SESSION} -o {FITTED}"))?;
        self.go_by("The fitted model", FITTED)
    }

    /// Has the board go by a model's inverse as it is, and moves the mirror.
    fn go_by(&mut self, title: &str, model: &str) -> Result<()> {
        let inverse = "inverse.toml";
        let path = self.person.path(model);
        let loaded = Model::load(&path.to_string_lossy())?;
        let calibration = calibration::tabulate(&loaded)?.calibration;
        fs::write(
            self.person.path(inverse),
            calibration::to_toml(&calibration),
        )?;
        self.person
            .types(&format!("host-tool load-calibration {inverse}"))?;
        let moves = self.person.moves_it(self.rest)?;
        self.chapter(title, model, moves)
    }

    /// Which physics is missing: the verdict, and what it names. Where several suspects are left, what tells them apart is
    /// measured, as far as this bench can.
    fn diagnose(&self) -> Result<(String, Vec<String>)> {
        let mut measured = SESSION.to_owned();
        for more in 0.. {
            let found = self
                .person
                .types(&format!("host-tool diagnose {START} {measured}"))?;
            let verdict = found["verdict"].as_str().context("no verdict")?.to_owned();
            let suspects = texts(&found["effects"]);
            println!("\nVerdict: {verdict} {}\n", suspects.join(", "));
            let Some(line) = next_line(&found).filter(|_| more < MORE) else {
                return Ok((verdict, suspects));
            };
            println!("To tell them apart: {}", found["next_measurement"]["why"]);
            let file = format!("next-{more}.csv");
            self.person.types(&into_file(&line, &file))?;
            measured = format!("{measured} {file}");
        }
        unreachable!("it returns before it has measured so often")
    }

    /// Adds the first suspect to the model, if there is one.
    fn add(&mut self, suspects: &[String]) -> Result<()> {
        let Some(effect) = suspects.first() else {
            fs::copy(self.person.path(FITTED), self.person.path(BETTER))?;
            return Ok(());
        };
        self.person.types(&format!(
            "host-tool effect add {effect} {START} {SESSION} -o {BETTER}"
        ))?;
        self.go_by(&format!("With {effect} in the model"), BETTER)
    }

    /// Calibrates the board; returns why it was left as it was, where the new calibration's trial was worse.
    fn calibrate(&mut self) -> Result<Option<String>> {
        let identified = "identified.toml";
        let rest = self.person.rests()?;
        let calibrated = self.person.types(&format!(
            "host-tool calibrate {BETTER} --from {SESSION} --quick --trial {TRIAL} --model-output {identified}"
        ));
        let refusal = calibrated.err().map(|error| error.root_cause().to_string());
        let (title, model) = match &refusal {
            None => {
                self.rest = rest;
                ("Calibrated", identified)
            }
            Some(why) => {
                println!("{why}");
                ("As before: calibrate kept no worse calibration", BETTER)
            }
        };
        let moves = self.person.moves_it(self.rest)?;
        self.chapter(title, model, moves)?;
        Ok(refusal)
    }

    fn report(&self) -> Result<()> {
        // A calibration that was not kept was not tried to its end.
        let trial = match self.person.path(TRIAL).exists() {
            true => format!(" --trial {TRIAL}"),
            false => String::new(),
        };
        self.person.types(&format!(
            "host-tool report {SESSION} --model {START}{trial} -o {PAGE}"
        ))?;
        println!("\nThe page: {}", self.person.path(PAGE).display());
        Ok(())
    }
}

/// How to measure what a diagnosis asks for, where a board and its bench can.
fn next_line(found: &Value) -> Option<String> {
    let line = found["next_command"].as_str()?;
    let can = line.starts_with("host-tool measure ");
    can.then(|| line.to_owned())
}

/// A command line that writes into `file`, wherever it would have written.
fn into_file(line: &str, file: &str) -> String {
    let at = line.find(" -o ").unwrap_or(line.len());
    format!("{} -o {file}", &line[..at])
}
