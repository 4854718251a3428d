//! Null ensembles on disk: one file an ensemble, which says what it is of and carries a checksum.
//!
//! A file is `MAGIC`, `FORMAT`, the key, the numbers of rows and members, the values as little-endian `f32`, and the
//! SHA-256 of all that. What is not exactly that is replaced. A file that cannot be written is done without: the ensemble
//! is computed again the next time.

use sha2::{Digest, Sha256};
use std::io::{self, Write};
use std::path::Path;

/// What an ensemble depends on: a SHA-256 (FIPS 180-4).
pub(super) type Key = [u8; 32];

const MAGIC: &[u8; 8] = b"nullens\n";
/// Of the file. What is in it is told by the key.
const FORMAT: u32 = 1;
const CHECKSUM: usize = 32;

/// Rows and members.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub(super) rows: usize,
    pub(super) members: usize,
}

/// The values from the folder's file for this key, or else made, and kept there.
pub(super) fn cached<E>(
    folder: Option<&Path>,
    key: &Key,
    shape: Shape,
    make: impl FnOnce() -> Result<Vec<f32>, E>,
) -> Result<Vec<f32>, E> {
    let Some(folder) = folder else {
        return make();
    };
    let file = folder.join(name(key));
    if let Some(values) = load(&file, key, shape) {
        return Ok(values);
    }
    let values = make()?;
    // Where nothing can be written the user has the answer all the same, only later.
    let _ = store(&file, key, shape, &values);
    Ok(values)
}

fn name(key: &Key) -> String {
    let start = u64::from_be_bytes(std::array::from_fn(|index| key[index]));
    format!("null-ensemble-{start:016x}.bin")
}

fn load(file: &Path, key: &Key, shape: Shape) -> Option<Vec<f32>> {
    let bytes = std::fs::read(file).ok()?;
    let (content, checksum) = bytes.split_at_checked(bytes.len().checked_sub(CHECKSUM)?)?;
    let values = content.strip_prefix(header(key, shape).as_slice())?;
    let is_whole = values.len() == 4 * shape.rows * shape.members
        && Sha256::digest(content).as_slice() == checksum;
    is_whole.then(|| {
        let values = values.chunks_exact(4);
        values
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect()
    })
}

/// The whole file at once: whoever reads it meanwhile reads the one before.
fn store(file: &Path, key: &Key, shape: Shape, values: &[f32]) -> io::Result<()> {
    let folder = file.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)?;
    let mut content = header(key, shape);
    content.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    let checksum = Sha256::digest(&content);
    let mut part = tempfile::NamedTempFile::new_in(folder)?;
    part.write_all(&content)?;
    part.write_all(&checksum)?;
    part.persist(file)?;
    Ok(())
}

fn header(key: &Key, shape: Shape) -> Vec<u8> {
    let Shape { rows, members } = shape;
    let mut header = MAGIC.to_vec();
    header.extend(FORMAT.to_le_bytes());
    header.extend(key);
    header.extend((rows as u64).to_le_bytes());
    header.extend((members as u64).to_le_bytes());
    header
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::convert::Infallible;
    use std::fs;
    use std::path::PathBuf;

    const KEY: Key = [7; 32];
    const SHAPE: Shape = Shape {
        rows: 3,
        members: 2,
    };
    const VALUES: [f32; 6] = [1.0, -2.5, 1e-9, 4.0, 5.0, 6.0];

    /// A folder with a kept ensemble, and how often it was made.
    struct Kept {
        folder: tempfile::TempDir,
        made: Cell<usize>,
    }

    impl Kept {
        fn new() -> Self {
            let kept = Self {
                folder: tempfile::tempdir().unwrap(),
                made: Cell::new(0),
            };
            kept.asked_for(&KEY, SHAPE);
            assert_eq!(kept.made.get(), 1);
            kept
        }

        fn file(&self) -> PathBuf {
            self.folder.path().join(name(&KEY))
        }

        fn asked_for(&self, key: &Key, shape: Shape) -> Vec<f32> {
            let make = || {
                self.made.set(self.made.get() + 1);
                Ok::<_, Infallible>(VALUES[..shape.rows * shape.members].to_vec())
            };
            cached(Some(self.folder.path()), key, shape, make).unwrap()
        }

        /// Asked twice after the file was spoiled it is made once, and the file is as it was.
        fn is_mended(&self, spoiled: &[u8]) {
            let whole = fs::read(self.file()).unwrap();
            assert_ne!(spoiled, whole);
            fs::write(self.file(), spoiled).unwrap();
            let before = self.made.get();
            for _ in 0..2 {
                assert_eq!(self.asked_for(&KEY, SHAPE), VALUES);
            }
            assert_eq!(self.made.get(), before + 1);
            assert_eq!(fs::read(self.file()).unwrap(), whole);
        }
    }

    #[test]
    fn what_is_kept_is_not_made_again() {
        let kept = Kept::new();
        assert_eq!(kept.asked_for(&KEY, SHAPE), VALUES);
        assert_eq!(kept.made.get(), 1);
    }

    #[test]
    fn a_truncated_file_is_replaced() {
        let kept = Kept::new();
        let whole = fs::read(kept.file()).unwrap();
        for length in [0, 5, whole.len() - CHECKSUM, whole.len() - 1] {
            kept.is_mended(&whole[..length]);
        }
    }

    #[test]
    fn a_corrupted_file_is_replaced() {
        let kept = Kept::new();
        let whole = fs::read(kept.file()).unwrap();
        for index in 0..whole.len() {
            let mut corrupted = whole.clone();
            corrupted[index] ^= 0x10;
            kept.is_mended(&corrupted);
        }
    }

    #[test]
    fn a_foreign_file_is_replaced() {
        let kept = Kept::new();
        kept.is_mended(b"t_s,V_V\n0,1\n");
        let elsewhere = Kept::new();
        // A whole file, of another session whose name begins the same.
        let mut other = KEY;
        other[31] = 0;
        elsewhere.asked_for(&other, SHAPE);
        kept.is_mended(&fs::read(elsewhere.file()).unwrap());
        // The values as they stand, without a word of what they are.
        let bare: Vec<u8> = VALUES
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        kept.is_mended(&bare);
    }

    #[test]
    fn what_cannot_be_written_is_made_each_time() {
        let kept = Kept::new();
        // A folder in the file's place, with something in it, is neither read nor replaced.
        fs::remove_file(kept.file()).unwrap();
        fs::create_dir_all(kept.file().join("occupied")).unwrap();
        for made in [2, 3] {
            assert_eq!(kept.asked_for(&KEY, SHAPE), VALUES);
            assert_eq!(kept.made.get(), made);
        }
        let left: Vec<_> = fs::read_dir(kept.folder.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "no part is left behind: {left:?}");
        // A file in the folder's place.
        let file = kept.folder.path().join("file");
        fs::write(&file, "").unwrap();
        let made = cached(Some(&file), &KEY, SHAPE, || {
            Ok::<_, Infallible>(VALUES.to_vec())
        });
        assert_eq!(made.unwrap(), VALUES);
    }
}
