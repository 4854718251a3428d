use super::*;

fn session(text: &str) -> Session {
    Session {
        files: vec![(
            "a.csv".into(),
            MeasurementFile::parse("a.csv", text).unwrap(),
        )],
    }
}

#[test]
fn rests_and_preholds_are_driven_before_the_rows() {
    let data = Dataset::new(&session(
        "# prehold_V=1\n# prehold_s=5\nt_global_s,t_s,V_V,z_um\n11,1,2,60\n13,2,0.5,1\n",
    ));
    let drives: Vec<_> = data
        .intervals
        .iter()
        .map(|i| (i.duration_s, i.to_v[0]))
        .collect();
    assert_eq!(
        drives,
        [(5.0, 0.0), (5.0, 1.0), (1.0, 2.0), (1.0, 0.0), (1.0, 0.5)]
    );
    assert_eq!(data.observations[1].interval, 4);
}

#[test]
fn a_sine_runs_straight_from_row_to_row() {
    let data = Dataset::new(&session(
        "# drive=sin\n# prehold_V=1\n# prehold_s=5\nt_s,V_V,z_um\n0.1,1.1,1\n0.2,1.2,2\n",
    ));
    let last = data.intervals.last().unwrap();
    assert_eq!((last.from_v[0], last.to_v[0]), (1.1, 1.2));
}

/// What a sweep at 22 degrees leaves of one at 60, beside a fitted zero, where a sensor says that much more in the oven.
fn left_in_the_oven(session_key: &str, offset_um: f64) -> Vec<f64> {
    let room = "# session=a\nt_global_s,t_s,V_V,z_um,T_ambient_C\n1,1,0,0,22\n2,2,1,26,22\n";
    let (zero, driven) = (66.0 + offset_um, 92.0 + offset_um);
    let oven = format!(
        "# session={session_key}\nt_global_s,t_s,V_V,z_um,T_ambient_C\n11,1,0,{zero},60\n12,2,1,{driven},60\n"
    );
    let file = |text: &str| {
        (
            String::new(),
            MeasurementFile::parse("a.csv", text).unwrap(),
        )
    };
    let data = Dataset::new(&Session {
        files: vec![file(room), file(&oven)],
    });
    assert_eq!(data.first_ambient_c, Some(22.0));
    assert_eq!(data.intervals.last().unwrap().ambient_k, 38.0);
    let outputs = data.intervals.iter().map(|interval| Output {
        z_um: 26.0 * interval.to_v[0].powi(2) + 1.7 * interval.ambient_k,
        ..Output::default()
    });
    let read = data.read(&outputs.collect::<Vec<_>>());
    let values = data.values().into_iter().zip(read);
    values.map(|(z, read)| z - read).collect()
}

#[test]
fn an_oven_s_expansion_counts_where_the_clock_is_the_session_s_and_elsewhere_the_zero_is_free() {
    let same = |a: Vec<f64>, b: [f64; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(same(left_in_the_oven("a", 0.0), [0.0, 0.0, 1.4, 1.4]));
    assert!(same(left_in_the_oven("a", 5.0), [0.0, 0.0, 6.4, 6.4]));
    assert!(same(left_in_the_oven("b", 0.0), [0.0; 4]));
    assert!(same(left_in_the_oven("b", -66.0), [0.0; 4]));
}

#[test]
fn a_room_that_stays_as_it_is_changes_nothing() {
    let plain = "t_s,V_V,z_um\n1,0,0\n2,1,26\n3,0,0\n";
    let told = "t_s,V_V,z_um,T_ambient_C\n1,0,0,22.1\n2,1,26,\n3,0,0,21.9\n";
    let [plain, told] = [plain, told].map(|text| Dataset::new(&session(text)));
    assert_eq!(plain.intervals, told.intervals);
    assert_eq!((plain.own_zeros.len(), told.own_zeros.len()), (0, 0));
}

#[test]
fn files_that_overlap_follow_one_another() {
    let file = |t: f64| {
        let text = format!("t_global_s,t_s,V_V,z_um\n{t},1,0,0\n{},6,1,26\n", t + 5.0);
        (
            String::new(),
            MeasurementFile::parse("a.csv", &text).unwrap(),
        )
    };
    let files = vec![file(2.0), file(3.0), file(20.0)];
    let data = Dataset::new(&Session { files });
    let ends: Vec<f64> = data
        .intervals
        .iter()
        .scan(0.0, |t, interval| {
            *t += interval.duration_s;
            Some(*t)
        })
        .collect();
    // 60 s between the first two; the third is on the clock of the second.
    assert!(
        (ends.last().unwrap() - (7.0 + 60.0 + 6.0 + 17.0)).abs() < 1e-9,
        "{ends:?}"
    );
}

#[test]
fn a_rounded_clock_makes_no_pauses_and_a_pause_is_one() {
    // Exact times since the experiment's start, on a clock that is written to hundredths of a second; then 0.5 s at 0 V.
    let text = "t_global_s,t_s,V_V,z_um\n1.00,1.0042,1,20\n1.01,1.0084,1,21\n1.02,1.0126,1,22\n1.52,1.0168,1,22\n";
    let data = Dataset::new(&session(text));
    let held: Vec<_> = data.intervals.iter().map(|i| i.to_v[0]).collect();
    assert_eq!(held, [1.0, 1.0, 1.0, 0.0, 1.0]);
    assert!((data.lasts_s() - (1.0168 + 0.4958)).abs() < 1e-9);
}

#[test]
fn dense_files_keep_their_steps() {
    let rows: Vec<_> = (0..100_000)
        .map(|i| Row {
            t_s: f64::from(i) * 1e-3,
            voltage_v: [f64::from(i / 20_000); 4],
            z_um: Some(0.0),
            ..Row::default()
        })
        .collect();
    let file = MeasurementFile {
        rows,
        ..MeasurementFile::default()
    };
    let data = Dataset::new(&Session {
        files: vec![("dense".into(), file)],
    });
    assert!(
        data.observations.len() < 2000,
        "{}",
        data.observations.len()
    );
    for step in 1..5 {
        let after = f64::from(step) * 20.0;
        // Two of its rows.
        assert!(
            data.observations
                .iter()
                .any(|o| (o.t_s - after).abs() < 2e-3),
            "the step at {after} s is gone"
        );
    }
}

#[test]
fn a_thinned_session_is_the_same_to_a_fit_and_is_thinned_once() {
    for drive in ["step", "sin"] {
        let mut text = format!("# drive={drive}\nt_s,V_V,z_um\n");
        for row in 0..20_000 {
            let t_s = 1e-3 * f64::from(row);
            let volts = if (row / 5000) % 2 == 0 { 1.0 } else { 2.0 };
            text += &format!("{t_s},{volts},{}\n", 20.0 * volts);
        }
        let all = session(&text);
        let less = thinned(&all).session.into_owned();
        let [of_all, of_less] = [&all, &less].map(Dataset::new);
        assert!(less.files[0].1.rows.len() <= thin::DENSE_ROWS, "{drive}");
        assert_eq!(of_all.intervals, of_less.intervals, "{drive}");
        assert_eq!(of_all.values(), of_less.values());
        assert_eq!(of_all.thinned_rows, 20_000 - less.files[0].1.rows.len());
        assert_eq!(of_less.thinned_rows, 0);
        let noises = |data: &Dataset| {
            data.observations
                .iter()
                .map(|o| o.noise)
                .collect::<Vec<_>>()
        };
        assert_eq!(noises(&of_all), noises(&of_less));
    }
}

/// A million rows of stairs up and down with a displacement, their drive read off a meter that jitters so.
fn stairs(jitter_v: f64) -> Session {
    let mut state = 1u64;
    let mut uniform = || {
        // Knuth's MMIX generator.
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let rows = (0..1_000_000).map(|index| {
        let volts = f64::from([0, 1, 2, 3, 2, 1, 0, 2][index / 125_000]);
        Row {
            t_s: 1e-4 * index as f64,
            // Uniform numbers have a standard deviation of 1 / sqrt(12).
            voltage_v: [volts + jitter_v * 12f64.sqrt() * uniform(); ACTUATORS],
            z_um: Some(20.0 * volts * volts + 0.07 * uniform()),
            ..Row::default()
        }
    });
    let file = MeasurementFile {
        rows: rows.collect(),
        ..MeasurementFile::default()
    };
    Session {
        files: vec![("stairs.csv".into(), file)],
    }
}

#[test]
fn a_drive_that_jitters_is_thinned_as_a_clean_one() {
    let [clean, jitters] = [0.0, 5e-3].map(|jitter_v| Dataset::new(&stairs(jitter_v)));
    assert_eq!(
        clean.notes.len() + 1,
        jitters.notes.len(),
        "{:?}",
        jitters.notes
    );
    assert!(
        jitters.notes[0].contains("jitters by 5."),
        "{}",
        jitters.notes[0]
    );
    assert!(
        clean.observations.len() < 2000,
        "{}",
        clean.observations.len()
    );
    assert_eq!(clean.observations.len(), jitters.observations.len());
    for (a, b) in clean.intervals.iter().zip(&jitters.intervals) {
        assert_eq!(a.duration_s, b.duration_s);
        // 5 mV over the root of 125 000, six times.
        assert!((a.to_v[0] - b.to_v[0]).abs() < 1e-4);
    }
}

#[test]
fn dense_settled_readings_are_means_of_their_drives() {
    let rows = (0..60_000).map(|index| Row {
        voltage_v: [0.1 * (index % 30) as f64; ACTUATORS],
        z_um: Some((index % 30) as f64 + if index % 60 < 30 { 0.3 } else { -0.3 }),
        ..Row::default()
    });
    let mut file = MeasurementFile {
        rows: rows.collect(),
        ..MeasurementFile::default()
    };
    file.rows
        .sort_by(|a, b| a.voltage_v[0].total_cmp(&b.voltage_v[0]));
    file.keys.set("steady", "yes");
    let data = Dataset::new(&Session {
        files: vec![("steady.csv".into(), file)],
    });
    assert_eq!(data.observations.len(), 30);
    assert!((data.observations[7].value - 7.0).abs() < 1e-9);
    assert!(data.notes[0].contains("of 60000 rows"), "{:?}", data.notes);
}

#[test]
fn a_drive_that_moves_all_the_time_keeps_its_course() {
    let sine = |index: usize| 2.0 + (1e-4 * index as f64 * std::f64::consts::TAU * 50.0).sin();
    let ramp = |index: usize| 1e-5 * index as f64;
    for (drive, is_whole) in [(&sine as &dyn Fn(usize) -> f64, false), (&ramp, true)] {
        let rows = (0..200_000).map(|index| Row {
            t_s: 1e-4 * index as f64,
            voltage_v: [drive(index); ACTUATORS],
            z_um: Some(0.0),
            ..Row::default()
        });
        let file = MeasurementFile {
            rows: rows.collect(),
            ..MeasurementFile::default()
        };
        let data = Dataset::new(&Session {
            files: vec![("moves.csv".into(), file)],
        });
        assert!(
            data.intervals.len() <= thin::DENSE_ROWS,
            "{}",
            data.intervals.len()
        );
        let mut t_s = 0.0;
        for interval in &data.intervals[1..] {
            t_s += interval.duration_s;
            let volts = drive((1e4 * t_s).round() as usize);
            // Where an interval ends the drive is what was read there.
            assert!((interval.to_v[0] - volts).abs() < 1e-3, "at {t_s} s");
        }
        assert_eq!(t_s > 19.0, is_whole, "{t_s}");
    }
}

#[test]
fn a_session_of_many_files_has_no_more_readings_than_are_worth_it() {
    let file = |_| {
        let row = |index: usize| Row {
            t_s: index as f64,
            voltage_v: [(index / 10) as f64 * 0.02; ACTUATORS],
            z_um: Some(index as f64),
            current_a: [Some(1e-3); ACTUATORS],
            ..Row::default()
        };
        let file = MeasurementFile {
            rows: (0..1400).map(row).collect(),
            ..MeasurementFile::default()
        };
        ("many.csv".into(), file)
    };
    let session = Session {
        files: (0..10).map(file).collect(),
    };
    let data = Dataset::new(&session);
    assert!(
        data.observations.len() <= 20_000,
        "{}",
        data.observations.len()
    );
    assert!(data.observations.len() > 15_000);
    // Every drive is still there.
    assert!(data.intervals.len() >= 14_000);
}
