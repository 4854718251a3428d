use super::*;
use proptest::prelude::*;

fn sampled(text: &str) -> Result<Sampled, String> {
    let (rows, is_tilted) = parse(text)?;
    sample(&rows, is_tilted, 10_000).map_err(str::to_owned)
}

#[test]
fn a_spreadsheet_may_quote_and_indent() {
    let plain = parse("t_s,z_um\n0,1\n0.5,2\n").expect("a table");
    assert_eq!(
        parse("\"t_s\",\"z_um\"\n\"0\",\"1\"\n0.5,2\n").as_ref(),
        Ok(&plain)
    );
    assert_eq!(
        parse("  t_s , z_um \r\n 0 , 1\r\n 0.5,2 \n").as_ref(),
        Ok(&plain)
    );
}

#[test]
fn semicolons_leave_commas_for_decimals() {
    let plain = parse("t_s,z_um\n0,1.5\n0.5,2\n").expect("a table");
    let german = parse("t_s;z_um\n0;1,5\n0,5;2\n");
    assert_eq!(german.as_ref(), Ok(&plain));
}

#[test]
fn a_step_that_makes_it_another_course_is_told_by_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("w.csv");
    let read = |text: &str| {
        std::fs::write(&path, text).expect("written");
        super::read(&path, 10_000).map_err(|error| error.to_string())
    };
    let text = "t_s,z_um\n# a jump\n0,50\n0.5,120\n0.5001,20\n1,20\n2,150\n";
    let said = read(text).expect_err("another course");
    for words in [
        "line 5 comes 0.0001 s after",
        "equal steps of time, of 0.004 s here at least",
    ] {
        assert!(said.contains(words), "{said}");
    }
    // As its help says.
    let met = read(&text.replace("0.5001", "0.504")).expect("a waveform");
    assert!(met.missed.0 < 1e-6, "{met:?}");
    // A scatter below what a board resolves is no course.
    assert!(read("0,50\n0.5,50.001\n0.5001,50\n2,50\n").is_ok());
}

#[test]
fn a_table_that_is_no_waveform_is_told_why() {
    for (text, reason) in [
        ("", "fewer than two points"),
        ("t_s,z_um\n0,1\n", "fewer than two points"),
        ("0,1\n1\n", "line 2, `1`: it has 1 cells, and 2 are needed"),
        ("1,1\n0,2\n", "line 2 goes back in time, from 1 s to 0 s"),
        (
            "0,1\n0.5,1\n0.5,2\n",
            "line 3 has the time of the line before, 0.5 s",
        ),
        ("0,1\n1,nan\n", "line 2, `1,nan`: `nan` is no finite number"),
        ("0,1\n1,1e999\n", "`1e999` is no finite number"),
        (
            "t_s,z_um,tip_deg,tilt_deg\n0,1,0,0\n1,1,,0\n",
            "line 3, `1,1,,0`: a cell is empty",
        ),
        ("0,1,0,0\n1,1,0,0\n", "it has 4 cells, and 2 are needed"),
        (
            "t_s,z_um,roll\n0,1,0\n",
            "there is no column `roll`; there are t_s, z_um, tilt_x_deg",
        ),
        (
            "t_s,z_um,tip_deg,tilt_x_deg\n",
            "`tilt_x_deg` says what another one says",
        ),
        ("t_s,tip_deg\n0,1\n", "it has no column `z_um`"),
        ("0,1\n1e-6,2\n", "shorter than a control tick"),
    ] {
        let said = sampled(text).expect_err("unusable");
        assert!(said.contains(reason), "{said}");
    }
}

#[test]
fn columns_are_known_by_their_names_in_any_order() {
    let text = "# mine\ntilt_deg,z_um,t_s,tip_deg\n0.1,60,0,-0.2\n0.3,80,0.0002,-0.4\n";
    let found = sampled(text).expect("a waveform");
    let [tip, tilt] = found.tilts_deg.expect("tilts");
    assert_eq!(
        (found.z_um, tip, tilt),
        (
            vec![60.0, 70.0, 80.0],
            vec![-0.2, -0.30000000000000004, -0.4],
            vec![0.1, 0.2, 0.3]
        )
    );
    assert_eq!(found.dwell_ticks, 1);
}

#[test]
fn corners_lie_on_points_where_they_can() {
    let found = sampled("0,40\n0.5,60\n1,40\n").expect("a waveform");
    assert!(found.missed.0 < 1e-6, "{found:?}");
    assert!(found.z_um.len() > 80, "{}", found.z_um.len());
}

/// Twenty sines in 3 s and a row at every tick and a half: 59 ticks are the densest, and 60 meet the length.
#[test]
fn a_length_is_met_where_it_can_be_and_told_where_not() {
    let sines = |last: u32| {
        let at =
            |i: u32| 80.0 + 20.0 * (f64::from(i) * 20.0 * std::f64::consts::TAU / 20_000.0).sin();
        let rows = (0..=last).map(|i| format!("{},{}\n", f64::from(i) * 1.5e-4, at(i)));
        sampled(&rows.collect::<String>()).expect("a waveform")
    };
    let met = sines(20_000);
    assert_eq!((met.dwell_ticks, met.z_um.len()), (60, 501));
    assert!(!met.takes_another_time());
    // A prime number of ticks.
    let not_met = sampled("0,80\n3.0011,80\n").expect("a waveform");
    assert!(not_met.takes_another_time(), "{}", not_met.played_ticks());
    let long = sampled("0,80\n361000,81\n").expect_err("101 h");
    assert!(long.contains("longer than 100 h"), "{long}");
}

#[test]
fn what_a_board_has_no_room_for_is_told_by_how_far_it_is_missed() {
    // Every other of 400 rows is at the top; 170 points cannot be.
    let rows = (0..400).map(|i| format!("{},{},0\n", f64::from(i) * 0.01, 10 * (i % 2)));
    let found = sampled(&format!("t_s,z_um,tip_deg\n{}", rows.collect::<String>()));
    assert!(found.expect("a waveform").missed.0 > 1.0);
}

proptest! {
    #[test]
    fn a_waveform_keeps_its_ends_and_its_length(
        z in proptest::collection::vec(0.0_f64..170.0, 2..700), step_s in 1e-3_f64..1.0,
    ) {
        let text: String = z
            .iter()
            .enumerate()
            .map(|(i, z)| format!("{:?},{z:?}\n", i as f64 * step_s))
            .collect();
        let Sampled { z_um, dwell_ticks, .. } = sampled(&text).expect("a waveform");
        prop_assert!(z_um.len() <= POINTS);
        prop_assert!((z_um[0] - z[0]).abs() < 1e-9);
        prop_assert!((z_um[z_um.len() - 1] - z[z.len() - 1]).abs() < 1e-9);
        let asked = (z.len() - 1) as f64 * step_s * 1e4;
        let played = (z_um.len() - 1) as f64 * f64::from(dwell_ticks);
        prop_assert!((played - asked).abs() <= f64::from(dwell_ticks), "{played} for {asked}");
    }

    #[test]
    fn any_text_is_a_waveform_or_a_sentence(text in "[0-9a-z,.\\n# _-]{0,60}") {
        if let Ok(found) = sampled(&text) {
            prop_assert!(found.z_um.iter().all(|z| z.is_finite()));
        }
    }
}
