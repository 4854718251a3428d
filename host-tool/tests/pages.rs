//! The page of all options is made from the tool.

use std::fs;
use std::path::{Path, PathBuf};

use clap::CommandFactory;
use clap_markdown::MarkdownOptions;
use host_tool::cli::Arguments;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn the_page_of_commands_has_each() {
    let page = project().join("docs/reference/commands.md");
    let text = fs::read_to_string(page).expect("the page of commands");
    let arguments = Arguments::command();
    let commands = arguments
        .get_subcommands()
        .map(|command| command.get_name());
    let lost: Vec<&str> = commands
        .filter(|name| !text.contains(&format!("`{name}`")))
        .collect();
    assert!(
        lost.is_empty(),
        "not in docs/reference/commands.md: {lost:?}"
    );
}

/// Stands above what the tool says of its own options.
const ABOVE_OPTIONS: &str = "\
# All options

What `host-tool COMMAND --help` says, of all commands. [Commands](commands.md) has them by what they are for. It is made from the tool
by `MIRROR_WRITE_PAGES=1 cargo test -p host-tool --test pages`.

";

#[test]
fn the_page_of_options_is_what_the_tool_says_of_them() {
    let plain = MarkdownOptions::new()
        .title("host-tool".to_owned())
        .show_footer(false);
    let told = clap_markdown::help_markdown_custom::<Arguments>(&plain);
    let start = told
        .find("**Command Overview:**")
        .expect("a list of commands");
    let told = &told[start..];
    let lines = told.lines().map(|line| format!("{}\n", line.trim_end()));
    let expected = format!("{ABOVE_OPTIONS}{}\n", lines.collect::<String>().trim());
    let page = project().join("docs/reference/options.md");
    if std::env::var_os("MIRROR_WRITE_PAGES").is_some() {
        fs::write(&page, &expected).expect("written");
    }
    let is_the_same = fs::read_to_string(page).is_ok_and(|page| page == expected);
    assert!(
        is_the_same,
        "write it anew: MIRROR_WRITE_PAGES=1 cargo test -p host-tool --test pages"
    );
}
