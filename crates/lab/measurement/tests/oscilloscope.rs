//! Tables as oscilloscopes write them.

use measurement::import::{Assignment, Imported, Table, import, with_guesses};
use proptest::prelude::*;

fn with(table: &Table, said: &[&str]) -> Imported {
    let said: Vec<Assignment> = said
        .iter()
        .map(|text| Assignment::parse(text, table).expect(text))
        .collect();
    let all = with_guesses(&said, table);
    import(table, &all, false).expect("a measurement")
}

/// TDS1000 and TDS2000: labels stand beside the first samples, and nothing beside the others.
#[test]
fn samples_beside_labels_are_read() {
    let labels = [
        "Record Length,2.5e+03",
        "Sample Interval,1e-06",
        "Trigger Point,1.25e+03",
        ",",
        "Source,CH1",
        "Vertical Units,V",
        "Horizontal Units,s",
        "Pt Fmt,Y",
        "Firmware Version,FV:v22.01",
    ];
    // Some end their lines with a comma.
    for end in ["", ","] {
        let row = |n: usize| {
            let label = labels.get(n).unwrap_or(&",");
            format!(
                "{label},,{:.9},{}{end}\n",
                -0.0012 + 1e-6 * n as f64,
                n / 10
            )
        };
        let text: String = (0..40).map(row).collect();
        let table = Table::read(text.as_bytes()).expect("a table");
        assert_eq!(table.names[3..5], ["Time (s)", "CH1 (V)"]);
        let rows = with(&table, &["V=CH1"]).file.rows;
        assert_eq!(rows.len(), 40);
        assert_eq!((rows[0].t_s, rows[39].voltage_v), (-0.0012, [3.0; 4]));
    }
}

/// A spectrum's samples are over frequency.
#[test]
fn a_spectrum_has_no_times() {
    let row = |n: usize| format!(",,,{n},{n}\n");
    let rows: String = (0..9).map(row).collect();
    let text = format!(
        "Record Length,1024,,0,0\nSample Interval,1,,0,0\nHorizontal Units,Hz,,0,0\n{rows}"
    );
    assert_eq!(Table::read(text.as_bytes()).expect("a table").names[3], "4");
}

/// MSO5000 writes no column of the samples' numbers.
#[test]
fn rows_are_counted_where_no_column_counts_them() {
    let text = "CH1V,CH2V,t0 =-0.0012, tInc = 2e-06,\n0,5.0,,\n1,5.5,,\n2,6.0,,\n";
    let table = Table::read(text.as_bytes()).expect("a table");
    assert_eq!(table.names, ["CH1V", "CH2V", "Time (s)"]);
    assert!(
        table.written.contains("from -0.0012 s on every 2e-6 s"),
        "{}",
        table.written
    );
    let rows = with(&table, &["V1=1", "V2=2"]).file.rows;
    assert_eq!(rows[2].voltage_v, [2.0, 6.0, 0.0, 0.0]);
    assert!((rows[2].t_s + 0.001_196).abs() < 1e-12, "{}", rows[2].t_s);
}

/// The names are those of columns whose numbers go on below.
#[test]
fn a_start_and_an_increment_may_be_measured() {
    let text = "Start,Increment,V\n1,2,0\n2,3,1\n3,4,2\n";
    let table = Table::read(text.as_bytes()).expect("a table");
    assert_eq!((table.names.len(), table.rows.len()), (3, 3));
}

/// Of names and units, whatever remarks stand between and below, in comments or not.
#[test]
fn remarks_do_not_end_a_header() {
    let rows = "0,0,0\n1,1,9.5\n2,2,40\n";
    for above in [
        "Time,Voltage,Position\nms,mV,nm\n# by Jo, at night, alone\n",
        "Time,Voltage,Position\nms,mV,nm\nby Jo\n",
        "Time,Voltage,Position\n # by Jo\nms,mV,nm\n  # at night\n",
        "# Time,Voltage,Position\n# ms,mV,nm\n# by Jo\n",
        "# Time,Voltage,Position\n# ms,mV,nm\n# by Jo, at night, alone\n",
    ] {
        let table = Table::read(format!("{above}{rows}").as_bytes()).expect("a table");
        let names = ["Time (ms)", "Voltage (mV)", "Position (nm)"];
        assert_eq!(table.names, names, "{above}");
        assert_eq!(table.rows.len(), 3);
    }
}

proptest! {
    /// DS1000Z: lines of the header are longer than those of samples, by one cell or three.
    #[test]
    fn samples_are_at_start_and_increment_times_their_number(
        start_us in -5000_i32..5000,
        increment_ns in 1_u32..100_000,
        first in 0_usize..100,
        channels in 1_usize..=4,
        is_in_one_line in any::<bool>(),
        (header_end, row_end) in prop::sample::select(&[("", ",,"), (",", ","), ("", ","), (",", "")][..]),
    ) {
        let (start_s, increment_s) = (1e-6 * f64::from(start_us), 1e-9 * f64::from(increment_ns));
        let each = |of: &dyn Fn(usize) -> String| (1..=channels).map(of).collect::<String>();
        let names = each(&|channel| format!(",CH{channel}"));
        let header = match is_in_one_line {
            true => format!("X{names},t0 ={start_s:e}, tInc = {increment_s:e}{header_end}\n"),
            false => format!(
                "X{names},Start,Increment{header_end}\nSequence{},{start_s:e},{increment_s:e}\n",
                ",Volt".repeat(channels)
            ),
        };
        let numbers = first..first + 20;
        let row = |n: usize| format!("{n}{}{row_end}\n", each(&|channel| format!(",{}e-01", n * channel)));
        let text: String = numbers.clone().map(row).collect();
        let table = Table::read((header + &text).as_bytes()).expect("a table");
        prop_assert_eq!(table.names.len(), 1 + channels);
        let imported = with(&table, &["V1=CH1"]);
        prop_assert_eq!(imported.file.rows.len(), 20);
        for (n, row) in numbers.zip(&imported.file.rows) {
            let t_s = start_s + increment_s * n as f64;
            prop_assert!((row.t_s - t_s).abs() < 1e-9 * increment_s.max(t_s.abs()), "{} {}", row.t_s, t_s);
            prop_assert!((row.voltage_v[0] - 0.1 * n as f64).abs() < 1e-9);
        }
    }
}

/// Tektronix's newer ones, of two channels: what stands beside their labels is as wide as the samples.
#[test]
fn labels_above_samples_are_no_readings() {
    let labels = "Model,MSO24\nVertical Units,V,V\nVertical Offset,0,0\nVertical Scale,0.5,20\n,,\nLabel,,\n";
    let text = format!("{labels}TIME,CH1,CH2\n-1e-3,0,0\n0,2,0\n1e-3,2,1.2\n2e-3,2,2.1\n");
    let table = Table::read(text.as_bytes()).expect("a table");
    assert_eq!(table.names, ["TIME", "CH1 (V)", "CH2 (V)"]);
    let rows = with(&table, &["V=2", "z=3:um:20"]).file.rows;
    assert_eq!(
        (rows.len(), rows[3].t_s, rows[3].z_um),
        (4, 2e-3, Some(42.0))
    );
}

/// A file of LabVIEW, in which nothing is beneath the last heading.
#[test]
fn a_heading_without_cells_beneath_it_is_one() {
    let heads = "Separator\tTab\nSamples\t3\t3\t\nDate\t2026/03/04\t2026/03/04\nTime\t14:02:11.1\t14:02:11.1\t\n\
                 Y_Unit_Label\tVolts\tMicrometers\t\nX0\t0.0\t0.0\t\nDelta_X\t1.0\t1.0\t\n";
    let row = |n: usize| format!("{n}.0\t{n}.5\t{}.5\n", 18 * n);
    let rows: String = (0..9).map(row).collect();
    let text = format!("{heads}Time\tVoltage\tWeg\tComment\n{rows}");
    let table = Table::read(text.as_bytes()).expect("a table");
    assert_eq!(table.names[2..], ["Weg (Micrometers)", "Comment"]);
    assert_eq!(with(&table, &[]).file.rows[8].z_um, Some(144.5));
}
