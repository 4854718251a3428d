//! Numbers in formulas as people write them.

/// The formula with numbers such as `1e-3` written out, which the expression parser does not read.
pub(super) fn without_exponents(formula: &str) -> String {
    let mut written = String::new();
    let mut rest = formula;
    while let Some(first) = rest.chars().next() {
        let word = |is_part: fn(char) -> bool| rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        let length = if first.is_ascii_digit() || first == '.' {
            number(rest)
        } else if first.is_alphabetic() || first == '_' {
            word(|c| c.is_alphanumeric() || c == '_')
        } else {
            first.len_utf8()
        };
        let (token, after) = rest.split_at(length);
        match token.parse::<f64>() {
            Ok(value) if token.contains(['e', 'E']) => written += &value.to_string(),
            _ => written += token,
        }
        rest = after;
    }
    written
}

/// How long the number is that a text begins with.
fn number(text: &str) -> usize {
    let digits = |text: &str| {
        text.find(|c: char| !c.is_ascii_digit())
            .unwrap_or(text.len())
    };
    let mut length = text
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(text.len());
    let after = &text[length..];
    if let Some(exponent) = after.strip_prefix(['e', 'E']) {
        let sign = usize::from(exponent.starts_with(['+', '-']));
        let count = digits(&exponent[sign..]);
        if count > 0 {
            length += 1 + sign + count;
        }
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_written_out_and_names_are_left_alone() {
        for (written, read) in [
            ("1e-3 * x", "0.001 * x"),
            ("2.5E+2*e3", "250*e3"),
            ("x1e3 + .5e1", "x1e3 + 5"),
            ("2 * exp(x)", "2 * exp(x)"),
            ("2e * x", "2e * x"),
        ] {
            assert_eq!(without_exponents(written), read);
        }
    }
}
