//! The public benchmark: the same sessions for our diagnosis and for other people's methods, scored by one script.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::{Parser, ValueEnum};

use xtask::cargo::{program, run, target_directory, workspace};
use xtask::{python, tool};

/// Each a script of its name in `benches/missing-physics/methods`. The fits of `BicLmfit` are what those below it start from.
#[derive(Clone, Copy, ValueEnum)]
#[value(rename_all = "snake_case")]
enum Method {
    /// `host-tool diagnose`.
    HostTool,
    /// Candidates fitted by lmfit, ranked by BIC.
    BicLmfit,
    /// Sparse regression of the residuals.
    PysindyResidual,
    /// A formula for the residuals, by pyoperon.
    Symbolic,
    /// The candidates compared by emdcmp.
    EmdCompare,
}

/// Compares methods on a data set of hidden effects.
#[derive(Parser)]
#[command(bin_name = "cargo xtask bench missing-physics --")]
struct MethodArguments {
    /// Only these methods.
    #[arg(long, value_enum, value_delimiter = ',')]
    methods: Vec<Method>,
    /// The first seed of the mirrors tested on: figures to be believed come from one that nobody developed on.
    #[arg(long, default_value_t = 8800)]
    first_seed: u64,
    /// So many sets of them: 42 sessions each.
    #[arg(long, default_value_t = 1)]
    seeds: u64,
    /// Seconds that a method may take for a session on average; what it has not answered by then stays open.
    #[arg(long, default_value_t = 60.0)]
    budget_s: f64,
}

/// Exports the sessions, makes the environment, runs the methods and prints their figures. All is written below `target`.
pub(crate) fn compare(words: &[String]) -> Result<()> {
    let name = "cargo xtask bench missing-physics --".to_owned();
    let mut arguments = MethodArguments::parse_from(std::iter::once(&name).chain(words));
    if arguments.methods.is_empty() {
        arguments.methods = Method::value_variants().to_vec();
    }
    let scripts = workspace().join("benches/missing-physics");
    let folder = target_directory().join("missing-physics");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    let [data, predictions] = ["data", "predictions"].map(|name| folder.join(name));
    fs::create_dir_all(&predictions)?;
    run(tool::missing_physics()
        .arg("--export")
        .arg(&data)
        .args(["--first-seed", &arguments.first_seed.to_string()])
        .args(["--seeds", &arguments.seeds.to_string()]))?;
    let python = environment(&scripts)?;
    let mut files = Vec::new();
    for method in &arguments.methods {
        let value = method.to_possible_value().expect("no method is hidden");
        let file = predictions.join(value.get_name()).with_extension("csv");
        let mut command = program(&python);
        command
            .arg(
                scripts
                    .join("methods")
                    .join(value.get_name())
                    .with_extension("py"),
            )
            .args([&data, &file])
            .arg("--work")
            .arg(folder.join("work"))
            .args(["--budget", &arguments.budget_s.to_string()])
            .env("HOST_TOOL", tool::command().get_program())
            .env("NUMBA_CACHE_DIR", folder.join("numba"))
            .env("PYTHONDONTWRITEBYTECODE", "1");
        match run(&mut command) {
            Ok(()) => files.push(file),
            Err(error) => eprintln!("{error:#}; it is left out of the table"),
        }
    }
    ensure!(!files.is_empty(), "no method came to an end");
    run(program(&python)
        .arg("-B")
        .arg(scripts.join("score.py"))
        .arg(&data)
        .args(&files))
}

/// The Python of an environment with what the methods need.
fn environment(scripts: &Path) -> Result<PathBuf> {
    let environment = python::environment("missing-physics-python")?;
    let mut install = program(environment.join("bin/pip"));
    install.args(["install", "--quiet", "--requirement"]);
    run(install.arg(scripts.join("requirements.txt")))
        .context("what the methods need comes from the package index; is there a network?")?;
    Ok(environment.join("bin/python"))
}
