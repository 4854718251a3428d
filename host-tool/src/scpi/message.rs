//! Program messages: a line is units between semicolons, a unit a header and parameters between commas.

use super::error::{Error, Kind};

/// One command or query of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Unit {
    /// From the root, without a colon in front of it: `SOUR:POS?`, `*IDN?`.
    pub(crate) header: String,
    /// As typed, strings with their quotes.
    pub(crate) parameters: Vec<String>,
}

/// The units of a line. After one that is none nothing is read any more (IEEE 488.2, 6.1.6.1.1).
///
/// A header that does not begin with a colon goes on from where the one before it was: `SOUR:POS 1um;VOLT?` asks for
/// `SOUR:VOLT?`, whereas common commands stay where they are (SCPI-1999, 6.2.4).
pub(crate) fn units(line: &str) -> Vec<Result<Unit, Error>> {
    let mut path = String::new();
    let mut units = Vec::new();
    let pieces = match split(line, ';') {
        Ok(pieces) => pieces,
        Err(error) => return vec![Err(error)],
    };
    for piece in pieces.iter().filter(|piece| !piece.is_empty()) {
        let unit = unit(piece, &mut path);
        let is_bad = unit.is_err();
        units.push(unit);
        if is_bad {
            break;
        }
    }
    units
}

fn unit(text: &str, path: &mut String) -> Result<Unit, Error> {
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    let (typed, rest) = text.split_at(end);
    let header = match typed.strip_prefix(':') {
        Some(absolute) => absolute.to_owned(),
        None if typed.starts_with('*') => typed.to_owned(),
        None => format!("{path}{typed}"),
    };
    let is_of_header = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | ':' | '*' | '?');
    if header.is_empty() || !header.chars().all(is_of_header) {
        let said = format!("`{typed}` is no header; write for example SOUR:POS 120um");
        return Err(Error::new(Kind::Syntax, said));
    }
    if !header.starts_with('*') {
        let leaf = header.rfind(':').map_or(0, |colon| colon + 1);
        header[..leaf].clone_into(path);
    }
    let parameters = match rest.trim() {
        "" => Vec::new(),
        rest => split(rest, ',')?,
    };
    Ok(Unit { header, parameters })
}

/// The parts of `text` between separators that are not within quotes, without the blanks around them.
fn split(text: &str, separator: char) -> Result<Vec<String>, Error> {
    let (mut parts, mut quote) = (vec![String::new()], None);
    for character in text.chars() {
        match quote {
            None if character == separator => {
                parts.push(String::new());
                continue;
            }
            None if matches!(character, '"' | '\'') => quote = Some(character),
            Some(opened) if character == opened => quote = None,
            _ => {}
        }
        parts.last_mut().expect("one at least").push(character);
    }
    if let Some(quote) = quote {
        let said = format!("a text begins with {quote} and does not end");
        return Err(Error::new(Kind::Syntax, said));
    }
    Ok(parts.iter().map(|part| part.trim().to_owned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(line: &str) -> Vec<(String, Vec<String>)> {
        let units = units(line).into_iter();
        units
            .map(|unit| unit.expect("a unit"))
            .map(|unit| (unit.header, unit.parameters))
            .collect()
    }

    fn said(header: &str, parameters: &[&str]) -> (String, Vec<String>) {
        let parameters = parameters.iter().map(|text| (*text).to_owned());
        (header.to_owned(), parameters.collect())
    }

    #[test]
    fn a_header_goes_on_from_where_the_one_before_it_was() {
        assert_eq!(
            read("sour:pos 120 um; volt 1V , 2V;*OPC?;volt?; :MEAS:CURR?;TEMP?"),
            [
                said("sour:pos", &["120 um"]),
                said("sour:volt", &["1V", "2V"]),
                said("*OPC?", &[]),
                said("sour:volt?", &[]),
                said("MEAS:CURR?", &[]),
                said("MEAS:TEMP?", &[]),
            ]
        );
        assert_eq!(read(" ;; "), []);
    }

    #[test]
    fn separators_within_quotes_are_text() {
        assert_eq!(
            read("SYST:BOAR \"a;b,c\"\"d\";*CLS"),
            [said("SYST:BOAR", &["\"a;b,c\"\"d\""]), said("*CLS", &[])]
        );
        assert!(units("SYST:BOAR 'a;*CLS")[0].is_err());
    }

    #[test]
    fn nothing_is_read_after_what_is_no_unit() {
        let units = units("*CLS;\u{1}x;*RST");
        assert_eq!(units.len(), 2);
        assert!(units[0].is_ok() && units[1].is_err());
    }

    proptest! {
        #[test]
        fn any_line_is_read_and_what_is_written_is_read_back(
            line in ".{0,80}",
            words in proptest::collection::vec("[A-Z]{1,8}(:[A-Z]{1,8}){0,2}[?]?", 1..5),
            values in proptest::collection::vec("[0-9]{1,4}(um|V)", 0..4),
        ) {
            let _ = units(&line);
            let unit = |word: &String| format!(":{word} {}", values.join(","));
            let line: Vec<String> = words.iter().map(unit).collect();
            let expected: Vec<_> = words.iter().map(|word| (word.clone(), values.clone())).collect();
            prop_assert_eq!(read(&line.join(";")), expected);
        }
    }
}
