//! How a text's letters are written as bytes.

/// The text of these bytes, and what it is encoded in.
pub(super) fn decoded(bytes: &[u8]) -> (String, &'static str) {
    let utf_16 = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes.chunks_exact(2).map(|b| unit([b[0], b[1]])).collect();
        (String::from_utf16_lossy(&units), "UTF-16")
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => utf_16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf_16(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => (String::from_utf8_lossy(rest).into_owned(), "UTF-8"),
        _ => match std::str::from_utf8(bytes) {
            Ok(text) => (text.to_owned(), "UTF-8"),
            // The first 256 characters of Unicode are those of Latin-1.
            Err(_) => (bytes.iter().map(|&b| char::from(b)).collect(), "Latin-1"),
        },
    }
}
