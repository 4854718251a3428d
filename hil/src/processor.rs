//! Processor time, which a busy machine does not lengthen as it does the wall's.

use std::fs;
use std::path::{Path, PathBuf};

/// Processor time (s) that the emulators of this process have used, and this process with their plants in it, but for its
/// first thread.
pub fn processor_s() -> f64 {
    let first = std::process::id().to_string();
    let tasks: Vec<PathBuf> = fs::read_dir("/proc/self/task")
        .expect("Linux tells")
        .filter_map(|entry| Some(entry.ok()?.path()))
        .collect();
    let plants = tasks.iter().filter(|task| !task.ends_with(&first));
    let emulators = tasks.iter().flat_map(|task| {
        let children = fs::read_to_string(task.join("children")).unwrap_or_default();
        let folder = |id| Path::new("/proc").join(id);
        children.split_whitespace().map(folder).collect::<Vec<_>>()
    });
    plants.map(|task| used_s(task)).sum::<f64>() + emulators.map(|id| used_s(&id)).sum::<f64>()
}

/// User and system time (proc(5): fields 14 and 15 of stat, in hundredths of a second).
fn used_s(of: &Path) -> f64 {
    let stat = fs::read_to_string(of.join("stat")).unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let field = |number: usize| -> f64 {
        let word = after_name.split_whitespace().nth(number - 3);
        word.and_then(|word| word.parse().ok()).unwrap_or(0.0)
    };
    (field(14) + field(15)) / 100.0
}
