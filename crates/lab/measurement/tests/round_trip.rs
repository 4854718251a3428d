//! What is written is read back, and what is read is understood.

use measurement::{Keys, MeasurementFile, Row, Session};
use proptest::prelude::*;

#[test]
fn columns_in_any_order_and_shorthands() {
    let text = "# experiment=sweep\n# one actuator\n# prehold_V = 1.0\n# prehold_s=5\n#drive=1+sin(t)\n\
                z_um, I_A ,V_V,t_s\n0,,0,0.5\n26.5,2.6e-3,1,1\n";
    let file = MeasurementFile::parse("a.csv", text).unwrap();
    assert_eq!(file.experiment(), "sweep");
    assert_eq!(file.keys.prehold(), Some((1.0, 5.0)));
    assert!(file.keys.drive_is_interpolated() && file.has_current() && file.has_displacement());
    assert_eq!(file.notes, ["one actuator"]);
    assert_eq!(file.rows[0].current_a, [None; 4]);
    let last = Row {
        t_s: 1.0,
        voltage_v: [1.0; 4],
        current_a: [Some(2.6e-3); 4],
        z_um: Some(26.5),
        ..Row::default()
    };
    assert_eq!(file.rows[1], last);
}

#[test]
fn a_folder_is_a_session_in_the_order_of_its_clock() {
    let folder = std::env::temp_dir().join(format!("measurement-session-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("a.csv"), "t_global_s,t_s,V_V\n11,1,0\n12,2,1\n").unwrap();
    std::fs::write(folder.join("b.csv"), "t_global_s,t_s,V_V\n1,1,0\n2,2,1\n").unwrap();
    std::fs::write(folder.join("notes.txt"), "not a measurement").unwrap();
    let session = Session::load(&[&folder]).unwrap();
    let starts: Vec<_> = session
        .files
        .iter()
        .map(|(_, file)| file.rows[0].t_global_s)
        .collect();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(starts, [Some(1.0), Some(11.0)]);
}

#[test]
fn each_clock_s_files_stay_together_and_one_says_how_warm_it_was_for_all() {
    let folder = std::env::temp_dir().join(format!("measurement-clocks-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let day = "# session=2026-11-21T10:00:00Z\n";
    write(
        "a.csv",
        &format!("{day}t_global_s,t_s,V_V\n11,1,0\n12,2,1\n"),
    );
    write(
        "b.csv",
        &format!("{day}t_global_s,t_s,V_V,T_ambient_C\n1,1,0,22\n2,2,1,22\n"),
    );
    let oven =
        "# session=2026-11-21T11:00:00Z\nt_global_s,t_s,V_V,T_ambient_C\n5,1,0,60\n6,2,1,60\n";
    write("c.csv", oven);
    let session = Session::load(&[&folder]).unwrap();
    let order: Vec<_> = session
        .files
        .iter()
        .map(|(_, file)| (file.rows[0].t_global_s, session.ambient_c(file)))
        .collect();
    write("d.csv", "t_s,V_V\n1,0\n2,1\n");
    let unsaid = Session::load(&[&folder]).unwrap_err().to_string();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(
        order,
        [
            (Some(1.0), Some(22.0)),
            (Some(11.0), Some(22.0)),
            (Some(5.0), Some(60.0))
        ]
    );
    assert!(
        unsaid.contains("d.csv' does not say at which temperature") && unsaid.contains("b.csv"),
        "{unsaid}"
    );
}

fn row() -> impl Strategy<Value = Row> {
    let current = prop::option::of(1e-3..1e-2_f64);
    let currents = [current.clone(), current.clone(), current.clone(), current];
    let optional = || prop::option::of(-1e3..1e3_f64);
    (
        0.001..10.0_f64,
        [0.0..3.5_f64, 0.0..3.5, 0.0..3.5, 0.0..3.5],
        currents,
        optional(),
        optional(),
        optional(),
        prop::option::of(-40.0..100.0_f64),
        prop::option::of(1.0..200.0_f64),
    )
        .prop_map(
            |(t_s, voltage_v, current_a, z_um, tilt_x_deg, tilt_y_deg, ambient_c, reference_um)| {
                Row {
                    t_s,
                    t_global_s: None,
                    voltage_v,
                    current_a,
                    z_um,
                    tilt_x_deg,
                    tilt_y_deg,
                    ambient_c,
                    reference_um,
                    asked_um: reference_um.map(|um| 0.5 * um),
                    uncertainty_um: reference_um.map(|um| 0.01 * um.abs()),
                    asked_tilt_x_deg: tilt_x_deg.map(|deg| 0.5 * deg),
                    asked_tilt_y_deg: tilt_y_deg.map(|deg| -deg),
                    trigger: reference_um.map(|um| um as u8 % 4),
                }
            },
        )
}

proptest! {
    #[test]
    fn what_is_written_is_read_back(mut rows in prop::collection::vec(row(), 2..20), note in "[a-z ,;]{0,20}", device in "\\PC{0,20}") {
        let mut t = 0.0;
        for row in &mut rows {
            t += row.t_s;
            row.t_s = t;
            row.t_global_s = Some(t + 100.0);
            // Keeps the file plausible: a displacement of at least a micrometre, so that it is not taken for mm.
            row.z_um = row.z_um.map(|z| z + z.signum());
        }
        let mut keys = Keys::default();
        keys.set("experiment", "random");
        keys.set("device", &device);
        let file = MeasurementFile { keys, notes: vec![note.trim().to_owned()], rows };
        prop_assert_eq!(MeasurementFile::parse("f.csv", &file.to_string()).unwrap(), file);
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[-t_sVz1IA#=,.0-9eE\"\\n\\r µ]{0,120}", any in ".{0,60}") {
        let _ = MeasurementFile::parse("f.csv", &text);
        let _ = MeasurementFile::parse("f.csv", &any);
        let _ = MeasurementFile::parse("f.csv", &format!("t_s,V_V,z_um\n{text}"));
    }
}

#[test]
fn the_papers_points_are_a_session() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../data/paper");
    let session = Session::load(&[folder]).unwrap();
    assert_eq!(session.files.len(), 2);
    assert!(
        session
            .files
            .iter()
            .all(|(_, file)| file.rows.last().and_then(|row| row.z_um) == Some(173.7))
    );
}

#[test]
fn settled_readings_have_no_times_and_no_order() {
    let rows = ["0.5,1e-3,3", "2,4e-3,40", "1,2e-3,11"];
    let file = |rows: &[&str]| {
        let text = format!("V_V,I_A,z_um\n{}\n", rows.join("\n"));
        MeasurementFile::parse("a.csv", &text).unwrap()
    };
    let one = file(&rows);
    assert!(one.keys.is_steady());
    assert_eq!(one, file(&[rows[1], rows[0], rows[2]]));
    let volts: Vec<f64> = one.rows.iter().map(|row| row.voltage_v[0]).collect();
    assert_eq!(volts, [0.5, 1.0, 2.0]);
    let again = MeasurementFile::parse("a.csv", &one.to_string()).unwrap();
    assert_eq!(again, one);
    // Times that say nothing may go back.
    let text = "# steady=yes\nt_s,V_V\n3,1\n3,0\n1,2\n";
    assert_eq!(MeasurementFile::parse("a.csv", text).unwrap().rows.len(), 3);
    let unsaid = MeasurementFile::parse("a.csv", "t_global_s,V_V\n1,0\n2,1\n").unwrap_err();
    assert!(unsaid.to_string().contains("t_s is missing"), "{unsaid}");
}
