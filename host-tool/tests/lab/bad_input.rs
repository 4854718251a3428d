//! Bad input: one clear sentence that points at the place, and nothing written.

use std::fs;
use std::path::Path;

use crate::common::no_boards;
use crate::{lab, refuses, session};

const SWEEP: &str = "t_s,V_V,z_um\n1,0,0\n2,1,26\n3,2,90\n4,3,160\n";
const EFFECT: &str = r#"
id = "mine"
title = "one of my own"
stage = "curvature"
acts = "curvature"
formula = "FORMULA"
shows = "somewhere"
[[parameters]]
symbol = "q"
unit = "1"
start = 0.1
low = 0.0
high = 1.0
"#;

/// What `fit` says to this measurement file; nothing may be written.
#[track_caller]
fn refused_file(content: &str, sentence: &str, place: &str) {
    let directory = no_boards();
    let path = |name: &str| directory.path().join(name);
    fs::write(path("bad.csv"), content).expect("a file");
    let [file, output] = ["bad.csv", "out.toml"].map(|name| path(name).display().to_string());
    refused(
        &["fit", "paper", &file, "-o", &output],
        sentence,
        place,
        &output,
    );
}

/// What `effect add` says to this effect.
#[track_caller]
fn refused_effect(content: &str, sentence: &str, place: &str) {
    let directory = no_boards();
    let path = |name: &str| directory.path().join(name);
    fs::write(path("mine.toml"), content).expect("a file");
    let [effect, output] = ["mine.toml", "out.toml"].map(|name| path(name).display().to_string());
    let files = session("").display().to_string();
    let words = ["effect", "add", &effect, "paper", &files, "-o", &output];
    refused(&words, sentence, place, &output);
}

/// What `compare` says to this model.
#[track_caller]
fn refused_model(content: &str, sentence: &str, place: &str) {
    let directory = no_boards();
    let model = directory.path().join("model.toml");
    fs::write(&model, content).expect("a file");
    let files = session("").display().to_string();
    let output = directory.path().join("out.toml").display().to_string();
    let model = model.display().to_string();
    refused(
        &["fit", &model, &files, "-o", &output],
        sentence,
        place,
        &output,
    );
}

#[track_caller]
fn refused(words: &[&str], sentence: &str, place: &str, output: &str) {
    let said = lab(words);
    assert_ne!(said.code, 0, "{words:?} is taken: {}", said.out);
    let all = said.sentence();
    assert!(
        all.contains(sentence),
        "`{sentence}` is not said: {}",
        said.err
    );
    assert!(
        all.contains(place),
        "`{place}` is not pointed at: {}",
        said.err
    );
    assert!(
        !all.contains("panicked") && said.out.is_empty(),
        "{}",
        said.err
    );
    assert!(!Path::new(output).exists(), "something was written");
}

#[test]
fn an_oven_beside_a_room_of_which_nobody_knows_how_warm_it_was() {
    let directory = no_boards();
    let path = |name: &str| directory.path().join(name).display().to_string();
    let [room, oven, output] = ["room.csv", "oven.csv", "out.toml"].map(path);
    fs::write(&room, SWEEP).expect("a file");
    fs::write(&oven, "t_s,V_V,I_A,T_ambient_C\n1,0,0,60\n2,0.4,1e-3,60\n").expect("a file");
    refused(
        &["fit", "paper", &room, &oven, "-o", &output],
        "does not say at which temperature it was measured",
        "room.csv",
        &output,
    );
}

#[test]
fn what_is_no_file_or_never_ends() {
    let directory = no_boards();
    let output = directory.path().join("out.toml").display().to_string();
    let huge = directory.path().join("huge").display().to_string();
    fs::File::create(&huge)
        .and_then(|file| file.set_len(1 << 40))
        .expect("a file without a byte on the disk");
    let files = session("").display().to_string();
    let here = directory.path().display().to_string();
    for (bad, sentence) in [("/dev/zero", "is a device"), (&huge, "MB"), (&here, "")] {
        refused(
            &["fit", "paper", bad, "-o", &output],
            sentence,
            bad,
            &output,
        );
        let model = ["fit", bad, &files, "-o", &output];
        refused(&model, sentence, bad, &output);
        let link = directory.path().join("mine.toml");
        let _ = fs::remove_file(&link);
        std::os::unix::fs::symlink(bad, &link).expect("a link");
        let link = link.display().to_string();
        let effect = ["effect", "add", &link, "paper", &files, "-o", &output];
        refused(&effect, sentence, "mine.toml", &output);
    }
}

#[test]
fn measurement_files() {
    refused_file("", "the file is empty", "bad.csv:1");
    refused_file("t_s,V_V,z_um\n1,0,0\n", "only one row", "bad.csv:2");
    refused_file("t_s,z_um\n1,0\n2,1\n", "the drive is missing", "bad.csv:1");
    refused_file(
        &SWEEP.replace("z_um", "height"),
        "no column 'height'",
        "bad.csv:1",
    );
    refused_file(&SWEEP.replace("z_um", "z [nm]"), "z [nm]", "bad.csv:1");
    let kelvins = "t_s,V_V,z_um,T_ambient_C\n1,0,0,295\n2,1,26,295\n";
    refused_file(kelvins, "look like kelvins", "bad.csv:2");
    let metres = "t_s,V_V,z_um,reference_um\n1,0,0,0\n2,0,50,50e-6\n";
    refused_file(metres, "looks like m", "bad.csv:3");
    refused_file(&SWEEP.replace("26", "NaN"), "NaN", "bad.csv:3");
    refused_file(&SWEEP.replace("26", "inf"), "inf", "bad.csv:3");
    refused_file(&SWEEP.replace("3,2,", "2,2,"), "time", "bad.csv:4");
    refused_file(&SWEEP.replace("3,2,", "0.5,2,"), "time", "bad.csv:4");
    refused_file(
        &SWEEP
            .replace("90", "90e-6")
            .replace("160", "160e-6")
            .replace("26", "26e-6"),
        "looks like m",
        "bad.csv:5",
    );
    refused_file(
        "t_s,V_V,I_A\n1,1,2.7\n2,2,5.1\n3,3,6.2\n",
        "looks like mA",
        "bad.csv:2",
    );
    refused_file(
        "t_s,V_V,I_A\n1,1,-2.7e-3\n2,2,-5.1e-3\n",
        "wrong sign",
        "bad.csv:2",
    );
    refused_file(
        "t_s,V_V,z_um\n1,1,26\n2,2,90\n3,2.5,90\n4,3,90\n",
        "saturated",
        "bad.csv:3",
    );
    refused_file(
        &SWEEP.replace("4,3,", "4,12,"),
        "a drive of 12 V is beyond the model's range",
        "bad.csv:5",
    );
}

#[test]
fn a_heater_without_a_displacement_may_take_any_drive() {
    let directory = no_boards();
    let file = directory.path().join("heater.csv");
    fs::write(&file, "t_s,V_V,I_A\n1,5,0.013\n2,10,0.02\n3,12,0.022\n").expect("a file");
    let said = lab(&["compare", "paper", &file.display().to_string()]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.out.contains("rms mA"), "{}", said.out);
}

#[test]
fn models() {
    let head = "format = 1\npreset = \"paper\"\n";
    refused_model(
        "format = 1\npreset = \"nature\"\n",
        "nature",
        "model.toml:2",
    );
    refused_model(
        &format!("{head}[[effects]]\nid = \"warp\"\n"),
        "warp",
        "model.toml:4",
    );
    refused_model(
        &format!("{head}[parameters]\nR9 = 3.0\n"),
        "R9",
        "model.toml:4",
    );
    refused_model(
        &format!("{head}[[effects]]\nid = \"creep\"\n[effects.parameters]\nd = 3.0\n"),
        "d",
        "model.toml",
    );
}

#[test]
fn effects_of_ones_own() {
    let with = |formula: &str| EFFECT.replace("FORMULA", formula);
    refused_effect(&with("x * (1 + q"), "cannot be read", "mine.toml:6");
    refused_effect(
        &with("x * (1 + q * speed)"),
        "'speed' is not known",
        "mine.toml:6",
    );
    refused_effect(&with("x + q / 0"), "gives", "mine.toml:6");
    // Only where it is driven: the model with it has no finite answer.
    refused_effect(&with("x * (1 + q / (1 - V / 3.5))"), "runs away", "");
    let runaway = format!(
        "{}[[states]]\nsymbol = \"s\"\nrate = \"1e3 * (s + 1)\"\n",
        with("x * (1 + q * s)")
    );
    refused_effect(&runaway, "runs away", "");
    let unknown = format!(
        "{}[[states]]\nsymbol = \"s\"\nrate = \"x - u\"\n",
        with("x + q * s")
    );
    refused_effect(&unknown, "'u' is not known", "mine.toml:16");
    refused_effect(
        &with("x").replace("high = 1.0", "high = -1.0"),
        "q",
        "mine.toml",
    );
}

#[test]
fn one_operating_point_is_compared_and_nothing_is_fitted_to_it() {
    let place = no_boards();
    let path = |name: &str| place.path().join(name).display().to_string();
    let [file, model, page] = [path("one.csv"), path("model.toml"), path("page.html")];
    let rows: String = (0..30)
        .map(|n| format!("{n},2.0,0.004692,70.386\n"))
        .collect();
    fs::write(&file, format!("t_s,V_V,I_A,z_um\n{rows}")).expect("a file");
    let one = "all readings are of one operating point, 2 V";
    refuses(&["fit", "paper", &file, "-o", &model], one);
    refuses(&["identify", "paper", &file, "-o", &model], one);
    refuses(&["diagnose", "paper", &file], one);
    refuses(&["report", &file, "-o", &page], one);
    assert_eq!(lab(&["compare", "paper", &file]).code, 0);
}

/// A measurement cannot be made again, whatever else --force may replace.
#[test]
fn what_is_read_is_not_overwritten() {
    let place = no_boards();
    let path = |name: &str| place.path().join(name).display().to_string();
    let [file, folder, model] = [path("sweep.csv"), path(""), path("model.toml")];
    let text = "V (V),z (um)\n0,0\n1,26\n2,90\n3,160\n";
    fs::write(&file, text).expect("a file");
    let lost = "is a measurement that this reads, and would be lost";
    refuses(&["import", &file, "-o", &file, "--force"], lost);
    fs::write(&file, text.replace("V (V),z (um)", "V_V,z_um")).expect("a file");
    for read in [&file, &folder] {
        refuses(&["fit", "paper", read, "-o", &file, "--force"], lost);
        refuses(
            &["diagnose", "paper", read, "--propose", &file, "--force"],
            lost,
        );
    }
    refuses(&["compare", "paper", &folder, &file], "is there twice");
    assert!(
        fs::read_to_string(&file)
            .expect("the file")
            .ends_with("3,160\n")
    );
    // What is made of it may be replaced.
    fs::write(&model, "").expect("a file");
    assert_eq!(
        lab(&["fit", "paper", &file, "-o", &model, "--force"]).code,
        0
    );
}
