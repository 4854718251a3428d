//! Tables as people and instruments write them.

use measurement::MeasurementFile;
use measurement::import::{Assignment, Imported, Table, guesses, import, with_guesses};
use proptest::prelude::*;

fn guessed(text: &[u8], settled: bool) -> Imported {
    let table = Table::read(text).expect("a table");
    let imported = import(&table, &guesses(&table), settled).expect("a measurement");
    // What was made is a measurement file.
    let again = MeasurementFile::parse("made.csv", &imported.file.to_string()).expect("readable");
    assert_eq!(again.rows.len(), imported.file.rows.len());
    imported
}

fn says(imported: &Imported, words: &str) -> bool {
    imported.notes.iter().any(|note| note.contains(words))
}

#[test]
fn a_german_spreadsheet_in_latin_1() {
    let text = b"Messung vom 3. M\xe4rz\r\nZeit (ms);Spannung (V);Strom [mA];Weg (\xb5m)\r\n\
                 0;0,0;0,0;0,0\r\n1000;1,5;4,1;60,5\r\n2000;3,0;7,3;;\r\n";
    let imported = guessed(text, false);
    let rows = &imported.file.rows;
    assert_eq!(rows.len(), 3);
    assert_eq!((rows[1].t_s, rows[1].voltage_v), (1.0, [1.5; 4]));
    assert_eq!(rows[1].z_um, Some(60.5));
    assert!((rows[1].current_a[3].unwrap() - 4.1e-3).abs() < 1e-12);
    assert_eq!(rows[2].z_um, None);
}

#[test]
fn utf_16_tabs_and_blanks() {
    let text = "t/s\tV/mV\n1\t500\n2\t1500\n";
    let wide: Vec<u8> = [0xff, 0xfe]
        .into_iter()
        .chain(text.encode_utf16().flat_map(u16::to_le_bytes))
        .collect();
    assert_eq!(guessed(&wide, false).file.rows[1].voltage_v, [1.5; 4]);
    let blanks = guessed(b"  t_s   V   I_mA\n 1  0.5  1e-1\n 2  1.0  2e-1\n", false);
    assert_eq!(blanks.file.rows[0].current_a[0], Some(1e-4));
}

/// As LabVIEW writes it: a header of its file and one of its channels, between tabs, of which its rows have one more than those.
#[test]
fn headers_of_labview_have_as_many_words_as_its_rows_numbers() {
    let head = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\n***End_of_Header***\t\n\t\n\
        Channels\t3\t\t\t\nSamples\t15\t15\t15\t\nDate\t2026/11/30\t2026/11/30\t2026/11/30\n\
        Time\t10:11:12\t10:11:12\t10:11:12\nX_Dimension\tTime\tTime\tTime\nX0\t0,0E+0\t0,0E+0\t0,0E+0\n\
        Delta_X\t1,0\t1,0\t1,0\n***End_of_Header***\t\nX_Value\tVoltage (V)\tCurrent (A)\tz (um)\tComment\n";
    let row = |t| format!("{t},000000\t{t},250000\t0,000692713\t{t},593750\t\n");
    let text = head.to_owned() + &(0..15).map(row).collect::<String>();
    let rows = guessed(text.as_bytes(), false).file.rows;
    assert_eq!((rows.len(), rows[2].t_s), (15, 2.0));
    assert_eq!(
        (rows[3].voltage_v, rows[3].z_um),
        ([3.25; 4], Some(3.59375))
    );
}

#[test]
fn a_user_says_what_no_name_says() {
    let table = Table::read(b"0.1,0,7\n0.2,1.0,-40\n0.3,2.0,-2500\n").expect("a table");
    assert_eq!(table.names, ["1", "2", "3"]);
    let said = ["t=1", "V=2:V", "z=3:nm:-1"].map(|text| Assignment::parse(text, &table).unwrap());
    let imported = import(&table, &said, false).unwrap();
    // 2500 nm upwards at 2 V, and 7 nm downwards at rest.
    let z = imported.file.rows[2].z_um.unwrap();
    assert!((z - 2.507).abs() < 1e-12, "{z}");
    assert!(says(&imported, "z counts from its first reading at 0 V"));
    for (wrong, words) in [
        ("z", "assigns nothing"),
        ("y=3", "no quantity 'y'"),
        ("z=height", "no column 'height'"),
        ("z=3:mV", "no unit of z"),
        ("z=3:nm:up", "not a factor"),
        ("z=3:nm:nan", "not a factor"),
        ("z=3:nm:0", "not a factor"),
    ] {
        let said = Assignment::parse(wrong, &table).unwrap_err().to_string();
        assert!(said.contains(words), "{wrong}: {said}");
    }
    let nameless = import(&table, &[], false).unwrap_err().to_string();
    assert!(nameless.contains("is known to be a voltage"), "{nameless}");
}

#[test]
fn gaps_repeated_times_and_a_sign_are_noticed() {
    let text = b"t_s,V,z_um\n3,2,-40\n1,0,0\n2,1,-10\n2,1,-12\n4,,-50\n";
    let imported = guessed(text, false);
    let z: Vec<_> = imported.file.rows.iter().map(|row| row.z_um).collect();
    assert_eq!(z, [Some(0.0), Some(-11.0), Some(-40.0)]);
    for words in [
        "1 row without a time or a drive is left out",
        "order of their times",
        "share their time",
        "falls with the drive",
    ] {
        assert!(says(&imported, words), "{words}: {:?}", imported.notes);
    }
    let unsaid = guessed(b"V,z_um\n1,3\n2,9\n", false);
    assert!(says(&unsaid, "no displacement was read at 0 V") && unsaid.file.keys.is_steady());
}

#[test]
fn samples_of_a_step_are_one_reading_with_the_spread_of_their_mean() {
    let sample = |row: usize| {
        let volts = row / 16;
        // A spread of 0.1 um: half of the samples above, half below.
        let z = 10.0 * volts as f64 + if row.is_multiple_of(2) { 0.1 } else { -0.1 };
        format!("{},{volts},{z}\n", 0.1 * row as f64)
    };
    let text: String = (0..64).map(sample).collect();
    let imported = guessed(format!("t,V,z\n{text}").as_bytes(), true);
    assert_eq!(imported.file.rows.len(), 4);
    let noise_um = imported.file.keys.displacement_noise_um().unwrap();
    // 0.1 um of 16 samples, one of which the mean takes: 0.1 / sqrt(15).
    assert!(
        (noise_um / (0.1 / 15f64.sqrt()) - 1.0).abs() < 0.01,
        "{noise_um}"
    );
    assert!(imported.file.keys.is_steady());
}

#[test]
fn a_column_twice_is_asked_about() {
    let table = Table::read(b"V,voltage,z\n1,1,3\n2,2,9\n").expect("a table");
    let said = import(&table, &guesses(&table), false).unwrap_err();
    assert!(
        said.to_string()
            .contains("1 'V', 2 'voltage' would all be V_V"),
        "{said}"
    );
}

#[test]
fn an_oscilloscope_s_names_and_units_are_two_lines() {
    let text = "Time,Voltage CH1,Voltage CH2,Position,Current CH1\nus,V,mV,um,mA\n0,0,0,0,0\n200,1,2000,3,4\n";
    let imported = guessed(text.as_bytes(), false);
    let row = &imported.file.rows[1];
    assert!((row.t_s - 2e-4).abs() < 1e-15 && !imported.file.keys.is_steady());
    assert_eq!(row.voltage_v, [1.0, 2.0, 0.0, 0.0]);
    assert_eq!((row.z_um, row.current_a[0]), (Some(3.0), Some(4e-3)));
}

/// Keysight's: what is plotted has a name, and channels have numbers.
#[test]
fn channels_that_are_numbers_are_no_first_row() {
    let rows: String = (0..6)
        .map(|n| format!("{n}.0E-03,{n},{}\n", 2 * n))
        .collect();
    let table = Table::read(format!("x-axis,1,2\nsecond,Volt,Volt\n{rows}").as_bytes());
    let table = table.expect("a table");
    assert_eq!(table.rows.len(), 6, "{:?}", table.names);
    assert!(table.names[0].starts_with("x-axis") && table.names[2].starts_with('2'));
    assert_eq!(table.rows[1], [Some(1e-3), Some(1.0), Some(2.0)]);
}

#[test]
fn actuators_whose_drive_is_not_told_are_off_and_take_no_current() {
    let text = b"t (s),V1 (V),I (mA),z (um)\n0,0,0,0\n1,1,2.7,26\n2,2,5.1,90\n";
    let table = Table::read(text).expect("a table");
    let refused = import(&table, &guesses(&table), false).unwrap_err();
    let told = "through actuator 2 flow up to 5.100 mA, and no column tells what drives it";
    assert!(refused.to_string().contains(told), "{refused}");
    // Each of what the help says.
    for (said, drives_v) in [("V=2", [2.0; 4]), ("I1=3", [2.0, 0.0, 0.0, 0.0])] {
        let help = miette::Diagnostic::help(&refused).expect("what to do");
        assert!(help.to_string().contains(&format!("--column {said}")));
        let said = [Assignment::parse(said, &table).expect("a column")];
        let said = with_guesses(&said, &table);
        let imported = import(&table, &said, false).expect("a measurement");
        assert_eq!(imported.file.rows[2].voltage_v, drives_v);
        let is_told = says(&imported, "actuator 2, 3, 4: each is taken for off");
        assert_eq!(is_told, drives_v[1] == 0.0, "{:?}", imported.notes);
    }
    // What a meter reads where nothing is connected.
    let offset = guessed(b"V1,V2,I1 (mA),I3 (mA)\n0,0,0,0.02\n1,0,2.7,0.02\n", false);
    assert!(says(&offset, "actuator 3, 4: each is taken for off"));
}

#[test]
fn the_last_comment_above_a_table_has_its_names() {
    let rows = "0 0 0\n1 1 9.5\n2 2 40\n3 0 0.1\n";
    for above in ["# mirror 7\n# t_s V_V z_um\n", "# t_s V_V z_um\n"] {
        let found = guessed(format!("{above}{rows}").as_bytes(), false);
        assert_eq!(found.file.rows.len(), 4);
        assert_eq!(found.file.rows[2].z_um, Some(40.0));
    }
    // What stands below is none.
    let below = format!("{rows}# t_s V_V z_um\n");
    assert!(Table::read(below.as_bytes()).expect("a table").names[0] == "1");
}

#[test]
fn a_time_that_no_heading_names_is_asked_about() {
    let imported = guessed(b"x;V;z\n0;0;0\n1;1;3\n", false);
    assert!(says(&imported, "--column t=1:s"), "{:?}", imported.notes);
    let table = Table::read(b"V;z;z\n0;0;0\n1;1;3\n").expect("a table");
    let said = Assignment::parse("z=z", &table).unwrap_err().to_string();
    assert!(said.contains("2 columns are called 'z'"), "{said}");
    let said = [Assignment::parse("V1=1", &table).unwrap()];
    assert!(
        with_guesses(&said, &table)[1..]
            .iter()
            .all(|a| a.source > 0)
    );
}

#[test]
fn quotation_marks_thousands_and_clock_times_are_read() {
    let text = b"Time,\"Voltage, set (mV)\",\"z (nm)\"\n23:59:58.5,0,0\n23:59:59.5,\"1,000.0\",\"26,100.0\"\n00:00:00.5,\"2,000.0\",\"90,400.0\"\n";
    let table = Table::read(text).expect("a table");
    assert_eq!(table.names[1], "Voltage, set (mV)");
    assert!(table.written.contains("thousands"), "{}", table.written);
    let volts = Assignment::parse("V=2:mV", &table).expect("a column");
    let assignments = [guesses(&table), vec![volts]].concat();
    let imported = import(&table, &assignments, false).expect("a measurement");
    let t_s: Vec<_> = imported.file.rows.iter().map(|row| row.t_s).collect();
    assert_eq!(t_s, [0.0, 1.0, 2.0]);
    assert_eq!(imported.file.rows[2].z_um, Some(90.4));
    assert_eq!(imported.file.rows[1].voltage_v, [1.0; 4]);
    assert!(
        says(&imported, "times of the clock"),
        "{:?}",
        imported.notes
    );
}

/// A cell with a date that was saved without its format.
#[test]
fn a_spreadsheet_s_days_are_no_seconds() {
    let serial = |heading: &str| {
        let row = |n: u32| format!("{:.9},{}\n", 46_350.5 + f64::from(n) / 86_400.0, n % 4);
        let rows: String = (0..8).map(row).collect();
        guessed(format!("{heading},V\n{rows}").as_bytes(), false)
    };
    let days = serial("Time");
    for (n, row) in days.file.rows.iter().enumerate() {
        // Nine decimals of a day are 0.1 ms.
        assert!((row.t_s - n as f64).abs() < 1e-4, "{}", row.t_s);
    }
    assert!(
        says(&days, "taken for a spreadsheet's days"),
        "{:?}",
        days.notes
    );
    // Where the unit is stated it is that, and where readings are as far apart as on a bench, too.
    assert!((serial("Time (s)").file.rows[0].t_s - 46_350.5).abs() < 1e-9);
    let seconds = guessed(b"Time,V\n46350.5,0\n46351.5,1\n46352.5,2\n", false);
    assert_eq!(seconds.file.rows[0].t_s, 46_350.5);
}

/// Three rows a minute, whose instants are one.
#[test]
fn clocks_of_minutes_are_no_spreadsheet_s_days() {
    for hour in [9, 11, 13, 17] {
        let row = |n: u32| format!("{hour:02}:{0:02},{0},{1}\n", n / 3, 3 * n);
        let rows: String = (0..12).map(row).collect();
        let imported = guessed(format!("Time,V,z\n{rows}").as_bytes(), false);
        let t_s: Vec<_> = imported.file.rows.iter().map(|row| row.t_s).collect();
        assert_eq!(t_s, [0.0, 60.0, 120.0, 180.0]);
    }
}

/// From the evening of the fourth of March on.
#[test]
fn dates_with_slashes_are_read_as_they_are_nearest() {
    for (dates, order) in [
        (["04/03/26", "05/03/26"], "day/month/year"),
        (["03/04/26", "03/05/2026"], "month/day/year"),
        (["12/03/26", "13/03/26"], "day/month/year"),
    ] {
        let [before, after] = dates;
        let text = format!(
            "Time,V,z\n{before} 23:59:59,0,0\n{after} 00:00:00,1,26\n{after} 00:00:01,2,90\n"
        );
        let imported = guessed(text.replace("2026", "26").as_bytes(), false);
        let t_s: Vec<_> = imported.file.rows.iter().map(|row| row.t_s).collect();
        assert_eq!(t_s, [0.0, 1.0, 2.0], "{dates:?}");
        assert!(says(&imported, order), "{:?}", imported.notes);
    }
}

#[test]
fn clocks_and_durations_are_seconds_whatever_the_heading_s_unit() {
    for cells in [["0:00:00", "0:01:30"], ["PT0S", "PT1M30S"]] {
        let text = format!("Time (min),V,z\n{},0,0\n{},1,26\n", cells[0], cells[1]);
        let imported = guessed(text.as_bytes(), false);
        assert!((imported.file.rows[1].t_s - 90.0).abs() < 1e-9);
    }
}

#[test]
fn a_clock_of_twelve_hours_goes_on_at_one() {
    let imported = guessed(
        b"Time,V,z\n12:59:58,0,0\n12:59:59,1,26\n01:00:00,2,90\n01:00:01,3,160\n",
        false,
    );
    let t_s: Vec<_> = imported.file.rows.iter().map(|row| row.t_s).collect();
    assert_eq!(t_s, [0.0, 1.0, 2.0, 3.0]);
    let told = "'Time' goes on to 01:00:00 in line 4 as a clock of twelve hours";
    assert!(says(&imported, told), "{:?}", imported.notes);
}

#[test]
fn a_decimal_comma_is_not_taken_for_thousands() {
    let table = Table::read(b"V;z\n0,100;1,234\n0,200;2,345\n0,300;3,456\n").expect("a table");
    assert_eq!(table.rows[0], [Some(0.1), Some(1.234)]);
    let table = Table::read(b"V\tz\n1.000,5\t1,234\n2.000,5\t2,345\n").expect("a table");
    assert_eq!(table.rows[0], [Some(1000.5), Some(1.234)]);
}

/// A group of thousands never follows a lone 0, nor are two digits one.
#[test]
fn quoted_commas_are_decimal_where_they_are_no_thousands() {
    let three = "\"0,000\",\"0,000\",\"0,000\"\n\"1,000\",\"1,000\",\"18,112\"\n";
    let two = "\"0,0\",\"0,0\",\"0,00\"\n\"1,0\",\"1,0\",\"18,112\"\n";
    let mixed = "0,\"0,00\",\"0,000\"\n1,\"1,00\",\"18,112\"\n";
    for rows in [three, two, mixed] {
        let imported = guessed(format!("t (s),V (V),z (um)\n{rows}").as_bytes(), false);
        let row = &imported.file.rows[1];
        let read = (
            imported.file.rows.len(),
            row.t_s,
            row.voltage_v[0],
            row.z_um,
        );
        assert_eq!(read, (2, 1.0, 1.0, Some(18.112)), "{rows}");
    }
    let thousands = b"V (mV),z (nm)\n0,0\n500,\"4,890\"\n\"1,000\",\"18,112\"\n";
    let imported = guessed(thousands, false);
    assert!((imported.file.rows[2].z_um.unwrap() - 18.112).abs() < 1e-9);
    assert!(says(&imported, "as nothing in it tells decimals"));
}

/// What stands where the file's other numbers have no decimal sign separates thousands, in either writing.
#[test]
fn thousands_beside_decimals_of_the_other_sign() {
    for text in [
        "Spannung [V];Strom [mA];Hub [nm]\n0,00;0,000;0\n0,21;0,594;954\n0,43;1,179;3.789\n",
        "Voltage [V];Current [mA];z [nm]\n0.00;0.000;0\n0.21;0.594;954\n0.43;1.179;3,789\n",
    ] {
        let imported = guessed(text.as_bytes(), false);
        for (row, z_um) in imported.file.rows.iter().zip([0.0, 0.954, 3.789]) {
            assert!((row.z_um.expect("a reading") - z_um).abs() < 1e-9);
        }
        let told = "789 in line 4 is read as thousands, 3789";
        assert!(says(&imported, told), "{:?}", imported.notes);
    }
}

#[test]
fn a_column_of_the_other_decimal_sign_is_read_by_it() {
    let imported = guessed(
        b"V;I (mA);z\n0,0;0,0;0\n0,2;0,594;0.954\n0,4;1,179;3.789\n",
        false,
    );
    let z: Vec<_> = imported.file.rows.iter().map(|row| row.z_um).collect();
    assert_eq!(z, [Some(0.0), Some(0.954), Some(3.789)]);
    let told = "'z' has decimal points, unlike the other columns";
    assert!(says(&imported, told), "{:?}", imported.notes);
}

#[test]
fn what_may_be_thousands_or_decimals_is_told() {
    for text in [
        "V;z\n0;0\n1;3.789\n2;9.541\n",
        "V;z\n0;0\n1;3,789\n2;9,541\n",
    ] {
        let imported = guessed(text.as_bytes(), false);
        assert_eq!(imported.file.rows[1].z_um, Some(3.789));
        let told = "in line 3 is read as 3.789, and may be 3789";
        assert!(says(&imported, told), "{:?}", imported.notes);
    }
    let certain = guessed(b"V;z\n0;0\n1;3,789\n2;0,541\n", false);
    assert!(!says(&certain, "may be"), "{:?}", certain.notes);
}

#[test]
fn cells_that_are_no_numbers_are_told_by_column_and_line() {
    let text = b"V;z\n0,5;1,5\n\n1,0;OVER\n1,5;12.5\n2,0;---\n2,5;\n3,0;NaN\n";
    let imported = guessed(text, false);
    let told = "2 cells of 'z' have no number that can be read, and count as missing: 'OVER' in line 4 is the first";
    assert!(says(&imported, told), "{:?}", imported.notes);
}

#[test]
fn units_and_uncertainties_in_cells_are_read() {
    let z = |imported: &Imported| -> Vec<_> {
        let rows = imported.file.rows.iter();
        rows.map(|row| row.z_um.unwrap_or(f64::NAN)).collect()
    };
    let units = guessed(
        b"V (V),I (mA),z (um)\n0,0,0.0 um\n1,2.6,17.2 um\n2,4.7,70400 nm\n",
        false,
    );
    assert!((z(&units)[2] - 70.4).abs() < 1e-9 && z(&units)[1] == 17.2);
    assert!(
        says(&units, "1 cell of 'z (um)' is in another unit"),
        "{:?}",
        units.notes
    );
    // Where no cell is a number alone, and no heading has a unit.
    let all = guessed(b"U;Hub\n0 mV;0 nm\n1000 mV;17200 nm\n", false);
    assert_eq!(all.file.rows[1].voltage_v, [1.0; 4]);
    assert!((z(&all)[1] - 17.2).abs() < 1e-9);
    let text = "V (V),z (um)\n0,~0.0\n1,17.2±0.1\n2,70.4±0.1\n";
    let about = guessed(text.as_bytes(), false);
    assert_eq!(z(&about), [0.0, 17.2, 70.4]);
    assert!(
        says(&about, "3 cells of 'z (um)' like ~0.0 in line 2"),
        "{:?}",
        about.notes
    );
    let other = guessed(b"V (V),z (um)\n0,0\n1,17 mV\n2,70\n", false);
    assert!(says(&other, "'17 mV' in line 3"), "{:?}", other.notes);
    let fortran = guessed(b"V (V);z (m)\n0,00;0,0000D+00\n0,21;9,5425D-07\n", false);
    assert!((z(&fortran)[1] - 0.95425).abs() < 1e-9);
}

#[test]
fn a_row_with_a_number_too_many_is_left_out() {
    let text = b"V (V),I (mA),z (um)\n0,0,0.0\n1,2.6,17,2\n2,4.7,70.4,,\n3,6.1,137\n";
    let imported = guessed(text, false);
    assert_eq!(imported.file.rows.len(), 3);
    let told = "1 row with more numbers than columns is left out, as line 3 with 4 cells for 3";
    assert!(says(&imported, told), "{:?}", imported.notes);
    assert!(!says(&imported, "without a time"), "{:?}", imported.notes);
}

#[test]
fn a_temperature_that_follows_the_drive_is_no_room_s() {
    let rows = "0,0,22,71.6\n1,26,40,71.6\n2,90,94,71.6\n3,160,184,71.6\n";
    let ambient = |imported: &Imported| imported.file.rows[3].ambient_c;
    let both = guessed(
        format!("V,z,Temp (degC),Room T (°F)\n{rows}").as_bytes(),
        false,
    );
    assert!((ambient(&both).expect("the room's") - 22.0).abs() < 1e-9);
    let text = format!("V,z,Temp (degC),Note\n{rows}");
    let heater = guessed(text.as_bytes(), false);
    assert_eq!(ambient(&heater), None);
    assert!(
        says(&heater, "follows the drive, by 162.0 K"),
        "{:?}",
        heater.notes
    );
    // What a user calls the room is one.
    let table = Table::read(text.as_bytes()).expect("a table");
    let said = [Assignment::parse("T_ambient=3", &table).expect("a column")];
    let said = with_guesses(&said, &table);
    let imported = import(&table, &said, false).expect("a measurement");
    assert_eq!(ambient(&imported), Some(184.0));
}

#[test]
fn channels_may_count_from_0() {
    let text = b"V0 (V),V1 (V),V2 (V),V3 (V),z (um)\n0,0,0,0,0\n1,2,3,3.5,70\n";
    let imported = guessed(text, false);
    assert_eq!(imported.file.rows[1].voltage_v, [1.0, 2.0, 3.0, 3.5]);
}

#[test]
fn a_drive_that_was_read_off_is_settled_at_its_holds() {
    let sample = |row: usize| {
        let volts = row / 50;
        // A jitter that repeats after 7 rows.
        let jitter = 1e-3 * [0.0, 1.7, -1.1, 0.6, -1.9, 1.2, -0.4][row % 7];
        format!(
            "{},{},{}\n",
            0.1 * row as f64,
            volts as f64 + jitter,
            10 * volts
        )
    };
    let text: String = (0..200).map(sample).collect();
    let imported = guessed(format!("t,V,z\n{text}").as_bytes(), true);
    assert_eq!(imported.file.rows.len(), 4);
    assert!(says(&imported, "jitters"), "{:?}", imported.notes);
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        if let Ok(table) = Table::read(&bytes) {
            let _ = import(&table, &guesses(&table), true);
        }
    }

    #[test]
    fn a_table_is_read_whatever_its_style(
        rows in prop::collection::vec((0.0..9.0_f64, -5.0..300.0_f64), 4..40),
        style in prop::sample::select(&[(',', false), (';', true), (';', false), ('\t', true), ('\t', false)][..]),
    ) {
        let (delimiter, comma) = style;
        let number = |x: f64| {
            let text = format!("{x:.3}");
            if comma { text.replace('.', ",") } else { text }
        };
        let text: String = rows.iter().map(|(v, z)| format!("{}{delimiter}{}\n", number(*v), number(*z))).collect();
        let table = Table::read(format!("V{delimiter}z\n{text}").as_bytes()).unwrap();
        prop_assert_eq!(&table.names, &["V", "z"]);
        for ((v, z), row) in rows.iter().zip(&table.rows) {
            // Three decimals were written.
            prop_assert!((row[0].unwrap() - v).abs() < 1e-3 && (row[1].unwrap() - z).abs() < 1e-3);
        }
    }
}

#[test]
fn the_keys_of_a_measurement_file_are_kept_where_they_hold() {
    let keys = "# experiment=sweep\n# noise_z_nm=20\n# session=now\n# drive=ramp\n# gain=3\n";
    let rows = "0,0,0\n1,1,26\n2,1,27\n3,2,90\n";
    let text = format!("{keys}t_s,V_V,z_um\n{rows}");
    let made = guessed(text.as_bytes(), false);
    let own = MeasurementFile::parse("own.csv", &text).expect("readable");
    assert_eq!(made.file.keys, own.keys);
    // As a spreadsheet saves it.
    let saved = keys.replace('\n', ",,\n") + &text[keys.len()..];
    assert_eq!(guessed(saved.as_bytes(), false).file.keys, own.keys);
    // Of means and of other units the noise is another one.
    let settled = guessed(text.as_bytes(), true);
    assert!(
        says(&settled, "noise_z_nm=20 is left out"),
        "{:?}",
        settled.notes
    );
    assert!(
        says(&settled, "drive=ramp is left out"),
        "{:?}",
        settled.notes
    );
    assert_eq!(settled.file.keys.get("session"), Some("now"));
    let single = guessed(text.replace("2,1,27\n", "").as_bytes(), true);
    assert_eq!(single.file.keys.get("noise_z_nm"), Some("20"));
    let table = Table::read(text.as_bytes()).expect("a table");
    let said = [Assignment::parse("z=z_um:nm", &table).expect("a unit")];
    let scaled = import(&table, &with_guesses(&said, &table), false);
    assert_eq!(
        scaled.expect("a measurement").file.keys.get("noise_z_nm"),
        None
    );
    // Elsewhere they may mean anything; one that no measurement file can have is left out.
    let other = text.replace("z_um", "height (um)");
    assert!(
        guessed(other.as_bytes(), false)
            .file
            .keys
            .iter()
            .next()
            .is_none()
    );
    let wrong = guessed(text.replace("nm=20", "nm=low").as_bytes(), false);
    assert!(says(
        &wrong,
        "line 2 is left out: noise_z_nm must be a number"
    ));
}

/// The first rows lack what the last ones have, or most lack it.
#[test]
fn rows_may_end_before_their_last_cells() {
    for rows in [
        "0,0,0\n1,0.5,1.4\n2,1,2.6,18\n3,2,4.7,62\n4,2.5,5.5,90\n",
        "0,0,0\n1,0.5,1.4\n2,1,2.6,18\n3,2,4.7\n4,2.5,5.5\n",
    ] {
        let imported = guessed(
            format!("t (s),V (V),I (mA),z (um)\n{rows}").as_bytes(),
            false,
        );
        let read = &imported.file.rows;
        assert_eq!((read.len(), read[0].t_s, read[0].z_um), (5, 0.0, None));
        assert_eq!(read[2].z_um, Some(18.0), "{rows}");
    }
}

/// Numbers alone above a table's headings are none of its rows.
#[test]
fn numbers_above_headings_are_no_rows() {
    let imported = guessed(b"7,8\nt (s),V (V),z (um)\n0,0,0\n1,1,18\n2,2,62\n", false);
    assert_eq!(imported.file.rows.len(), 3);
}

#[test]
fn blanks_may_separate_thousands() {
    let imported = guessed(
        b"V (mV);z (nm)\n0;0\n500;4 890\n1 000;18 112\n2 000;62 052\n",
        false,
    );
    let z: Vec<f64> = imported
        .file
        .rows
        .iter()
        .filter_map(|row| row.z_um)
        .collect();
    assert!((z[2] - 18.112).abs() < 1e-9 && z.len() == 4, "{z:?}");
}
