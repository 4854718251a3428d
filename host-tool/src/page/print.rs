//! How units, numbers and the tool's lines are written in print.

use charts::escaped;

/// A unit as it stands in print: `um/V^2` is µm/V², and `1/K^2` is K⁻².
pub(super) fn in_print(unit: &str) -> String {
    let spelled = escaped(unit).replace("um", "µm").replace("ohm", "Ω");
    let is_symbol = |text: &str| !text.is_empty() && text.chars().all(char::is_alphabetic);
    let inverse = spelled.strip_prefix("1/").and_then(|below| {
        let (symbol, power) = below.split_once('^').unwrap_or((below, "1"));
        is_symbol(symbol).then(|| format!("{symbol}^-{power}"))
    });
    raised(&inverse.unwrap_or(spelled))
}

/// Powers as superscripts.
fn raised(unit: &str) -> String {
    let mut is_power = false;
    let written = unit.chars().filter_map(|character| {
        is_power = character == '^' || (is_power && superscript(character).is_some());
        match character {
            '^' => None,
            _ if is_power => superscript(character),
            _ => Some(character),
        }
    });
    written.collect()
}

fn superscript(character: char) -> Option<char> {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match character {
        '-' => Some('⁻'),
        digit => DIGITS.get(digit.to_digit(10)? as usize).copied(),
    }
}

/// A number with so many digits, without an exponent where that is readable.
pub(super) fn number(value: f64, digits: usize) -> String {
    let magnitude = value.abs().log10().floor();
    if value == 0.0 {
        "0".into()
    } else if (-4.0..6.0).contains(&magnitude) {
        let decimals = (digits as f64 - 1.0 - magnitude).max(0.0) as usize;
        let text = format!("{value:.decimals$}");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    } else {
        format!("{value:.prec$e}", prec = digits - 1)
    }
}

/// A line of the tool as a sentence of the page.
pub(super) fn prose(line: &str) -> String {
    let words = line.trim().replace(" um", " µm");
    escaped(&words)
}

/// A line as a sentence, in which no number stands apart from its unit.
pub(super) fn sentence(line: &str) -> String {
    let words = prose(line);
    let mut letters = words.chars();
    let first = letters.next().map(char::to_uppercase);
    let begun: String = first.into_iter().flatten().chain(letters).collect();
    let mut told = String::new();
    for word in begun.split(' ') {
        let is_after_number = told.ends_with(|last: char| last.is_ascii_digit());
        let is_unit = matches!(word.trim_end_matches([',', ';']), "%" | "µm" | "mA");
        told += match (told.is_empty(), is_after_number && is_unit) {
            (true, _) => "",
            (false, true) => "\u{a0}",
            (false, false) => " ",
        };
        told += word;
    }
    told + "."
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_written_as_in_print() {
        for (unit, printed) in [
            ("ohm", "Ω"),
            ("um/V^2", "µm/V²"),
            ("W/K^4", "W/K⁴"),
            ("1/K", "K⁻¹"),
            ("1/K^2", "K⁻²"),
            ("1/um", "µm⁻¹"),
            ("V^-2*um", "V⁻²*µm"),
            // Of an effect of one's own.
            ("1/(V*s)", "1/(V*s)"),
            ("m^", "m"),
            ("1/", "1/"),
            ("", ""),
        ] {
            assert_eq!(in_print(unit), printed, "{unit}");
        }
    }

    #[test]
    fn numbers_have_as_many_digits_as_are_asked_for() {
        let said = [376.8612, 0.00392, 0.0, 1.0e-14, 8423.0, -0.5].map(|value| number(value, 5));
        assert_eq!(
            said,
            ["376.86", "0.00392", "0", "1.0000e-14", "8423", "-0.5"]
        );
        assert_eq!(number(0.078005, 2), "0.078");
    }

    #[test]
    fn lines_are_written_as_in_print() {
        assert_eq!(
            prose("  error 0.5 um rms & more"),
            "error 0.5 µm rms &amp; more"
        );
        assert_eq!(
            sentence("  error 0.5 um rms, then 3 %; of 4 as % and um"),
            "Error 0.5\u{a0}µm rms, then 3\u{a0}%; of 4 as % and µm."
        );
    }
}
