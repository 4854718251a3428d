use super::*;
use crate::effect::size::MOST_PARTS;

const HEAD: &str = "id = \"mine\"\nstage = \"shape\"\nacts = \"displacement\"\n";
const Q: &str =
    "[[parameters]]\nsymbol = \"q\"\nunit = \"1\"\nstart = 0.1\nlow = 0.0\nhigh = 1.0\n";

fn with(formula: &str) -> Result<Formula, FormulaError> {
    Formula::parse("mine.toml", &format!("{HEAD}formula = \"{formula}\"\n{Q}"))
}

#[track_caller]
fn refuses(formula: &str, message: &str) {
    let error = with(formula).err().expect("it is refused");
    assert!(error.message.contains(message), "{}", error.message);
    assert!(error.place.len() >= formula.len());
}

#[test]
fn a_formula_is_an_effect() {
    let effect = with("x * (1 - q * dT / 100)").unwrap();
    let moment = Moment {
        temperature_rise_k: 50.0,
        ..Moment::default()
    };
    assert_eq!(effect.output(&[0.2], 10.0, &[], &moment), 9.0);
}

#[test]
fn numbers_may_have_exponents() {
    let effect = with("x * (1 + 1e1 * q)").unwrap();
    assert_eq!(effect.output(&[0.2], 10.0, &[], &Moment::default()), 30.0);
}

/// A fit counts a parameter in its start.
#[test]
fn a_parameter_that_starts_at_nothing_is_refused() {
    let text = format!(
        "{HEAD}formula = \"x * (1 + q)\"\n{}",
        Q.replace("0.1", "0.0")
    );
    let error = Formula::parse("mine.toml", &text)
        .err()
        .expect("it is refused");
    assert!(error.message.contains("starts at 0"), "{}", error.message);
}

#[test]
fn a_state_relaxes() {
    let text = format!(
        "{HEAD}formula = \"x + q * s\"\n{Q}[[states]]\nsymbol = \"s\"\nrate = \"(x - s) / 2\"\n"
    );
    let effect = Formula::parse("mine.toml", &text).unwrap();
    let mut state = [0.0];
    for _ in 0..100 {
        effect.advance(
            &[0.1],
            &mut state,
            &Step {
                from: 1.0,
                to: 1.0,
                duration_s: 0.02,
                moment: Moment::default(),
            },
        );
    }
    // To what the differences of the rates resolve.
    assert!((state[0] - (1.0 - (-1.0_f64).exp())).abs() < 1e-7);
}

#[test]
fn what_would_take_minutes_to_fit_is_refused_at_once() {
    // "x * (1 + q * (", and a sign between two terms.
    let sum = |terms: usize| format!("x * (1 + q * ({}))", vec!["dT"; terms].join(" + "));
    let terms = MOST_PARTS - 4;
    assert!(with(&sum(terms)).is_ok());
    refuses(&sum(terms + 1), "has 101 operators, functions and brackets");
    refuses(&sum(100_000), "and may have 100");
    refuses(
        &format!("x + q * {}dT{}", "sin(".repeat(50), ")".repeat(50)),
        "has 102",
    );
    refuses(
        &format!("{}x{}", "(".repeat(100_000), ")".repeat(100_000)),
        "and may have 100",
    );
    refuses(&format!("x + q * {}dT", "-".repeat(99)), "has 101");

    let state = |symbol: usize, rate: &str| {
        format!("[[states]]\nsymbol = \"s{symbol}\"\nrate = \"{rate}\"\n")
    };
    let refuses_rest = |rest: &str, message: &str| {
        let text = format!("{HEAD}formula = \"x + q\"\n{Q}{rest}");
        let error = Formula::parse("mine.toml", &text)
            .err()
            .expect("it is refused");
        assert!(error.message.contains(message), "{}", error.message);
    };
    let states = |count: usize, rate: &str| -> String {
        (0..count).map(|symbol| state(symbol, rate)).collect()
    };
    let sixteen = vec!["dT"; 17].join("+");
    refuses_rest(&states(2, &sixteen), "the rates have 32 operators");
    refuses_rest(&states(5, "0"), "has 5 states");
    let parameters: String = (0..8)
        .map(|i| Q.replace("\"q\"", &format!("\"q{i}\"")))
        .collect();
    refuses_rest(&parameters, "has 9 parameters");
}

#[test]
fn what_is_wrong_is_pointed_at() {
    refuses("x * (1 + ", "cannot be read");
    refuses("x * (1 + c * dT)", "'c' is not known");
    refuses("x / q", "at strength 0 this formula gives inf");
    refuses("2 * x", "turns 0.5 into 1");
    assert!(Formula::parse("mine.toml", "colour = 1").is_err());
    assert!(
        Formula::parse("mine.toml", &format!("{HEAD}formula = \"x\"\n{Q}{Q}")).is_err(),
        "a symbol twice"
    );
}

/// What is known of a built-in effect by its id would be taken for one of the user's own.
#[test]
fn an_id_is_a_word_of_its_own() {
    let said = |id: &str| {
        let head = HEAD.replace("mine", id);
        let read = Formula::parse("mine.toml", &format!("{head}formula = \"x + q * dT\"\n{Q}"));
        read.err().map(|error| error.message)
    };
    assert_eq!(said("My_own-2"), None);
    assert!(said("creep").is_some_and(|it| it.contains("there is a built-in effect `creep`")));
    for id in [
        "",
        "../../evil",
        "two words",
        "two\\nlines",
        &"l".repeat(41),
    ] {
        assert!(
            said(id).is_some_and(|it| it.contains("a word of letters")),
            "{id}"
        );
    }
}

#[test]
fn functions_that_are_told_are_known_also_within_others() {
    let one = "abs signum sqrt cbrt exp ln log2 log10 sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh floor ceil round trunc fract";
    // Of values that each of them takes.
    let one = one.split(' ').map(|name| match name {
        "acosh" => (name, "acosh(2 + x)".to_owned()),
        _ => (name, format!("{name}(x / 100)")),
    });
    let two = "min max atan2"
        .split(' ')
        .map(|name| (name, format!("{name}(1, min(x, PI))")));
    for (name, call) in one.chain(two) {
        assert!(with(&format!("x + q * {call}")).is_ok(), "{call}");
        assert!(super::read::FUNCTIONS.contains(name), "{name}");
    }
    let limited = with("x + q * max(0, min(1, x))").expect("it is read");
    let moment = Moment::default();
    for (x, limited_x) in [(-2.0, 0.0), (0.25, 0.25), (3.0, 1.0)] {
        assert_eq!(limited.output(&[2.0], x, &[], &moment), x + 2.0 * limited_x);
    }
    refuses("x + q * max(0, x, 2)", "max is given 3 values");
}
