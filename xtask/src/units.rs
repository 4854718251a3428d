//! A name that ends in a unit holds that unit. What is given to a field or a variable, added to another or compared with it has no
//! other unit by its own name: `left_um: left.rms_ma` fails. What is multiplied on the way has another one rightly.

use std::fs;

use syn::visit::Visit;
use syn::{BinOp, Expr, Member, Pat};

use crate::cargo::workspace;
use crate::circles::{attributes, is_for_tests};
use crate::sources::sources;

/// What names end in, behind an underscore.
const UNITS: [&str; 24] = [
    "nm", "um", "mm", "na", "ua", "ma", "a", "mv", "v", "ohm", "mw", "w", "mk", "k", "ns", "us",
    "ms", "s", "hz", "khz", "mhz", "deg", "mrad", "rad",
];
/// Methods and functions of one value that leave its unit as it is.
const KEEPING: [&str; 16] = [
    "abs",
    "as_ref",
    "clone",
    "cloned",
    "copied",
    "decimal",
    "expect",
    "from",
    "into",
    "iter",
    "max",
    "min",
    "to_vec",
    "unwrap",
    "unwrap_or",
    "unwrap_or_default",
];
/// Methods that compare a value with another of its unit.
const COMPARING: [&str; 6] = ["clamp", "hypot", "max", "min", "partial_cmp", "total_cmp"];

/// The unit that a name ends in. A name of `per` is that of a quotient.
fn unit_of_name(name: &str) -> Option<&'static str> {
    let name = name.to_lowercase();
    let (before, last) = name.rsplit_once('_')?;
    let is_quotient = before.split('_').any(|word| word == "per");
    let unit = UNITS.into_iter().find(|unit| *unit == last);
    unit.filter(|_| !is_quotient)
}

/// The unit that a value has by the name of what it is read from.
fn unit(value: &Expr) -> Option<&'static str> {
    match value {
        Expr::Path(it) => unit_of_name(&it.path.segments.last()?.ident.to_string()),
        Expr::Field(it) => match &it.member {
            Member::Named(name) => unit_of_name(&name.to_string()),
            Member::Unnamed(_) => None,
        },
        Expr::MethodCall(it) if KEEPING.iter().any(|name| it.method == name) => unit(&it.receiver),
        Expr::MethodCall(it) => unit_of_name(&it.method.to_string()),
        Expr::Call(it) => {
            let Expr::Path(called) = &*it.func else {
                return None;
            };
            let name = &called.path.segments.last()?.ident;
            let keeps = name == "Some" || name == "Ok" || KEEPING.iter().any(|it| name == it);
            match it.args.first() {
                Some(only) if keeps && it.args.len() == 1 => unit(only),
                _ => unit_of_name(&name.to_string()),
            }
        }
        Expr::Binary(it) if matches!(it.op, BinOp::Add(_) | BinOp::Sub(_)) => {
            unit(&it.left).or_else(|| unit(&it.right))
        }
        Expr::Cast(it) => unit(&it.expr),
        Expr::Index(it) => unit(&it.expr),
        Expr::Paren(it) => unit(&it.expr),
        Expr::Reference(it) => unit(&it.expr),
        Expr::Try(it) => unit(&it.expr),
        Expr::Unary(it) => unit(&it.expr),
        _ => None,
    }
}

/// Pairs of units that meet as one.
#[derive(Default)]
struct Mixed(Vec<[&'static str; 2]>);

impl Mixed {
    fn meet(&mut self, one: Option<&'static str>, other: Option<&'static str>) {
        if let (Some(one), Some(other)) = (one, other)
            && one != other
        {
            self.0.push([one, other]);
        }
    }

    fn of(source: &str) -> Vec<[&'static str; 2]> {
        let mut mixed = Self::default();
        mixed.visit_file(&syn::parse_file(source).expect("a file that compiles can be read"));
        mixed.0
    }
}

impl<'ast> Visit<'ast> for Mixed {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        if !is_for_tests(attributes(item)) {
            syn::visit::visit_item(self, item);
        }
    }

    fn visit_field_value(&mut self, it: &'ast syn::FieldValue) {
        if let Member::Named(name) = &it.member {
            self.meet(unit_of_name(&name.to_string()), unit(&it.expr));
        }
        syn::visit::visit_field_value(self, it);
    }

    fn visit_local(&mut self, it: &'ast syn::Local) {
        let named = match &it.pat {
            Pat::Type(typed) => &typed.pat,
            other => other,
        };
        if let (Pat::Ident(name), Some(init)) = (named, &it.init) {
            self.meet(unit_of_name(&name.ident.to_string()), unit(&init.expr));
        }
        syn::visit::visit_local(self, it);
    }

    fn visit_expr_assign(&mut self, it: &'ast syn::ExprAssign) {
        self.meet(unit(&it.left), unit(&it.right));
        syn::visit::visit_expr_assign(self, it);
    }

    fn visit_expr_binary(&mut self, it: &'ast syn::ExprBinary) {
        let is_of_one_unit = matches!(
            it.op,
            BinOp::Add(_)
                | BinOp::AddAssign(_)
                | BinOp::Sub(_)
                | BinOp::SubAssign(_)
                | BinOp::Lt(_)
                | BinOp::Le(_)
                | BinOp::Gt(_)
                | BinOp::Ge(_)
                | BinOp::Eq(_)
                | BinOp::Ne(_)
        );
        if is_of_one_unit {
            self.meet(unit(&it.left), unit(&it.right));
        }
        syn::visit::visit_expr_binary(self, it);
    }

    fn visit_expr_method_call(&mut self, it: &'ast syn::ExprMethodCall) {
        if COMPARING.iter().any(|name| it.method == name) {
            for argument in &it.args {
                self.meet(unit(&it.receiver), unit(argument));
            }
        }
        syn::visit::visit_expr_method_call(self, it);
    }
}

#[test]
fn no_name_holds_another_unit_than_it_says() {
    let files = sources(workspace());
    assert!(files.len() > 500, "{} files were read", files.len());
    let mixed: Vec<String> = files
        .iter()
        .flat_map(|file| {
            let source = fs::read_to_string(file).expect("a source");
            let mixed = Mixed::of(&source).into_iter();
            mixed.map(|[one, other]| format!("{}: {one} and {other}", file.display()))
        })
        .collect();
    assert!(mixed.is_empty(), "{}", mixed.join("\n"));
}

#[test]
fn units_that_are_mixed_are_found() {
    let mixed = |body: &str| Mixed::of(&format!("fn f() {{ {body} }}"));
    let um_ma = [["um", "ma"]];
    assert_eq!(mixed("Report { rms_um: found.rms_ma }"), um_ma);
    assert_eq!(mixed("let rms_um: f64 = found.rms_ma();"), um_ma);
    assert_eq!(mixed("self.rms_um = rms_ma.abs();"), um_ma);
    assert_eq!(mixed("g(left_um - f64::from(right_ma))"), um_ma);
    assert_eq!(mixed("left_um.max(right_ma)"), um_ma);
    assert_eq!(mixed("left_um < -LIMIT_MA"), um_ma);
    assert_eq!(mixed("Report { rms_um: Some(found.rms_ma) }"), um_ma);
}

#[test]
fn one_unit_and_what_is_converted_are_none() {
    let mixed = |body: &str| Mixed::of(&format!("fn f() {{ {body} }}"));
    for body in [
        "let rms_ma = 1e3 * rms_a;",
        "let rms_um = rms(left_um, right_um);",
        "let slope_um_per_k = 2.0 * rise_k;",
        "let step_s = tick_s + rest_s;",
        "let force = stiffness_n_per_m;",
    ] {
        assert_eq!(mixed(body), [[""; 2]; 0], "{body}");
    }
}
