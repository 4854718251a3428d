//! What a calibration of the mirror adds to the instrument: poses, how far the plate may be off, and when it has settled.

use calibration::{tabulate, to_toml};
use control_core::calibration::{Parts, Plate, Residual};
use control_core::{Calibration, Micrometre, Volt};
use emulated_board::Speed;
use hil::Bench;
use mirror_model::{Model, Preset};
use virtual_mirror::MirrorConfig;

use super::client::Serving;

/// How fast the board's time passes by the wall's clock: a move of 50 ms is asked about on its way, on a machine with other work.
const SLOWLY: Speed = Speed::Times(0.05);

/// A bench whose board has the factory's calibration, the levers of the virtual mirror's plate, and the word of a trial.
fn calibrated(change: impl FnOnce(&mut Parts)) -> Serving {
    let bench = Bench::changed(|new| new.speed = SLOWLY);
    let lever_um = MirrorConfig::bench().plate.lever_um as f32;
    let factory = tabulate(&Model::from(Preset::Reconciled)).expect("a calibration");
    let mut parts = Parts {
        plate: Plate::cross(Micrometre(lever_um)),
        residual: Residual {
            piston: Micrometre(0.1),
            tried: factory.calibration.max_position(),
            apart: 1e-3,
            ..Residual::UNKNOWN
        },
        ..*factory.calibration.parts()
    };
    change(&mut parts);
    let file = to_toml(&Calibration::new(parts).expect("plausible"));
    std::fs::write(bench.directory().join("tried.toml"), file).expect("written");
    bench.json(&["load-calibration", "tried.toml"]);
    Serving::of(bench)
}

/// Metres and radians are those that were asked for, but for the rounding of 32-bit floats: 4 pm of 60 um, and 5e-10.
fn are_near(told: &[f64], asked: [f64; 3]) {
    let off = |i: usize| (told[i] - asked[i]).abs();
    assert!(
        told.len() == 3 && off(0) < 1e-10 && off(1) < 1e-7 && off(2) < 1e-7,
        "{told:?} and {asked:?}"
    );
}

#[test]
fn a_pose_is_held_and_told_and_a_wait_ends_when_the_board_foresees_it() {
    let serving = calibrated(|_| ());
    let mut client = serving.client();
    assert!(client.number("MEAS:SETT?") > 9e37, "nothing is asked for");
    assert_eq!(client.ask("POSE 60um,0.5deg,-5mrad;*OPC?"), "1");
    assert_eq!(client.number("MEAS:SETT?"), 0.0, "it has settled");
    let asked = [60e-6, 0.5_f64.to_radians(), -5e-3];
    are_near(&client.numbers("POSE?"), asked);
    are_near(&client.numbers("MEAS:POSE?"), asked);
    assert!((client.number("POS?") - 60e-6).abs() < 1e-12, "its piston");
    // At least what the calibration says that it leaves, at 95 of 100: 1.96 times 0.1 um.
    let uncertain = client.numbers("MEAS:UNC?");
    assert!(
        uncertain[0] > 0.19e-6 && uncertain[1] > 0.0,
        "{uncertain:?}"
    );

    // A position is a pose without tilts, and the heat that leaves with it takes its time.
    // A busy machine may come to ask when it has left already.
    let asked_on_its_way = (0..10).any(|_| {
        client.say("POS 160um;*WAI");
        let told = client.ask("POS 40um;:MEAS:SETT?;:STAT:OPER:COND?");
        let (left_s, condition) = told.split_once(';').expect("two answers");
        let left_s: f64 = left_s.parse().expect("a number");
        assert!((0.0..1.0).contains(&left_s), "{told}");
        // Driven, and settling.
        left_s > 0.0 && condition == "258"
    });
    assert!(
        asked_on_its_way,
        "ten moves were over when they were asked about"
    );
    assert_eq!(client.ask("*OPC?"), "1");
    assert_eq!(client.ask("MEAS:SETT?;:STAT:OPER:COND?"), "0E0;256");
    are_near(&client.numbers("POSE?"), [40e-6, 0.0, 0.0]);
    client.is_content();

    for (line, error) in [
        ("POSE 60um,40deg,0", "-222,"),
        ("POSE 1m,0,0", "-222,"),
        ("POSE 60um,0.5deg", "-109,"),
        ("POSE 60um,0.5deg,1um", "-131,"),
    ] {
        client.say(line);
        let said = client.error();
        assert!(said.starts_with(error), "{line}: {said}");
    }
    are_near(&client.numbers("POSE?"), [40e-6, 0.0, 0.0]);
}

/// A wait that nothing but the time ends is told from one whose mirror has settled.
#[test]
fn a_mirror_that_a_limit_keeps_away_is_an_error_beside_the_answer() {
    // The factory's table asks for 3.5 V at its end.
    let serving = calibrated(|parts| parts.bounds.drive = Volt(3.0));
    let mut client = serving.client();
    assert_eq!(client.ask("SETT 20ms;:POS 60um;*OPC?"), "1");
    client.is_content();
    assert_eq!(client.ask("POS 165um;*OPC?"), "1");
    let said = client.error();
    assert!(
        said.starts_with("-365,") && said.contains("drive-high keeps it away"),
        "{said}"
    );
    client.is_content();
    let unforeseen = |client: &mut super::client::Client| {
        let condition: u16 = client.ask("STAT:QUES:COND?").parse().expect("a number");
        condition & 1 << 12 != 0
    };
    assert!(unforeseen(&mut client));
    // Voltages do not say where the mirror is to be.
    assert_eq!(client.ask("VOLT 3V;*OPC?"), "1");
    client.is_content();
    assert!(!unforeseen(&mut client));
}
