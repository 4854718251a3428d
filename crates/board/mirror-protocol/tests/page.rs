//! The lower part of `docs/reference/protocol.md` is made from this crate's sources: what can be asked, and what is in each message.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use quote::ToTokens;
use syn::{Attribute, Expr, Fields, GenericArgument, Item, Lit, Meta, PathArguments, Type};

const ENDPOINTS: &str = include_str!("../src/endpoints.rs");
/// Where messages are defined.
const SOURCES: [&str; 6] = [
    include_str!("../src/calibration.rs"),
    include_str!("../src/identity.rs"),
    include_str!("../src/messages.rs"),
    include_str!("../src/fault_log.rs"),
    include_str!("../../waveforms/src/waveform.rs"),
    include_str!("../../waveforms/src/sampling.rs"),
];
/// Where what is made begins.
const MADE: &str = "## Endpoints\n";

#[test]
fn the_page_has_every_endpoint_and_message() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../docs/reference/protocol.md");
    let page = fs::read_to_string(&path).expect("the page");
    let (told, _) = page.split_once(MADE).expect("a heading for endpoints");
    let expected = told.to_owned() + &made();
    if std::env::var_os("MIRROR_WRITE_PAGES").is_some() {
        fs::write(&path, &expected).expect("written");
    }
    let written = fs::read_to_string(&path).expect("the page");
    assert!(
        written == expected,
        "write it anew: MIRROR_WRITE_PAGES=1 cargo test -p mirror-protocol --test page"
    );
}

#[test]
fn every_link_leads_to_a_message() {
    let page = made();
    let names: Vec<String> = messages().into_keys().map(|n| n.to_lowercase()).collect();
    let links = page.split("](#").skip(1);
    for link in links.filter_map(|rest| rest.split(')').next()) {
        assert!(names.iter().any(|name| name == link), "#{link}");
    }
}

/// Endpoints, topics and messages.
fn made() -> String {
    let answers = answers();
    let [endpoints, topics] = ["list = ENDPOINTS", "list = TOPICS_OUT"].map(rows);
    let mut page = format!("{MADE}\n| endpoint | request | answer | |\n|---|---|---|---|\n");
    for Row { cells, meaning } in endpoints {
        let [_, request, answer, path] = cells.as_slice() else {
            panic!("four columns: {cells:?}")
        };
        let answer = answers.get(*answer).cloned();
        let answer = answer.unwrap_or_else(|| vec![cells[2].to_owned()]);
        let answer: Vec<String> = answer.iter().map(|name| linked(name)).collect();
        let (path, answer) = (path.trim_matches('"'), answer.join(" or "));
        let _ = writeln!(
            page,
            "| `{path}` | {} | {answer} | {meaning} |",
            linked(request)
        );
    }
    page += "\nAny answer but that to `mirror/hello` may be a [`Refusal`](#refusal) instead.\n\n";
    page += "| topic | message | |\n|---|---|---|\n";
    for Row { cells, meaning } in topics {
        let (message, path) = (linked(cells[1]), cells[2].trim_matches('"'));
        let _ = writeln!(page, "| `{path}` | {message} | {meaning} |");
    }
    page += "\n## Messages\n";
    for message in messages().into_values() {
        page += &message;
    }
    page
}

/// A line of a table in the sources.
struct Row {
    cells: Vec<&'static str>,
    /// The comment above it.
    meaning: &'static str,
}

/// The lines of the table that this stands above.
fn rows(list: &str) -> Vec<Row> {
    let (_, table) = ENDPOINTS.split_once(list).expect("a table");
    let (table, _) = table.split_once("\n}").expect("its end");
    let (mut rows, mut meaning) = (Vec::new(), "");
    for line in table.lines().map(str::trim) {
        if let Some(comment) = line.strip_prefix("// ") {
            meaning = comment;
        } else if line.contains('"') {
            let cells = line.trim_matches('|').split('|').map(str::trim).collect();
            assert!(!meaning.is_empty(), "nothing is said above {line}");
            rows.push(Row { cells, meaning });
            meaning = "";
        }
    }
    rows
}

/// What an answer's name stands for, but for refusals.
fn answers() -> BTreeMap<String, Vec<String>> {
    let aliases = items(ENDPOINTS).into_iter().filter_map(|item| {
        let Item::Type(alias) = item else { return None };
        let Type::Path(result) = *alias.ty else {
            return None;
        };
        let PathArguments::AngleBracketed(arms) = &result.path.segments.last()?.arguments else {
            return None;
        };
        let arms = arms.args.iter().filter_map(|arm| match arm {
            GenericArgument::Type(arm) => Some(typed(arm)),
            _ => None,
        });
        let arms = arms.filter(|arm| arm != "Refusal").collect();
        Some((alias.ident.to_string(), arms))
    });
    aliases.collect()
}

/// Each message by its name.
fn messages() -> BTreeMap<String, String> {
    let items = SOURCES.into_iter().flat_map(items);
    items.filter_map(message).collect()
}

fn message(item: Item) -> Option<(String, String)> {
    let (name, attributes) = match &item {
        Item::Struct(item) => (&item.ident, &item.attrs),
        Item::Enum(item) => (&item.ident, &item.attrs),
        Item::Type(item) => (&item.ident, &item.attrs),
        _ => return None,
    };
    let is_sent = |attribute: &Attribute| {
        attribute.path().is_ident("derive")
            && attribute.to_token_stream().to_string().contains("Schema")
    };
    let is_alias = matches!(item, Item::Type(_));
    if !is_alias && !attributes.iter().any(is_sent) {
        return None;
    }
    let mut text = format!("\n### {name}\n\n{}\n", said(attributes));
    match &item {
        Item::Struct(item) if matches!(item.fields, Fields::Unnamed(_)) => {
            let inner = item.fields.iter().map(|field| linked(&typed(&field.ty)));
            let _ = writeln!(text, "\n{}", inner.collect::<Vec<_>>().join(", "));
        }
        Item::Struct(item) => {
            text += "\n| field | type | |\n|---|---|---|\n";
            for field in &item.fields {
                let name = field.ident.as_ref().map(ToString::to_string)?;
                let (what, meaning) = (linked(&typed(&field.ty)), said(&field.attrs));
                let _ = writeln!(text, "| `{name}` | {what} | {meaning} |");
            }
        }
        Item::Enum(item) => {
            text += "\n| variant | with | |\n|---|---|---|\n";
            for variant in &item.variants {
                let (with, meaning) = (carried(&variant.fields), said(&variant.attrs));
                let _ = writeln!(text, "| `{}` | {with} | {meaning} |", variant.ident);
            }
        }
        Item::Type(item) => {
            let _ = writeln!(text, "\n`{}`", typed(&item.ty));
        }
        _ => {}
    }
    Some((name.to_string(), text))
}

/// What a variant has with it.
fn carried(fields: &Fields) -> String {
    let told = fields.iter().map(|field| {
        let what = linked(&typed(&field.ty));
        match &field.ident {
            Some(name) => format!("`{name}` {what}: {}", said(&field.attrs)),
            None => what,
        }
    });
    told.collect::<Vec<_>>().join(" ")
}

fn items(source: &str) -> Vec<Item> {
    syn::parse_file(source).expect("Rust").items
}

fn typed(what: &Type) -> String {
    let text = what.to_token_stream().to_string();
    text.replace(' ', "").replace(';', "; ").replace(',', ", ")
}

/// A type, with the way to what is said of it.
fn linked(name: &str) -> String {
    let inner = name.trim_start_matches('[').trim_start_matches("Option<");
    let inner = inner.split([';', ']', '>']).next().unwrap_or_default();
    let is_ours = inner.starts_with(|first: char| first.is_ascii_uppercase());
    match (name, is_ours) {
        ("()", _) => String::new(),
        (_, true) => format!("[`{name}`](#{})", inner.to_lowercase()),
        (_, false) => format!("`{name}`"),
    }
}

/// What stands above an item, as one line of a page.
fn said(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| {
        let Meta::NameValue(pair) = &attribute.meta else {
            return None;
        };
        let Expr::Lit(text) = &pair.value else {
            return None;
        };
        let Lit::Str(text) = &text.lit else {
            return None;
        };
        pair.path
            .is_ident("doc")
            .then(|| text.value().trim().to_owned())
    });
    let text = lines.collect::<Vec<_>>().join(" ");
    without_links(text.trim()).replace('|', "\\|")
}

/// Links that only rustdoc can follow are names.
fn without_links(text: &str) -> String {
    let text = text.replace("[`", "`").replace("`]", "`");
    match text.split_once("`(crate::") {
        Some((before, after)) => {
            let (_, after) = after.split_once(')').expect("a link's end");
            without_links(&format!("{before}`{after}"))
        }
        None => text,
    }
}
