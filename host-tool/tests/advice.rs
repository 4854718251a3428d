//! Every command that a diagnosis advises can be typed as it stands.

use clap::Parser;
use host_tool::cli::Arguments;

#[test]
fn advised_measurements_are_commands_of_this_tool() {
    let source = include_str!("../../crates/diagnosis/src/next.rs");
    let advised: Vec<&str> = source
        .split('"')
        .filter(|text| text.starts_with("host-tool measure "))
        .collect();
    assert!(advised.len() > 3, "{advised:?}");
    for command in advised {
        let read = Arguments::try_parse_from(command.split_whitespace());
        assert!(read.is_ok(), "{command}: {}", read.unwrap_err());
    }
}
