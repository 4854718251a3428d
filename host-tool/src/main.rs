//! The bench tool for electrothermal MEMS mirrors.

use std::process::ExitCode;

fn main() -> ExitCode {
    host_tool::main()
}
