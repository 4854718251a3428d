//! Every kind of bad file gives one sentence that points at the place.

use measurement::{InputError, MeasurementFile, Session};

/// The message and the text that it points at.
fn complaint(text: &str) -> (String, String) {
    match MeasurementFile::parse("bad.csv", text) {
        Err(InputError::Content {
            message,
            help,
            place,
            ..
        }) => {
            assert!(!help.is_empty() && !message.contains('\n'));
            (
                message,
                text[place.offset()..place.offset() + place.len()].to_owned(),
            )
        }
        other => panic!("{other:?} for {text}"),
    }
}

#[track_caller]
fn refuses(text: &str, message: &str, place: &str) {
    let (said, at) = complaint(text);
    assert!(said.contains(message), "said '{said}'");
    assert_eq!(at, place);
}

#[test]
fn too_little() {
    refuses("", "the file is empty", "");
    refuses("# experiment=sweep\n", "the file is empty", "");
    refuses("t_s,V_V,z_um\n", "no rows", "");
    refuses("t_s,V_V,z_um\n1,0,0\n", "only one row", "");
}

#[test]
fn columns() {
    refuses(
        "t_global_s,V_V,z_um\n1,0,0\n2,1,1\n",
        "t_s is missing",
        "t_global_s,V_V,z_um",
    );
    refuses("t_s,z_um\n0,0\n1,1\n", "the drive is missing", "t_s,z_um");
    refuses(
        "t_s,V1_V,V2_V,V4_V\n0,0,0,0\n",
        "V3_V is missing",
        "t_s,V1_V,V2_V,V4_V",
    );
    refuses("t_s,V_V,V1_V\n0,0,0\n", "beside", "t_s,V_V,V1_V");
    refuses("t_s,V_V,I_A,I1_A\n0,0,0,0\n", "beside", "t_s,V_V,I_A,I1_A");
    refuses("t_s,V_V,colour\n0,0,0\n", "no column 'colour'", "colour");
    refuses("t_s,V_V,t_s\n0,0,0\n", "twice", "t_s");
}

#[test]
fn units_in_other_spellings() {
    for (column, right) in [
        ("z_nm", "z_um"),
        ("z [µm]", "z_um"),
        ("z_m", "z_um"),
        ("Z_UM", "z_um"),
        ("t_ms", "t_s"),
        ("time", "t_s"),
        ("I1_mA", "I1_A"),
        ("V1_mV", "V1_V"),
        ("tilt_x_rad", "tilt_x_deg"),
        ("T_ambient_K", "T_ambient_C"),
        ("reference_mm", "reference_um"),
        ("stage", "reference_um"),
    ] {
        let text = format!("t_s,V_V,{column}\n0,0,0\n1,1,1\n");
        refuses(&text, &format!("no column '{column}'"), column);
        let Err(InputError::Content { help, .. }) = MeasurementFile::parse("bad.csv", &text) else {
            unreachable!()
        };
        assert!(help.contains(right), "{help}");
    }
}

#[test]
fn cells() {
    refuses("t_s,V_V,z_um\n0,0,0\n1,1,NaN\n", "z_um is 'NaN'", "NaN");
    refuses("t_s,V_V,z_um\n0,0,0\n1,1,-inf\n", "z_um is '-inf'", "-inf");
    refuses(
        "t_s,V_V,z_um\n0,0,0\n1,1e999,2\n",
        "V_V is '1e999'",
        "1e999",
    );
    refuses(
        "t_s,V_V,z_um\n0,0,0\n1,1,12um\n",
        "'12um' is not a number",
        "12um",
    );
    refuses("t_s,V_V,z_um\n0,0,0\n1,,5\n", "V_V is empty", "");
    refuses(
        "t_s,V_V,z_um\n0,0,0\n1,1\n",
        "2 cells, the header has 3",
        "1,1",
    );
    refuses(
        "# noise_z_nm=loud\nt_s,V_V\n",
        "noise_z_nm must be a number",
        "# noise_z_nm=loud",
    );
    refuses(
        "# date=1\n# date=2\nt_s,V_V\n",
        "'date' is given twice",
        "# date=2",
    );
}

#[test]
fn times() {
    refuses(
        "t_s,V_V\n0,0\n2,1\n1,1\n",
        "goes back: 1 s comes after 2 s",
        "1",
    );
    refuses("t_s,V_V\n0,0\n2,1\n2,1\n", "is there twice", "2");
    refuses("t_global_s,t_s,V_V\n5,0,0\n4,2,1\n", "goes back", "4");
}

#[test]
fn currents() {
    refuses(
        "t_s,V_V,I_A\n0,0,0\n1,1,2.6\n2,2,4.5\n",
        "looks like mA",
        "2.6",
    );
    refuses(
        "t_s,V_V,I_A\n0,0,0\n1,1,2600\n2,2,4500\n",
        "looks like uA",
        "2600",
    );
    refuses(
        "t_s,V_V,I_A\n0,0,0\n1,1,-2.6e-3\n2,2,-4.5e-3\n",
        "wrong sign",
        "-2.6e-3",
    );
    // A dead meter, and the noise of one whose heater is open.
    refuses(
        "t_s,V_V,I_A\n0,0,0\n1,1,0\n2,2,0\n",
        "carries no current",
        "0",
    );
    refuses(
        "t_s,V_V,I_A\n0,0,0\n1,1,1.2e-6\n2,2,-2e-6\n3,2.5,-3e-6\n",
        "up to 2.500 V, and carries no current",
        "1.2e-6",
    );
    let bench_heater = "# R0_ohm=0.4\nt_s,V_V,I_A\n0,0,0\n1,1,2.6\n2,2,4.5\n";
    assert!(MeasurementFile::parse("heater.csv", bench_heater).is_ok());
}

#[test]
fn other_units() {
    refuses("t_s,V_V,z_um\n0,0,0\n1,2,1e-4\n", "looks like m", "1e-4");
    refuses("t_s,V_V,z_um\n0,0,0\n1,2,0.1\n", "looks like mm", "0.1");
    // A sensor's noise of tens of nanometres, and what the drive adds to it, in mm.
    let noisy = |of_the_drive: f64| {
        let rows = (0..60).map(|i: u32| {
            let (v, noise) = (f64::from(i % 4), f64::from(i * 37 % 11) * 1e-2);
            format!("{i},{v},{}\n", noise + of_the_drive * v * v)
        });
        format!("t_s,V_V,z_um\n{}", rows.collect::<String>())
    };
    refuses(&noisy(0.03), "looks like mm", "0.37");
    // Nothing moves: resistors in the mirror's place, or a spot beside it.
    assert!(MeasurementFile::parse("still.csv", &noisy(0.0)).is_ok());
    refuses("t_s,V_V,z_um\n0,0,0\n1,2,90000\n", "looks like nm", "90000");
    refuses("t_s,V_V,z_um\n0,0,0\n1,2000,90\n", "looks like mV", "2000");
}

#[test]
fn what_no_bench_has_is_refused() {
    refuses(
        "t_s,V_V,I_A\n0,1,3e-3\n1,2,1e300\n2,3,9e-3\n",
        "no heater takes a current of 1e300 A",
        "1e300",
    );
    refuses(
        "V_V,I1_A,I2_A\n1,3e-3,3e-3\n2,6e-3,-2e3\n3,9e-3,9e-3\n",
        "no heater takes a current of -2e3 A",
        "-2e3",
    );
    refuses(
        "t_s,V_V,z_um\n0,0,0\n1e300,1,90\n",
        "longer than any measurement",
        "1e300",
    );
    let decade = "t_s,V_V,I_A\n0,1,3e-3\n3e8,2,6e-3\n";
    assert!(MeasurementFile::parse("decade.csv", decade).is_ok());
    // A short circuit of a bench supply.
    let heavy = "t_s,V_V,I_A\n0,1,200\n1,2,400\n";
    assert!(MeasurementFile::parse("heavy.csv", heavy).is_ok());
}

#[test]
fn surroundings_and_references() {
    let with = |column: &str, value: &str| format!("t_s,V_V,{column}\n0,0,\n1,0.1,{value}\n");
    refuses(
        &with("T_ambient_C", "295.15"),
        "look like kelvins",
        "295.15",
    );
    refuses(&with("T_ambient_C", "1e4"), "no room and no oven", "1e4");
    refuses(&with("T_ambient_C", "-273"), "no room and no oven", "-273");
    refuses(
        &with("T_ambient_C", "warm"),
        "'warm' is not a number",
        "warm",
    );
    refuses(&with("reference_um", "1e-4"), "looks like m", "1e-4");
    refuses(&with("reference_um", "-0.15"), "looks like mm", "-0.15");
    refuses(&with("reference_um", "150000"), "looks like nm", "150000");
    refuses(&with("reference_um", "inf"), "reference_um is 'inf'", "inf");
    for (column, value) in [
        ("T_ambient_C", "85"),
        ("reference_um", "-150"),
        ("reference_um", "0"),
    ] {
        assert!(MeasurementFile::parse("fine.csv", &with(column, value)).is_ok());
    }
}

#[test]
fn a_saturated_sensor() {
    let text = "t_s,V_V,z_um\n0,0,0\n1,1,26\n2,2,150\n3,2.5,150\n4,3,150\n5,2.5,150\n6,1,26\n";
    refuses(text, "saturated: it stays at exactly 150 um", "150");
    let held = "t_s,V_V,z_um\n0,0,0\n1,1,26\n2,2,150\n3,2,150\n4,2,150\n5,1,26\n";
    assert!(
        MeasurementFile::parse("held.csv", held).is_ok(),
        "a drive that is held may give the same reading"
    );
}

#[test]
fn files_that_are_not_there() {
    let error = Session::load(&["no/such/file.csv"]).unwrap_err();
    assert!(error.to_string().contains("no/such/file.csv"));
    let empty: [&str; 0] = [];
    assert!(matches!(
        Session::load(&empty),
        Err(InputError::NoFiles { .. })
    ));
}

#[test]
fn a_table_of_another_program_is_told_how_it_is_taken() {
    let taken = measurement::column::suggestion("Zeit;U / V;z / \u{b5}m");
    assert!(
        taken.contains("`host-tool import` makes a measurement file of it"),
        "{taken}"
    );
    let other_unit = measurement::column::suggestion("z_nm");
    assert!(other_unit.contains("z_um"), "{other_unit}");
}

#[test]
fn clocks_that_go_apart() {
    let rows = |factor: f64| {
        let row = |n: u32| {
            let t_s = f64::from(n);
            format!("{},{t_s},0.{n},{n}\n", 5.0 + factor * t_s)
        };
        format!(
            "t_global_s,t_s,V_V,z_um\n{}",
            (1..=5).map(row).collect::<String>()
        )
    };
    refuses(
        &rows(1e-3),
        "t_s passes 4.0000 s, and t_global_s 0.0040 s",
        "5",
    );
    // A host that pauses between the rows, and two clocks that are apart by rounding.
    for factor in [1.0, 0.99, 3.0] {
        assert!(
            MeasurementFile::parse("good.csv", &rows(factor)).is_ok(),
            "{factor}"
        );
    }
}
