//! Stories told to their end, by the tool and the image that are built.

use super::*;

/// Seeds that hide a wrong sensor, memory and heat; `MIRROR_FULL` has all of the table's instead.
const SHORT: [u64; 3] = [15, 5, 13];
/// Stories of the table that must end well: the ten.
const WELL: usize = 10;

/// A story that is told to its end, where there is a page.
fn ended(seed: u64, root: &Path) -> Story {
    let story = tell(seed, root);
    let story = story.unwrap_or_else(|error| {
        panic!("{error:#}; are tool and image built? `cargo xtask build mps2`")
    });
    let page = fs::read_to_string(root.join(seed.to_string()).join(PAGE)).expect("a page");
    assert!(page.contains(&story.verdict), "seed {seed}");
    story
}

/// Where the error is not ten times smaller, or at the sensor's limit, the row of the table says so.
#[test]
fn the_error_falls_ten_times_or_to_the_limit() {
    let is_full = std::env::var_os("MIRROR_FULL").is_some_and(|full| full == "1");
    let seeds: Vec<u64> = match is_full {
        true => (FIRST_OF_ALL..FIRST_OF_ALL + mirror::listed().len() as u64).collect(),
        false => SHORT.to_vec(),
    };
    let root = tempfile::tempdir().expect("a folder");
    let stories: Vec<Story> = seeds
        .into_iter()
        .map(|seed| ended(seed, root.path()))
        .collect();
    let well = stories.iter().filter(|story| story.ends_well()).count();
    let rows: Vec<String> = stories.iter().map(table::row).collect();
    println!("{}\n{}", table::HEADING, rows.join("\n"));
    assert!(
        well >= WELL.min(stories.len()),
        "{well} of {}",
        stories.len()
    );
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
