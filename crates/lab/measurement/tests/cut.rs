//! A recording that breaks off anywhere is read for what it has, and told.

use measurement::import::{Table, guesses, import};
use measurement::{Keys, MeasurementFile, Row, Writer};
use proptest::prelude::*;

fn rows(z_um: &[f64]) -> Vec<Row> {
    let row = |(index, &z_um): (usize, &f64)| Row {
        t_s: index as f64 * 0.001,
        voltage_v: [1.5, 1.25, 0.0, 2.0],
        current_a: [Some(4.1e-3), Some(3.4e-3), Some(0.0), Some(5.2e-3)],
        z_um: Some(z_um),
        ..Row::default()
    };
    z_um.iter().enumerate().map(row).collect()
}

fn recording(rows: &[Row], partial: Option<&str>) -> Vec<u8> {
    let mut keys = Keys::default();
    keys.set("experiment", "record");
    keys.set("noise_z_nm", "20");
    let mut text = Vec::new();
    let mut writer = Writer::begin(&mut text, &keys, &rows[0]).unwrap();
    for row in rows {
        writer.row(row).unwrap();
    }
    writer.finish(partial).unwrap();
    text
}

fn read(text: &[u8]) -> Option<MeasurementFile> {
    MeasurementFile::parse("r.csv", std::str::from_utf8(text).unwrap()).ok()
}

fn flaw(file: &MeasurementFile) -> &str {
    file.keys.get("partial").unwrap_or_default()
}

#[test]
fn a_whole_recording_is_read_without_a_word() {
    let rows = rows(&[26.5, 27.25, 30.0]);
    let file = read(&recording(&rows, None)).unwrap();
    assert_eq!((&file.rows, flaw(&file)), (&rows, ""));
    assert_eq!(file.keys.displacement_noise_um(), Some(0.02));
    let again = MeasurementFile::parse("r.csv", &file.to_string()).unwrap();
    assert_eq!(again, file);
    let stopped = read(&recording(&rows, Some("interrupted"))).unwrap();
    assert_eq!((&stopped.rows, flaw(&stopped)), (&rows, "interrupted"));
}

#[test]
fn one_that_was_cut_before_its_second_row_says_so() {
    let cut = "# experiment=sine\n# partial=the link was lost\nt_s,V_V,z_um\n";
    for (row, has) in [("", "no rows"), ("0,1,2\n", "only one row")] {
        let refused = MeasurementFile::parse("sine_0p1.csv", &[cut, row].concat()).unwrap_err();
        let said = refused.to_string();
        assert!(
            said.contains("was cut short")
                && said.contains(has)
                && said.contains("the link was lost"),
            "{said}"
        );
        let help = miette::Diagnostic::help(&refused).expect("what to do");
        assert!(help.to_string().contains("remove this file"), "{help}");
    }
}

#[test]
fn rows_that_were_taken_out_are_told() {
    let text = String::from_utf8(recording(&rows(&[26.5, 27.25, 30.0]), None)).unwrap();
    let thinned: String = text
        .split_inclusive('\n')
        .filter(|line| !line.starts_with("0.001,"))
        .collect();
    let file = MeasurementFile::parse("r.csv", &thinned).unwrap();
    assert_eq!(flaw(&file), "it says that it has 3 rows, and has 2");
}

#[test]
fn a_file_by_hand_may_end_without_a_line_end() {
    let file =
        MeasurementFile::parse("hand.csv", "# rows=9\nt_s,V_V,z_um\n1,0,0\n2,1,26.5").unwrap();
    assert_eq!((file.rows[1].z_um, flaw(&file)), (Some(26.5), ""));
    assert_eq!(file.keys.get("rows"), Some("9"));
}

#[test]
fn an_import_keeps_that_a_recording_is_not_whole() {
    let rows = rows(&[26.5, 27.25, 30.0]);
    let whole = recording(&rows, None);
    let end = whole.windows(7).position(|bytes| bytes == b"# rows=");
    let lost = recording(&rows, Some("the link was lost"));
    for (text, kept, why) in [
        (&whole[..], 3, ""),
        (&lost[..], 3, "the link was lost"),
        (&whole[..end.unwrap()], 3, "it was cut short after 3 rows"),
        (
            &whole[..end.unwrap() - 6],
            2,
            "it was cut short after 2 rows, in the middle of a line, which is left out",
        ),
    ] {
        let table = Table::read(text).expect("a table");
        let imported = import(&table, &guesses(&table), false).expect("a measurement");
        let file = read(imported.file.to_string().as_bytes()).expect("readable");
        assert_eq!((file.rows.len(), flaw(&file)), (kept, why));
        let told = imported
            .notes
            .iter()
            .find(|note| note.contains("not whole"));
        assert_eq!(told.map_or("", |note| &note[note.len() - why.len()..]), why);
        assert_eq!(file.keys.get("experiment"), Some("record"));
        assert_eq!(file.keys.get("rows"), None);
    }
}

proptest! {
    #[test]
    fn cut_at_any_byte_it_is_refused_or_read_for_its_whole_rows_and_told(
        z_um in prop::collection::vec(20.0..120.0_f64, 2..6), partial: bool,
    ) {
        let rows = rows(&z_um);
        let text = recording(&rows, partial.then_some("interrupted"));
        let header = text.windows(2).position(|pair| pair == b"\n0").unwrap();
        for cut in 0..text.len() {
            let whole = text[..cut].iter().skip(header + 1).filter(|byte| **byte == b'\n').count().min(rows.len());
            match read(&text[..cut]) {
                None => prop_assert!(whole < 2, "{} rows at byte {}", whole, cut),
                Some(file) => {
                    prop_assert_eq!(&file.rows[..], &rows[..whole]);
                    let told = format!("it was cut short after {whole} rows");
                    prop_assert!(flaw(&file).starts_with(&told), "{} at byte {}", flaw(&file), cut);
                    let in_a_line = !text[..cut].ends_with(b"\n");
                    prop_assert_eq!(flaw(&file).contains("in the middle of a line"), in_a_line);
                }
            }
        }
    }
}
