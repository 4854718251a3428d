//! The sessions of `data/hidden`: virtual mirrors with something hidden, which only a file for tests
//! tells.

use std::fs;

use anyhow::Result;
use experiments::Experiment;
use virtual_mirror::{Effect, Family, MirrorConfig};
use virtual_sessions::{Instruments, measure};

use xtask::cargo::workspace;

/// Families of layouts that no threshold of the diagnosis was calibrated on.
const FAMILIES: [Family; 2] = [Family::F, Family::G];
const FIRST_SEED: u64 = 8401;
const STRENGTH: f64 = 1.0;

/// Effects that no list of the tool knows.
const UNLISTED: [Effect; 2] = [Effect::Stiction, Effect::HeaterAging];
/// Effects that came to the list after the sessions were written, which keep their numbers.
const LATER: [Effect; 2] = [Effect::ElectrostaticPull, Effect::FreeConvection];
/// Two at once.
const BOTH: [Effect; 2] = [Effect::Hysteresis, Effect::AmbientDrift];

/// Writes every session anew, and the answers.
pub(crate) fn write() -> Result<()> {
    let listed = Effect::ALL
        .iter()
        .copied()
        .filter(|effect| effect.is_listed() && !LATER.contains(effect));
    let cases: Vec<Vec<Effect>> = [vec![], vec![]]
        .into_iter()
        .chain(listed.chain(UNLISTED).map(|effect| vec![effect]))
        .chain([BOTH.to_vec()])
        .collect();
    let directory = workspace().join("data/hidden");
    let mut answers = String::from("# Only tests read this file.\n");
    for (number, hidden) in cases.iter().enumerate() {
        // Neighbours in the list are no neighbours in the numbering.
        let name = format!("{:02}", (number * 7) % cases.len() + 1);
        let seed = FIRST_SEED + number as u64;
        let mut config = MirrorConfig::draw(FAMILIES[number % FAMILIES.len()], seed);
        hidden
            .iter()
            .for_each(|effect| config.effects.set(*effect, STRENGTH));
        let session = measure(&config, &plan(), Instruments::PositionAndCurrents)?;
        fs::create_dir_all(directory.join(&name))?;
        for (file, content) in session.files {
            fs::write(directory.join(&name).join(file), content.to_string())?;
        }
        let ids: Vec<String> = hidden
            .iter()
            .map(|effect| format!("{:?}", effect.id()))
            .collect();
        answers += &format!("{name} = [{}]\n", ids.join(", "));
    }
    fs::write(directory.join("answers.toml"), answers)?;
    println!(
        "{} sessions written to {}",
        cases.len(),
        directory.display()
    );
    Ok(())
}

/// The usual session, with fewer rows.
fn plan() -> Vec<Experiment> {
    let sine = |hz| Experiment::sine(1.0, 0.5, hz, 1).after(5.0);
    vec![
        Experiment::sweep(3.5, 14, 1.0, 1),
        Experiment::step(2.0, 30.0, 5e3).after(20.0),
        sine(0.1),
        sine(1.0),
        sine(20.0),
        sine(100.0),
        Experiment::single(3.5, 5, 1.0).after(5.0),
        Experiment::sweep(3.5, 5, 1.0, 1).named("repeat").after(7.0),
    ]
}
