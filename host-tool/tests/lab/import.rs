//! A table from elsewhere, from what an instrument wrote to what is compared.

use std::fs;

use crate::common::no_boards;
use crate::{json, lab, refuses};

#[test]
fn a_table_is_shown_then_written_and_compared() {
    let place = no_boards();
    let path = |name: &str| place.path().join(name).display().to_string();
    let [table, made] = [path("scope.csv"), path("made.csv")];
    let text = "Versuch 7\nU (mV);Strom (mA);Messwert\n0;0;12000\n1000;2,7;-14000\n2000;5,1;-78000\n3000;6,2;-148000\n";
    fs::write(&table, text).expect("a file");
    let shown = lab(&["import", &table]);
    assert_eq!(shown.code, 0, "{}", shown.err);
    for words in [
        "decimal commas",
        "'Messwert'",
        "left out",
        "nothing is written",
    ] {
        assert!(shown.out.contains(words), "{words}: {}", shown.out);
    }
    let column = ["--column", "z=Messwert:nm:-1"];
    let words = [&["import", &table, "-o", &made][..], &column].concat();
    assert_eq!(json(&words)["rows"], 4);
    let compared = json(&["compare", "reconciled", &made]);
    // 26, 90 and 160 um at 1, 2 and 3 V, which is about where that preset is.
    assert!(
        compared["rms"].as_f64().expect("an error") < 20.0,
        "{compared}"
    );
    refuses(&words, "already exists");
    refuses(
        &["import", &table, "--column", "z=Höhe"],
        "no column 'Höhe'",
    );
    // Who imports many files in a row is told which one it was.
    for (text, wrong) in [
        ("nothing but words\n", "this is no table of numbers"),
        (
            "a;b\n1;2\n2;3\n",
            "none of the columns a, b is known to be a voltage",
        ),
        ("PAR1", "this is a file in the format of Parquet"),
    ] {
        fs::write(&table, text).expect("a file");
        refuses(&["import", &table], &format!("scope.csv: {wrong}"));
    }
}

/// A sweep and its repetition, one below the other as a logger appends them.
#[test]
fn runs_of_one_table_are_kept_apart() {
    let place = no_boards();
    let path = |name: &str| place.path().join(name).display().to_string();
    let [table, first, second] = [path("both.csv"), path("first.csv"), path("second.csv")];
    let run = "0,0,0\n10,1,26\n20,2,90\n30,3,160\n";
    let again = run.replace(",1,26", ",1.5,50");
    fs::write(&table, format!("t (s),V (V),z (um)\n{run}{again}")).expect("a file");
    refuses(
        &["import", &table],
        "the time begins anew in row 5 of the table, which holds 2 runs, of 4, 4 rows",
    );
    for (number, made, line) in [("1", &first, "10.0,1.0"), ("2", &second, "10.0,1.5")] {
        let said = json(&["import", &table, "--run", number, "-o", made]);
        assert_eq!(said["rows"], 4);
        let written = fs::read_to_string(made).expect("a measurement");
        assert!(written.contains(line), "{written}");
    }
    refuses(&["import", &table, "--run", "3"], "there is no run 3");
    let both = json(&["compare", "reconciled", &first, &second]);
    assert!(both["rms"].is_number(), "{both}");
}

/// What a table says in other words than its first headings is not read by these.
#[test]
fn columns_that_headings_do_not_tell_are_asked_about() {
    let place = no_boards();
    let table = place.path().join("sheet.csv").display().to_string();
    let rows = "0,0,0,0,0,0\n1,1,2,3,3.5,70\n2,1,2,3,3,66\n";
    fs::write(&table, format!("t (s),Drive (V),,,,z (um)\n{rows}")).expect("a file");
    refuses(&["import", &table], "5 'Drive (V)' would all be V_V");
    let told = ["V1=2", "V2=3", "V3=4", "V4=5"].map(|said| ["--column", said]);
    let words = [&["import", &table][..], told.as_flattened()].concat();
    let preview = json(&words)["preview"].to_string();
    assert!(preview.contains("1.0,1.0,2.0,3.0,3.5,70.0"), "{preview}");
    let units = "Time,V (V),z (um)\ns,mV,um\n0,0,0\n1,1,26\n";
    let second = "t (s),V1 (V),z (um)\n0,0,0\n1,1,26\nt (s),V2 (V),z (um)\n2,1,26\n";
    for (text, wrong) in [
        (units, "column 2 is headed 'V (V)', and 'mV' stands beneath"),
        (second, "line 4 has other headings than the table above it"),
    ] {
        fs::write(&table, text).expect("a file");
        refuses(&["import", &table], wrong);
    }
}

/// A recording whose tool was killed.
#[test]
fn what_is_made_of_a_file_that_is_not_whole_is_not_whole() {
    let place = no_boards();
    let path = |name: &str| place.path().join(name).display().to_string();
    let [cut, made] = [path("cut.csv"), path("made.csv")];
    let rows = "0,0,0\n10,1,26\n20,2,90\n30,3,160\n";
    let text = format!("# ends_with=rows\n# noise_z_nm=20\nt_s,V_V,z_um\n{rows}");
    fs::write(&cut, text).expect("a file");
    let imported = lab(&["import", &cut, "-o", &made]);
    let why = "it was cut short after 4 rows";
    assert!(imported.out.contains(why), "{}", imported.out);
    let compared = lab(&["compare", "reconciled", &made]);
    assert!(compared.err.contains(why), "{}", compared.err);
    let made = fs::read_to_string(&made).expect("a file");
    assert!(made.starts_with("# noise_z_nm=20\n"), "{made}");
}
