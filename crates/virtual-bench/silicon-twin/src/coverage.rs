//! Which of the image's instructions were executed, by function.

use std::fs;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::{Image, Twin};

/// The environment's word for the folder that served twins leave their coverage in, a file each.
pub const FOLDER: &str = "MIRROR_COVERAGE";

/// The bytes of the flash that were executed, as instructions, by any of the runs that were added.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    executed: Vec<bool>,
}

/// A function, and how much of it was executed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Covered {
    /// Its name.
    pub name: String,
    /// Its bytes, with the constants that lie behind its code.
    pub bytes: usize,
    /// Those of the instructions that were executed.
    pub executed: usize,
}

impl Coverage {
    /// Adds what `twin` has executed since power came first.
    pub fn add(&mut self, twin: &Twin) {
        self.merge(&Self {
            executed: twin.chip.memory.executed(),
        });
    }

    /// Adds what is in the other one.
    pub fn merge(&mut self, other: &Self) {
        if self.executed.len() < other.executed.len() {
            self.executed.resize(other.executed.len(), false);
        }
        let both = self.executed.iter_mut().zip(&other.executed);
        both.for_each(|(here, there)| *here |= there);
    }

    /// The functions of `image`, the largest first.
    pub fn by_function(&self, image: &Image) -> Vec<Covered> {
        let functions = image.functions();
        let mut covered: Vec<Covered> = functions
            .map(|(offset, bytes, name)| {
                let range = self.executed.get(offset..offset + bytes);
                Covered {
                    name: name.to_owned(),
                    bytes,
                    executed: range.map_or(0, |range| range.iter().filter(|is| **is).count()),
                }
            })
            .collect();
        covered.sort_by(|a, b| b.bytes.cmp(&a.bytes).then_with(|| a.name.cmp(&b.name)));
        covered
    }

    /// Writes it to a new file in a folder.
    ///
    /// # Errors
    /// As the system says.
    pub fn save_in(&self, folder: &Path) -> io::Result<()> {
        static FILES: AtomicUsize = AtomicUsize::new(0);
        let number = FILES.fetch_add(1, Ordering::Relaxed);
        let name = format!("{}-{number}", std::process::id());
        let bytes: Vec<u8> = self.executed.iter().map(|is| u8::from(*is)).collect();
        fs::write(folder.join(name), bytes)
    }

    /// All that was saved in a folder.
    ///
    /// # Errors
    /// As the system says.
    pub fn load_all(folder: &Path) -> io::Result<Self> {
        let mut coverage = Self::default();
        for entry in fs::read_dir(folder)? {
            let bytes = fs::read(entry?.path())?;
            coverage.merge(&Self {
                executed: bytes.into_iter().map(|byte| byte != 0).collect(),
            });
        }
        Ok(coverage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_add_up_and_are_read_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let of = |executed: &[bool]| Coverage {
            executed: executed.to_vec(),
        };
        for run in [of(&[true, false]), of(&[false, false, true])] {
            run.save_in(folder.path()).expect("a file");
        }
        let all = Coverage::load_all(folder.path()).expect("files");
        assert_eq!(all, of(&[true, false, true]));
    }
}
