//! Functions of two values, as the expression parser reads them.

/// A formula with `max(a, b)` written as `((a) max (b))`: the parser finds the end of one such call only, and not of one within another.
///
/// # Errors
/// What is wrong with a call, in a sentence.
pub(super) fn between(formula: &str) -> Result<String, String> {
    let mut written = String::new();
    let mut rest = formula;
    while let Some(open) = rest.find('(') {
        let Some(length) = inside(&rest[open + 1..]) else {
            break;
        };
        let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
        let (before, name) = rest[..open].split_at(rest[..open].trim_end_matches(is_of_name).len());
        let (inner, after) = rest[open + 1..].split_at(length);
        let values = values(inner).into_iter().map(between);
        let values = values.collect::<Result<Vec<String>, String>>()?;
        written += before;
        match &values[..] {
            [value] => written += &format!("{name}({value})"),
            [a, b] => written += &format!("(({a}) {name} ({b}))"),
            more => {
                let more = more.len();
                return Err(format!(
                    "{name} is given {more} values, and no function takes more than two"
                ));
            }
        }
        rest = &after[1..];
    }
    Ok(written + rest)
}

/// How much of a text stands before the bracket that closes it; `None` where none does.
fn inside(text: &str) -> Option<usize> {
    let mut depth = depths(text).zip(text.char_indices());
    depth
        .find(|(depth, (_, c))| *depth == 0 && *c == ')')
        .map(|(_, (at, _))| at)
}

/// The values between commas.
fn values(inner: &str) -> Vec<&str> {
    let commas = depths(inner).zip(inner.char_indices());
    let commas = commas.filter(|(depth, (_, c))| *depth == 0 && *c == ',');
    let (mut values, mut from) = (Vec::new(), 0);
    for (_, (at, _)) in commas {
        values.push(&inner[from..at]);
        from = at + 1;
    }
    values.push(&inner[from..]);
    values
}

/// How many brackets are open before each character.
fn depths(text: &str) -> impl Iterator<Item = i32> {
    text.chars().scan(0, |depth, c| {
        let before = *depth;
        *depth += i32::from(c == '(') - i32::from(c == ')');
        Some(before)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_of_two_values_stands_between_them() {
        for (written, read) in [
            ("x * (1 + c)", "x * (1 + c)"),
            ("max(a, 1)", "((a) max ( 1))"),
            (
                "x + q * max(0, min(1, x))",
                "x + q * ((0) max ( ((1) min ( x))))",
            ),
            (
                "atan2(sin(x), max(y, -z)) / 2",
                "((sin(x)) atan2 ( ((y) max ( -z)))) / 2",
            ),
            ("(x", "(x"),
            ("x)", "x)"),
            ("exp()", "exp()"),
            ("sin((x))", "sin((x))"),
        ] {
            assert_eq!(between(written).as_deref(), Ok(read));
        }
        let said = between("max(0, min(1, 2, x))").expect_err("three values");
        assert!(said.contains("min is given 3 values"), "{said}");
    }
}
