use clap::CommandFactory;

use super::*;

/// Every command that has none below it, by its words.
fn leaves(command: &clap::Command) -> Vec<&clap::Command> {
    if command.get_subcommands().next().is_none() {
        return vec![command];
    }
    command.get_subcommands().flat_map(leaves).collect()
}

#[test]
fn every_command_s_long_help_has_an_example_that_is_one_of_it() {
    let all = Arguments::command();
    let leaves = leaves(&all);
    assert!(leaves.len() > 30, "{} commands", leaves.len());
    for command in leaves {
        let name = command.get_name();
        let help = command
            .get_after_long_help()
            .unwrap_or_default()
            .to_string();
        let example = help
            .lines()
            .find_map(|line| line.strip_prefix("  host-tool "));
        let example = example.unwrap_or_else(|| panic!("{name} has no example"));
        assert!(
            example.split(' ').any(|word| word == name),
            "{name}: {example}"
        );
        let words = std::iter::once("host-tool").chain(example.split(' '));
        let words = super::words(words.map(Into::into));
        let parsed = Arguments::try_parse_from(words);
        assert!(parsed.is_ok(), "{example}: {}", parsed.unwrap_err());
    }
}

#[test]
fn every_option_stands_under_a_heading() {
    let all = Arguments::command();
    for command in leaves(&all) {
        for option in command.get_arguments().filter(|arg| !arg.is_positional()) {
            let (name, option_name) = (command.get_name(), option.get_id());
            let heading = option.get_help_heading();
            assert!(
                heading.is_some_and(
                    |heading| ["Signal", "Input", "Output", "Board"].contains(&heading)
                ),
                "{name} --{option_name} is under {heading:?}"
            );
        }
    }
}

#[test]
fn surroundings_are_degrees_that_a_mirror_may_be_in() {
    let ambient = |celsius: &str| {
        let words = ["host-tool", "measure", "sweep", "--ambient", celsius];
        let words = super::words(words.into_iter().map(Into::into));
        match Arguments::try_parse_from(words).ok()?.command {
            Command::Measure(Measure::Experiment(asked)) => asked.instruments().ambient_c,
            other => panic!("{other:?}"),
        }
    };
    for (celsius, read) in [("22.5", 22.5), ("-40", -40.0), ("85degC", 85.0)] {
        assert_eq!(ambient(celsius), Some(read));
    }
    for celsius in ["nan", "inf", "1e9", "-300", "22K", "warm", ""] {
        assert_eq!(ambient(celsius), None, "{celsius}");
    }
}
