//! The page `docs/reference/instrument.md`, made of the table of commands.

use std::fmt::Write;

use control_core::Limit;

use crate::scpi::Kind;
use crate::serve::commands::{CHAPTERS, ScpiCommand};
use crate::serve::states::{OPERATION, QUESTIONABLE};
use crate::serve::trace::COLUMNS;

/// The page.
pub(crate) fn page() -> String {
    let mut page = include_str!("reference.md").to_owned();
    for (chapter, commands) in CHAPTERS {
        let _ = write!(
            page,
            "\n## {chapter}\n\n| command | what it does or answers |\n|---|---|\n"
        );
        for command in *commands {
            let _ = writeln!(page, "| `{}` | {} |", typed(command), command.help);
        }
    }
    page += "\n## Registers\n\n";
    for (name, bits) in [("QUEStionable", QUESTIONABLE), ("OPERation", OPERATION)] {
        let _ = write!(
            page,
            "`STATus:{name}`:\n\n| bit | value | |\n|---|---|---|\n"
        );
        for (bit, meaning) in bits {
            let _ = writeln!(page, "| {bit} | {} | {meaning} |", 1 << bit);
        }
        page.push('\n');
    }
    page += "## Rows of a trace\n\nFour bytes each, in this order:\n\n| column | |\n|---|---|\n";
    for (name, meaning) in COLUMNS {
        let _ = writeln!(page, "| `{name}` | {meaning} |");
    }
    page += "\nThe limits, as a sum:";
    for (bit, limit) in Limit::ALL.into_iter().enumerate() {
        let _ = write!(page, " {} {},", 1 << bit, limit.name());
    }
    page.pop();
    page += ".\n\n## Errors\n\n| number | name | here |\n|---|---|---|\n";
    for kind in Kind::ALL {
        let (number, name, meaning) = kind.told();
        let _ = writeln!(page, "| {number} | {name} | {meaning} |");
    }
    page
}

fn typed(command: &ScpiCommand) -> String {
    let typed = format!("{} {}", command.header, command.takes.told());
    typed.trim_end().replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_page_is_as_the_table_has_it() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/instrument.md");
        if std::env::var_os("MIRROR_WRITE_PAGES").is_some() {
            std::fs::write(&path, page()).expect("it is written");
        }
        let written = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            written == page(),
            "write it anew: MIRROR_WRITE_PAGES=1 cargo test -p host-tool --lib reference"
        );
    }
}
