//! Stories told to their end, by the tool that is built.

use super::*;

/// Tells a story to its end: there is a page, and the error has fallen ten times, or to the limit. `cargo xtask story
/// --full` tells more, docs/figures/story.md.
fn ends_well(seed: u64) {
    let root = tempfile::tempdir().expect("a folder");
    let story = tell(seed, root.path());
    let story = story
        .unwrap_or_else(|error| panic!("{error:#}; is the tool built? `cargo build -p host-tool`"));
    let page = root.path().join(seed.to_string()).join(PAGE);
    let page = fs::read_to_string(page).expect("a page");
    // Of an ambiguous one the page has the sentence.
    let told = match story.verdict.as_str() {
        "ambiguous" => "cannot tell which",
        verdict => verdict,
    };
    assert!(page.contains(told), "{}", story.verdict);
    assert!(story.ends_well(), "{}", table::row(&story));
}

/// The film's expansion grows with its temperature.
#[test]
#[ignore = "long"]
fn seed_9320() {
    ends_well(9320);
}

/// The bench's position sensor has another gain than it says.
#[test]
#[ignore = "long"]
fn seed_9321() {
    ends_well(9321);
}

#[test]
fn a_command_line_writes_into_the_file_of_the_story() {
    for (line, into) in [
        ("host-tool measure step", "host-tool measure step -o a.csv"),
        (
            "host-tool measure sweep --max 0.4V --ambient 62 -o oven.csv",
            "host-tool measure sweep --max 0.4V --ambient 62 -o a.csv",
        ),
    ] {
        assert_eq!(into_file(line, "a.csv"), into);
    }
}

#[test]
fn what_only_a_book_tells_is_not_measured() {
    let found = serde_json::json!({ "next_command": "host-tool effect show radiation" });
    assert_eq!(next_line(&found), None);
    let found = serde_json::json!({ "next_command": null });
    assert_eq!(next_line(&found), None);
}
