//! A million rows: read, thinned and diagnosed, with progress that is true.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::time::Instant;

use serde_json::Value;

use crate::common::{Said, no_boards};
use crate::lab;

const ROWS: usize = 1_000_000;
/// Levels of the drive, so many.
const LEVELS: usize = 20;
const STEP_S: f64 = 1e-3;
/// A lamp of 6 V that loses its heat by radiation and through its ends. Its resistance grows as the model file says, so that
/// radiation alone is missing.
const ROOM_K: f64 = 295.0;
const COLD_OHM: f64 = 2.2;
const GROWTH_PER_K: f64 = 0.00407;
const RADIATED_W_PER_K4: f64 = 7.3e-14;
const ENDS_W_PER_K: f64 = 2.0e-4;
const STORED_J_PER_K: f64 = 2.0e-4;

/// A recording of the lamp at levels up to 6 V, its drive read off a meter that jitters so much.
fn recording(jitter_v: f64) -> String {
    let mut text = String::from("# experiment=stairs\nt_s,V_V,I_A\n");
    let mut warm_k = ROOM_K;
    let mut state = 1u64;
    let mut uniform = || {
        // Knuth's MMIX generator.
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    for row in 0..ROWS {
        let volts = 6.0 * (1 + row * LEVELS / ROWS) as f64 / LEVELS as f64;
        let ohm = COLD_OHM * (1.0 + GROWTH_PER_K * (warm_k - ROOM_K));
        let lost_w = RADIATED_W_PER_K4 * (warm_k.powi(4) - ROOM_K.powi(4))
            + ENDS_W_PER_K * (warm_k - ROOM_K);
        warm_k += STEP_S * (volts * volts / ohm - lost_w) / STORED_J_PER_K;
        // Uniform numbers have a standard deviation of 1 / sqrt(12). The ammeter is good to 0.03 %.
        let read_v = volts + jitter_v * 12f64.sqrt() * uniform();
        let read_a = volts / ohm * (1.0 + 3e-4 * 12f64.sqrt() * uniform());
        let t_s = STEP_S * (row + 1) as f64;
        let _ = writeln!(text, "{t_s:.3},{read_v:.5},{read_a:.7}");
    }
    text
}

fn diagnosed(recording: &str) -> (Value, Said) {
    let place = no_boards();
    let file = place.path().join("stairs.csv");
    fs::write(&file, recording).expect("written");
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/heaters/lamp.toml");
    let words = [
        "diagnose",
        &model.to_string_lossy(),
        &file.to_string_lossy(),
        "-v",
        "--json",
    ];
    let said = lab(&words);
    assert_eq!(said.code, 0, "{}", said.err);
    (serde_json::from_str(&said.out).expect("JSON"), said)
}

/// A page must not be larger: it is sent to colleagues.
const PAGE_BYTES: u64 = 2_000_000;

#[test]
#[ignore = "long"]
fn a_page_of_a_million_rows_is_small_and_says_what_it_left_out() {
    let place = no_boards();
    let [file, page] = ["stairs.csv", "report.html"].map(|name| place.path().join(name));
    fs::write(&file, recording(0.0)).expect("written");
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/heaters/lamp.toml");
    let [file, model, page_name] = [&file, &model, &page].map(|path| path.to_string_lossy());
    let start = Instant::now();
    let said = lab(&["report", &file, "--model", &model, "-o", &page_name]);
    println!("{ROWS} rows: {:.0} s", start.elapsed().as_secs_f64());
    assert_eq!(said.code, 0, "{}", said.err);
    let bytes = fs::metadata(&page).expect("a page").len();
    println!("{bytes} bytes");
    assert!(bytes < PAGE_BYTES, "{bytes}");
    let told = "rows of dense sampling are left out";
    let text = fs::read_to_string(&page).expect("text");
    assert!(text.contains(told), "the page does not tell");
    assert!(said.out.contains(told), "{}", said.out);
}

#[test]
#[ignore = "long"]
fn a_million_rows_say_the_same_with_a_meter_s_jitter_and_without() {
    let [(clean, _), (jitters, said)] = [0.0, 2e-3].map(|jitter_v| diagnosed(&recording(jitter_v)));
    for found in [&clean, &jitters] {
        let left_out = found["thinned_rows"].as_u64().expect("a number");
        assert!(left_out > 990_000, "{left_out}");
        assert!(
            found["notes"].to_string().contains("are simulated"),
            "{}",
            found["notes"]
        );
    }
    assert!(
        jitters["notes"].to_string().contains("jitters by"),
        "{}",
        jitters["notes"]
    );
    assert_eq!(clean["verdict"], jitters["verdict"]);
    assert_eq!(clean["effects"], jitters["effects"]);
    let read: Vec<u64> = said
        .err
        .lines()
        .filter(|line| line.contains("MB of"))
        .filter_map(|line| line.split(' ').next()?.parse().ok())
        .collect();
    assert!(read.len() >= 3 && read.is_sorted(), "{}", said.err);
    let places = [
        "MB of",
        "null ensemble: mirrors fitted",
        "the base is fitted",
        "effects tried",
    ]
    .map(|step| {
        said.err
            .find(step)
            .unwrap_or_else(|| panic!("{step}: {}", said.err))
    });
    assert!(
        places[0] < places[1] && places[2] < places[3],
        "{}",
        said.err
    );
}
