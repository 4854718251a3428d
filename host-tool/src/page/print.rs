//! How units are written in print.

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
}
