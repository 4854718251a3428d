//! Tables in files of other programs: text, spreadsheets and NumPy's arrays.

mod numpy;
mod spreadsheet;

use std::path::Path;

use measurement::import::{ImportError, Table};

/// The first bytes of a file that is a ZIP archive (APPNOTE.TXT, 4.3.7): a spreadsheet, or NumPy's.
const ZIP: &[u8] = b"PK\x03\x04";
/// Of a compound file, as which older spreadsheets are stored (MS-CFB, 2.2).
const COMPOUND: &[u8] = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1";

/// Formats that are not read: what they begin with, what they are called, and how Python writes such a file as text.
const OTHERS: [(&[u8], &str, &str); 4] = [
    (
        b"PAR1",
        "Parquet",
        "import pandas; pandas.read_parquet('FILE').to_csv('table.csv', index=False)",
    ),
    (
        b"\x89HDF\r\n\x1a\n",
        "HDF5",
        "import h5py, pandas; f = h5py.File('FILE'); pandas.DataFrame({k: f[k][:] for k in f}).to_csv('table.csv', index=False)",
    ),
    (
        b"MATLAB 5.0",
        "MATLAB",
        "import scipy.io, pandas; m = scipy.io.loadmat('FILE', squeeze_me=True); pandas.DataFrame({k: m[k] for k in m if k[0] != '_'}).to_csv('table.csv', index=False)",
    ),
    (
        b"ARROW1",
        "Feather",
        "import pandas; pandas.read_feather('FILE').to_csv('table.csv', index=False)",
    ),
];

/// The table in the bytes of a file.
///
/// # Errors
/// Where there is no table of numbers in it, or it has a format that is not read: then the line of Python that converts it.
pub(crate) fn table(path: &Path, bytes: &[u8]) -> Result<Table, ImportError> {
    if bytes.starts_with(numpy::MAGIC) {
        return numpy::array(bytes);
    }
    if bytes.starts_with(ZIP) && numpy::is_archive(bytes) {
        return numpy::archive(bytes);
    }
    if bytes.starts_with(ZIP) || bytes.starts_with(COMPOUND) {
        return spreadsheet::table(bytes);
    }
    let other = OTHERS.iter().find(|(first, ..)| bytes.starts_with(first));
    let Some((_, format, python)) = other else {
        return Table::read(bytes);
    };
    let python = python.replace("FILE", &path.display().to_string());
    Err(ImportError::new(
        format!("this is a file in the format of {format}, which is not read"),
        format!("Python writes it as text: python3 -c \"{python}\""),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_that_is_not_read_is_told_with_the_line_that_converts_it() {
        for (first, format, _) in OTHERS {
            let bytes = [first, b"rest"].concat();
            let error = table(Path::new("scope.bin"), &bytes).expect_err("not read");
            let help = miette::Diagnostic::help(&error)
                .expect("what to do")
                .to_string();
            assert!(error.to_string().contains(format), "{error}");
            assert!(
                help.contains("python3 -c") && help.contains("'scope.bin'"),
                "{help}"
            );
        }
    }
}
