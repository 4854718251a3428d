//! Programs for the target, run in the emulator.
//!
//! On-target tests each run by themselves in a fresh emulator, and are reported by name with their
//! log. Any other program runs once, with its instructions counted, and prints its log.

use std::fs;
use std::io::{self, Read};
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use emulated_board::{LogTable, MACHINE_ARGUMENTS, QEMU};
use object::{Object, ObjectSection, ObjectSymbol};

/// Section in which embedded-test lists its tests: a symbol each, named by a JSON object, whose
/// value begins with the address of a function.
const LIST_SECTION: &str = ".embedded_test";
/// A test without a limit of its own hangs when it takes longer.
const DEFAULT_TIMEOUT: Duration = Duration::from_secs(60);

/// Semihosting, and 64 ns for every instruction: counts of time are counts of instructions.
const COUNTING: [&str; 4] = [
    "-semihosting-config",
    "enable=on,target=native",
    "-icount",
    "shift=6",
];

/// One test in an ELF.
struct Test {
    name: String,
    address: u32,
    should_panic: bool,
    timeout: Duration,
}

/// Runs the tests of `elf` whose names contain one of `filters`, or all; or the program that it is.
pub(crate) fn run_elf(elf: &Path, filters: &[String]) -> Result<ExitCode> {
    let bytes = fs::read(elf).with_context(|| format!("reading {}", elf.display()))?;
    let table = LogTable::from_elf(&bytes)?;
    match list(&bytes)? {
        Some(tests) => run_tests(elf, tests, filters, &table),
        None => run_program(elf, &table),
    }
}

fn run_program(elf: &Path, table: &LogTable) -> Result<ExitCode> {
    let (success, log) = run(elf, &COUNTING, DEFAULT_TIMEOUT, table)?;
    log.iter().for_each(|line| println!("{line}"));
    Ok(if success == Some(true) {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

fn run_tests(
    elf: &Path,
    mut tests: Vec<Test>,
    filters: &[String],
    table: &LogTable,
) -> Result<ExitCode> {
    let named = |test: &Test| filters.iter().any(|part| test.name.contains(part.as_str()));
    tests.retain(|test| filters.is_empty() || named(test));

    println!("\nrunning {} tests on an emulated Cortex-M4F", tests.len());
    let mut failed = 0;
    for test in &tests {
        let argument = format!("enable=on,target=native,arg=run_addr,arg={}", test.address);
        let (success, log) = run(
            elf,
            &["-semihosting-config", &argument],
            test.timeout,
            table,
        )?;
        let verdict = match success {
            None => "FAILED (it hangs)",
            Some(true) if !test.should_panic => "ok",
            Some(false)
                if test.should_panic && log.iter().any(|line| line.contains("panicked")) =>
            {
                "ok"
            }
            Some(_) => "FAILED",
        };
        println!("test {} ... {verdict}", test.name);
        if verdict != "ok" {
            failed += 1;
        }
        log.iter().for_each(|line| println!("    {line}"));
    }
    let (word, passed) = (
        if failed == 0 { "ok" } else { "FAILED" },
        tests.len() - failed,
    );
    println!("\ntest result: {word}. {passed} passed; {failed} failed");
    Ok(if failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// The tests of an ELF, by name; `None` if it is another program.
fn list(elf: &[u8]) -> Result<Option<Vec<Test>>> {
    let file = object::File::parse(elf)?;
    let Some(section) = file.section_by_name(LIST_SECTION) else {
        return Ok(None);
    };
    let data = section.data()?;
    let mut tests = Vec::new();
    for symbol in file
        .symbols()
        .filter(|symbol| symbol.section_index() == Some(section.index()))
    {
        let Ok(json) = serde_json::from_str::<serde_json::Value>(symbol.name()?) else {
            continue;
        };
        let start = (symbol.address() - section.address()) as usize;
        let address = data
            .get(start..start + 4)
            .context("the list of tests is cut short")?;
        tests.push(Test {
            name: json["name"]
                .as_str()
                .context("a test without a name")?
                .to_owned(),
            address: u32::from_le_bytes(address.try_into()?),
            should_panic: json["should_panic"] == true,
            timeout: json["timeout"]
                .as_u64()
                .map_or(DEFAULT_TIMEOUT, Duration::from_secs),
        });
    }
    if tests.is_empty() {
        bail!("the ELF holds no on-target tests");
    }
    tests.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(Some(tests))
}

/// Runs a program once: whether it ended well (`None` if it had to be killed), and its log.
fn run(
    elf: &Path,
    arguments: &[&str],
    timeout: Duration,
    table: &LogTable,
) -> Result<(Option<bool>, Vec<String>)> {
    let mut qemu = Command::new(QEMU)
        .args(MACHINE_ARGUMENTS)
        .args(["-serial", "none"])
        .args(arguments)
        .arg("-kernel")
        .arg(elf)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .context("the emulator does not start")?;
    let frames = read_to_end(&mut qemu);
    let success = wait(&mut qemu, timeout)?;
    let mut log = Vec::new();
    let bytes = frames.join().unwrap_or_else(|_| Ok(Vec::new()))?;
    table.decode(&bytes[..], |line| log.push(line))?;
    Ok((success, log))
}

fn read_to_end(qemu: &mut Child) -> thread::JoinHandle<io::Result<Vec<u8>>> {
    let mut stdout = qemu.stdout.take();
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(stdout) = &mut stdout {
            stdout.read_to_end(&mut bytes)?;
        }
        Ok(bytes)
    })
}

/// Whether the emulator ended well; `None` if it had to be killed.
fn wait(qemu: &mut Child, timeout: Duration) -> Result<Option<bool>> {
    let start = Instant::now();
    while start.elapsed() < timeout {
        if let Some(status) = qemu.try_wait()? {
            return Ok(Some(status.success()));
        }
        thread::sleep(Duration::from_millis(5));
    }
    qemu.kill()?;
    qemu.wait()?;
    Ok(None)
}
