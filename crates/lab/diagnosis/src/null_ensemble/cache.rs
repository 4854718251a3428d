//! Null ensembles on disk: one file an ensemble, which says what it is of and carries a checksum. Those of the standard session and of
//! the sessions that ship are such files that are part of this program.
//!
//! A file is `MAGIC`, `FORMAT`, the key, the numbers of rows and members, the steps packed, and the SHA-256 of all that. Packed are
//! the differences from each step to the next as variable-length integers (postcard's), deflated: an ensemble of four thousand rows
//! takes a twentieth of its numbers' bytes. What is not exactly that is replaced. A file that cannot be written is done without: the
//! ensemble is computed again the next time.

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use sha2::{Digest, Sha256};
use std::io::{self, Read, Write};
use std::path::Path;

/// What an ensemble depends on: a SHA-256 (FIPS 180-4) each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key {
    /// Of what this program makes of virtual mirrors.
    pub(super) program: [u8; 32],
    /// Of the session's conditions.
    pub(super) conditions: [u8; 32],
}

const MAGIC: &[u8; 8] = b"nullens\n";
/// Of the file. What is in it is told by the key.
const FORMAT: u32 = 2;
const CHECKSUM: usize = 32;

/// The ensembles of the standard session, as `host-tool measure session` makes it, and of the sessions of `data/hidden`:
/// `cargo xtask tabulate-ensemble` writes them anew.
const SHIPPED: [&[u8]; 2] = [include_bytes!("standard.bin"), include_bytes!("hidden.bin")];

/// Rows and members.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub(super) rows: usize,
    pub(super) members: usize,
}

/// The steps that ship, those of the folder's file for this key, or else made, and kept there.
pub(super) fn cached<E>(
    folder: Option<&Path>,
    key: &Key,
    shape: Shape,
    make: impl FnOnce() -> Result<Vec<i32>, E>,
) -> Result<Vec<i32>, E> {
    if let Some(steps) = SHIPPED.iter().find_map(|file| parsed(file, key, shape)) {
        return Ok(steps);
    }
    let Some(folder) = folder else {
        return make();
    };
    let file = folder.join(name(key));
    if let Some(steps) = load(&file, key, shape) {
        return Ok(steps);
    }
    let steps = make()?;
    // Where nothing can be written the user has the answer all the same, only later.
    let _ = store(&file, key, shape, &steps);
    Ok(steps)
}

/// The file of another program for the same conditions is replaced.
fn name(key: &Key) -> String {
    let start = u64::from_be_bytes(std::array::from_fn(|index| key.conditions[index]));
    format!("null-ensemble-{start:016x}.bin")
}

fn load(file: &Path, key: &Key, shape: Shape) -> Option<Vec<i32>> {
    parsed(&std::fs::read(file).ok()?, key, shape)
}

fn parsed(bytes: &[u8], key: &Key, shape: Shape) -> Option<Vec<i32>> {
    let (content, checksum) = bytes.split_at_checked(bytes.len().checked_sub(CHECKSUM)?)?;
    let packed = content.strip_prefix(header(key, shape).as_slice())?;
    let is_whole = Sha256::digest(content).as_slice() == checksum;
    let steps = is_whole.then(|| unpacked(packed))??;
    (steps.len() == shape.rows * shape.members).then_some(steps)
}

/// The whole file at once: whoever reads it meanwhile reads the one before.
fn store(file: &Path, key: &Key, shape: Shape, steps: &[i32]) -> io::Result<()> {
    let folder = file.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)?;
    let mut part = tempfile::NamedTempFile::new_in(folder)?;
    part.write_all(&file_of(key, shape, steps)?)?;
    part.persist(file)?;
    Ok(())
}

/// The whole file of an ensemble.
pub(super) fn file_of(key: &Key, shape: Shape, steps: &[i32]) -> io::Result<Vec<u8>> {
    let mut content = header(key, shape);
    content.extend(packed(steps)?);
    let checksum = Sha256::digest(&content);
    content.extend(checksum);
    Ok(content)
}

fn header(key: &Key, shape: Shape) -> Vec<u8> {
    let Shape { rows, members } = shape;
    let mut header = MAGIC.to_vec();
    header.extend(FORMAT.to_le_bytes());
    header.extend(key.program);
    header.extend(key.conditions);
    header.extend((rows as u64).to_le_bytes());
    header.extend((members as u64).to_le_bytes());
    header
}

fn packed(steps: &[i32]) -> io::Result<Vec<u8>> {
    let mut before = 0;
    let differences: Vec<i32> = steps
        .iter()
        .map(|&step| step.wrapping_sub(std::mem::replace(&mut before, step)))
        .collect();
    let bytes = postcard::to_stdvec(&differences).map_err(io::Error::other)?;
    let mut deflate = DeflateEncoder::new(Vec::new(), Compression::best());
    deflate.write_all(&bytes)?;
    deflate.finish()
}

fn unpacked(packed: &[u8]) -> Option<Vec<i32>> {
    let mut bytes = Vec::new();
    DeflateDecoder::new(packed).read_to_end(&mut bytes).ok()?;
    let mut steps: Vec<i32> = postcard::from_bytes(&bytes).ok()?;
    let mut before = 0_i32;
    for step in &mut steps {
        before = before.wrapping_add(*step);
        *step = before;
    }
    Some(steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::convert::Infallible;
    use std::fs;
    use std::path::PathBuf;

    const KEY: Key = Key {
        program: [7; 32],
        conditions: [8; 32],
    };
    const SHAPE: Shape = Shape {
        rows: 3,
        members: 2,
    };
    const STEPS: [i32; 6] = [1, -2, 0, i32::MAX, i32::MIN, 6];

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

        fn asked_for(&self, key: &Key, shape: Shape) -> Vec<i32> {
            let make = || {
                self.made.set(self.made.get() + 1);
                Ok::<_, Infallible>(STEPS[..shape.rows * shape.members].to_vec())
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
                assert_eq!(self.asked_for(&KEY, SHAPE), STEPS);
            }
            assert_eq!(self.made.get(), before + 1);
            assert_eq!(fs::read(self.file()).unwrap(), whole);
        }
    }

    #[test]
    fn what_is_kept_is_not_made_again() {
        let kept = Kept::new();
        assert_eq!(kept.asked_for(&KEY, SHAPE), STEPS);
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
        // A whole file, of another session whose name begins the same, and of another program.
        for of in [
            |other: &mut Key| other.conditions[31] = 0,
            |other: &mut Key| other.program[0] = 0,
        ] {
            let mut other = KEY;
            of(&mut other);
            elsewhere.asked_for(&other, SHAPE);
            kept.is_mended(&fs::read(elsewhere.file()).unwrap());
        }
        // The values as they stand, without a word of what they are.
        kept.is_mended(&packed(&STEPS).unwrap());
    }

    #[test]
    fn what_cannot_be_written_is_made_each_time() {
        let kept = Kept::new();
        // A folder in the file's place, with something in it, is neither read nor replaced.
        fs::remove_file(kept.file()).unwrap();
        fs::create_dir_all(kept.file().join("occupied")).unwrap();
        for made in [2, 3] {
            assert_eq!(kept.asked_for(&KEY, SHAPE), STEPS);
            assert_eq!(kept.made.get(), made);
        }
        let left: Vec<_> = fs::read_dir(kept.folder.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "no part is left behind: {left:?}");
        // A file in the folder's place.
        let file = kept.folder.path().join("file");
        fs::write(&file, "").unwrap();
        let made = cached(Some(&file), &KEY, SHAPE, || {
            Ok::<_, Infallible>(STEPS.to_vec())
        });
        assert_eq!(made.unwrap(), STEPS);
    }

    #[test]
    fn those_that_ship_are_of_this_program() {
        for file in SHIPPED {
            let program = file[MAGIC.len() + 4..].first_chunk::<32>();
            assert_eq!(
                program,
                Some(&*super::super::PROGRAM),
                "what virtual mirrors, model or fit make of a session has changed: cargo xtask tabulate-ensemble"
            );
        }
    }

    proptest::proptest! {
        #[test]
        fn what_is_packed_is_unpacked(steps: Vec<i32>) {
            proptest::prop_assert_eq!(unpacked(&packed(&steps).unwrap()), Some(steps));
        }

        #[test]
        fn any_bytes_are_steps_or_none(bytes: Vec<u8>) {
            let _ = unpacked(&bytes);
        }
    }
}
