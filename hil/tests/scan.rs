//! Scans of poses, as a user asks for them: what is out of reach is told before anything is driven, the plate goes where it is
//! asked to, and triggers tell lines and frames.

use calibration::{tabulate, to_toml};
use control_core::calibration::{Parts, Plate};
use control_core::{Calibration, Micrometre};
use hil::Bench;
use measurement::Row;
use mirror_model::{Model, Preset};
use virtual_mirror::MirrorConfig;

/// A bench whose board has the factory's calibration, with the levers of the virtual mirror's plate.
fn bench() -> Bench {
    let config = MirrorConfig::bench();
    let factory = tabulate(&Model::from(Preset::Reconciled)).expect("a calibration");
    let parts = Parts {
        plate: Plate::cross(Micrometre(config.plate.lever_um as f32)),
        ..*factory.calibration.parts()
    };
    let levers = to_toml(&Calibration::new(parts).expect("levers only"));
    let bench = Bench::emulated(config);
    std::fs::write(bench.directory().join("levers.toml"), levers).expect("written");
    bench.json(&["load-calibration", "levers.toml"]);
    bench
}

/// The rows of a scan with the sensor's spot there on the plate.
fn rows(bench: &Bench, spot_um: [f64; 2], words: &[&str]) -> Vec<Row> {
    bench.controls().move_spot(spot_um);
    bench.json(&[words, &["-o", "scan.csv", "--force"]].concat());
    bench.measured("scan.csv").rows
}

const SPOT_UM: f64 = 200.0;

/// By how much the tilts that three spots see (deg) differ from those that were asked for, at most, in the second half.
fn largest_error_deg(bench: &Bench, words: &[&str]) -> f64 {
    let [centre, along_y, along_x] =
        [[0.0, 0.0], [0.0, SPOT_UM], [SPOT_UM, 0.0]].map(|spot| rows(bench, spot, words));
    let z_um = |rows: &[Row], i: usize| rows[i].z_um.expect("a virtual sensor");
    let turned = |um: f64| (um / SPOT_UM).atan().to_degrees();
    let error = |i: usize| {
        let x_deg = turned(z_um(&along_y, i) - z_um(&centre, i));
        let y_deg = -turned(z_um(&along_x, i) - z_um(&centre, i));
        let row = &centre[i];
        let x_off = x_deg - row.asked_tilt_x_deg.expect("asked");
        let y_off = y_deg - row.asked_tilt_y_deg.expect("asked");
        x_off.abs().max(y_off.abs())
    };
    (centre.len() / 2..centre.len())
        .map(error)
        .fold(0.0, f64::max)
}

#[test]
fn a_plate_follows_figures_and_tables_of_tilts() {
    let bench = bench();
    let table = "t_s,z_um,tip_deg,tilt_deg\n0,70,0,0\n0.2,80,0.5,-0.3\n0.4,70,0,0\n";
    std::fs::write(bench.directory().join("poses.csv"), table).expect("written");
    for words in [
        &["scan", "circle", "--radius", "0.5deg", "--frequency", "5Hz"][..],
        &[
            "scan",
            "sine",
            "--amplitude",
            "5um",
            "--tilt-x",
            "0.5deg",
            "--tilt-y",
            "-0.3deg",
            "--frequency",
            "5Hz",
        ],
        &[
            "scan",
            "lissajous",
            "--tilt-x",
            "0.4deg",
            "--tilt-y",
            "0.4deg",
            "--frequency",
            "5Hz",
        ],
        &["scan", "csv", "poses.csv", "--cycles", "3"],
    ] {
        let off_deg = largest_error_deg(&bench, words);
        println!("{words:?}: {off_deg:.3} deg off at most");
        // The factory's tables are another mirror's, by a fifth of a tilt at most (`pose.rs`), and level plates of it tilt by 0.1.
        assert!(off_deg < 0.2, "{words:?}: {off_deg} deg");
    }
}

#[test]
fn a_raster_tells_its_lines_and_frames_by_pins_and_in_its_file() {
    let bench = bench();
    let words = [
        "scan",
        "raster",
        "--tilt-x",
        "0.2deg",
        "--tilt-y",
        "0.2deg",
        "--lines",
        "8",
        "--frequency",
        "10Hz",
        "--cycles",
        "2",
        "-o",
        "raster.csv",
    ];
    let before = bench.controls().triggers();
    let report = bench.json(&words);
    let after = bench.controls().triggers();
    // Two frames a cycle.
    assert_eq!(after.frames - before.frames, 4);
    assert_eq!(after.lines - before.lines, 32);
    assert_eq!(
        (&report["frames"], &report["lines"]),
        (&4.into(), &32.into())
    );
    let rows = bench.measured("raster.csv").rows;
    let of_bit = |bit: u8| {
        let begins = rows
            .iter()
            .filter(move |row| row.trigger.expect("told") & bit != 0);
        begins.map(|row| row.t_s).collect::<Vec<_>>()
    };
    for (bit, period_s) in [(1, 0.1), (2, 0.1 / 8.0)] {
        for (count, t_s) in of_bit(bit).into_iter().enumerate() {
            // A row is of two ticks here, and the step of the phase may take another.
            let late_s = t_s - count as f64 * period_s;
            assert!((-1e-9..5e-4).contains(&late_s), "{bit}: {t_s} s");
        }
    }
    let asked = |t_s: f64| {
        let row = rows.iter().find(|row| row.t_s >= t_s).expect("a row");
        (
            row.asked_tilt_x_deg.expect("asked"),
            row.asked_tilt_y_deg.expect("asked"),
        )
    };
    // From one corner to the other by the end of the first frame, and back by that of the second.
    for (t_s, x_deg, y_deg) in [(0.0, -0.2, -0.2), (0.0125, 0.2, -0.15), (0.1, -0.2, 0.2)] {
        let (x, y) = asked(t_s);
        // Two ticks of a line of 12.5 ms are 0.4 deg / 60.
        assert!(
            (x - x_deg).abs() < 0.015 && (y - y_deg).abs() < 2e-3,
            "{t_s} s: {x} {y}"
        );
    }
}

#[test]
fn what_cannot_be_scanned_is_told_before_anything_is_driven() {
    let bench = bench();
    let directory = bench.directory().to_owned();
    let write =
        |name: &str, text: &str| std::fs::write(directory.join(name), text).expect("written");
    write("gap.csv", "t_s,z_um,tip_deg,tilt_deg\n0,60,0,0\n1,60,,0\n");
    write(
        "nan.csv",
        "t_s,z_um,tip_deg,tilt_deg\n0,60,0,0\n1,nan,0,0\n",
    );
    write("twice.csv", "t_s,z_um\n0,60\n0,61\n");
    write("back.csv", "t_s,z_um\n0.5,60\n0,61\n");
    write(
        "far.csv",
        "t_s,z_um,tip_deg,tilt_deg\n0,60,0,0\n1,60,0,40\n",
    );
    for (words, said) in [
        (
            &["scan", "csv", "gap.csv"][..],
            "line 3, `1,60,,0`: a cell is empty",
        ),
        (&["scan", "csv", "nan.csv"], "`nan` is no finite number"),
        (
            &["scan", "csv", "twice.csv"],
            "line 3 has the time of the line before, 0 s",
        ),
        (&["scan", "csv", "back.csv"], "line 3 goes back in time"),
        (
            &["scan", "csv", "far.csv"],
            "60.000 um with +0.0000 deg about x and +40.0000 deg about y is out of reach",
        ),
        (
            &["scan", "csv", "far.csv"],
            "the nearest pose in reach is 60.000 um",
        ),
        (
            &["scan", "circle", "--radius", "40deg"],
            "is out of reach of this mirror; nothing was moved",
        ),
        (&["scan", "circle", "--radius", "nan"], "nan"),
        (
            &[
                "scan",
                "raster",
                "--tilt-x",
                "0.1deg",
                "--tilt-y",
                "0.1deg",
                "--lines",
                "1000",
                "--frequency",
                "100Hz",
            ],
            "a wave of 50000 Hz cannot be played",
        ),
    ] {
        let refused = bench.tool(words);
        assert_ne!(refused.code, 0, "{words:?}");
        let sentence = refused.sentence();
        assert!(sentence.contains(said), "{words:?}: {sentence}");
    }
    let status = bench.json(&["status"]);
    assert!(
        status["drive_v"]
            .as_array()
            .expect("four")
            .iter()
            .all(|volt| volt == 0.0),
        "{status}"
    );
    assert_eq!(bench.controls().triggers(), Default::default());
}

/// The board remembers what it drove: a rest that the mirror has not forgotten is nobody's zero.
#[test]
fn what_the_mirror_remembers_of_earlier_drives_is_no_error_of_a_scan() {
    let bench = Bench::emulated(MirrorConfig::paper());
    let calibration = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/paper.toml");
    bench.json(&["load-calibration", calibration]);
    bench.json(&["set-z", "150um", "--settle", "20s"]);
    bench.json(&["off"]);
    let rest = [
        "record",
        "--duration",
        "40s",
        "--period",
        "1s",
        "-o",
        "rest.csv",
    ];
    bench.json(&rest);
    let scan = "scan sine --offset 80um --amplitude 10um --frequency 2Hz --cycles 6";
    let scan: Vec<&str> = scan.split(' ').collect();
    let told = bench.json(&scan);
    let rest = bench.measured("rest.csv").rows;
    let rest_um = rest
        .last()
        .and_then(|row| row.z_um)
        .expect("a virtual sensor");
    let mean_um = told["following"]["mean_error_um"]
        .as_f64()
        .expect("a sensor");
    // The calibration's own error is 0.03 um there.
    assert!(rest_um > 0.2 && mean_um.abs() < 0.1, "{rest_um} {mean_um}");
    // Nor is where it was held until the scan began: what it still remembers is to be that of when displacements begin to count.
    bench.json(&["set-z", "100um"]);
    let told = bench.json(&scan);
    let mean_um = told["following"]["mean_error_um"]
        .as_f64()
        .expect("a sensor");
    assert!(mean_um.abs() < 0.5, "{mean_um}");
}
