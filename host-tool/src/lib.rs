//! The bench tool for electrothermal MEMS mirrors: what `host-tool` does, as a library.
//!
//! A command is read in [`cli`], carried out by one file of `commands`, and printed by its own report
//! type, for people or as JSON. The commands on a mirror talk to a [`board`]; those on models and
//! measurements (`commands/lab`) to the model lab, the crate `diagnosis`.

pub mod board;
pub mod cli;
pub mod command_line;
mod commands;
mod completion;
pub mod doctor;
pub mod error;
mod failure;
mod names;
mod new_file;
mod option_bytes;
mod page;
mod picture;
mod recording;
mod report;
mod rounding;
mod scpi;
mod serve;
mod system;
mod tables;
mod terms;
pub mod tilted_pose;
mod tried;
pub mod update;
mod verbosity;
mod working;

use std::process::ExitCode;

use clap::Parser;
use miette::MietteHandlerOpts;
use textwrap::{WordSeparator, WordSplitter};

/// Runs the tool with the arguments of this process; every failure is told in words and ends in a
/// code other than 0.
pub fn main() -> ExitCode {
    completion::answer();
    tell_failures();
    let words = cli::words(std::env::args_os());
    let arguments = match cli::Arguments::try_parse_from(&words) {
        Ok(arguments) => arguments,
        Err(error) => return failure::of_usage(&error, words.into_iter()),
    };
    let json = arguments.json;
    arguments.verbosity().use_it();
    working::show_where_it_is();
    match commands::run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => ExitCode::from(failure::tell(error, json)),
    }
}

/// Failures are told in lines in which paths and commands stay whole, so that they can be copied. Each says its cause in its own
/// words: the list of causes that would follow says it again.
fn tell_failures() {
    let lines = MietteHandlerOpts::new()
        .without_cause_chain()
        .word_separator(WordSeparator::AsciiSpace)
        .word_splitter(WordSplitter::NoHyphenation)
        .break_words(false);
    // There is one tool in a process; a second one would set the same.
    let _ = miette::set_hook(Box::new(move |_| Box::new(lines.clone().build())));
}
