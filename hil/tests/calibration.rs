//! A calibration goes to the board in pieces; a bad one is refused by name and changes nothing.

use std::path::PathBuf;

use calibration::tabulate;
use control_core::Calibration;
use hil::{Bench, RawLink};
use mirror_model::{Model, Symbol};
use mirror_protocol::{
    CalibrationChunk, CalibrationEndpoint, CalibrationInfo, CalibrationRefusal, CalibrationUse,
    CalibrationUseEndpoint, CalibrationWriteEndpoint, Chunk, Kept, PROTOCOL_VERSION, Refusal,
};
use virtual_mirror::MirrorConfig;

/// Another mirror than the factory's.
fn calibration() -> Calibration {
    let mut model = Model::load("reconciled").expect("a preset");
    model.parameters.set(Symbol::ThermalResistance, 4000.0);
    model.provenance.device = Some("mirror 7".to_owned());
    model.provenance.date = Some("2026-11-21".to_owned());
    tabulate(&model).expect("a calibration").calibration
}

fn link(bench: &Bench) -> RawLink {
    let mut link = RawLink::connect(&PathBuf::from(bench.board())).expect("the board listens");
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    link
}

fn write(link: &mut RawLink, offset: usize, piece: &[u8]) -> Result<(), Refusal> {
    let chunk = CalibrationChunk {
        offset: offset as u16,
        bytes: Chunk::from_slice(piece).expect("a piece fits"),
    };
    link.ask::<CalibrationWriteEndpoint>(&chunk)
        .unwrap()
        .unwrap()
}

/// What is in use after an upload for good, or what is said of it.
fn upload(link: &mut RawLink, bytes: &[u8]) -> Result<CalibrationInfo, String> {
    upload_for(CalibrationUse::ForGood, link, bytes)
}

fn upload_for(
    usage: CalibrationUse,
    link: &mut RawLink,
    bytes: &[u8],
) -> Result<CalibrationInfo, String> {
    for (i, piece) in bytes.chunks(192).enumerate() {
        write(link, 192 * i, piece).expect("pieces follow each other");
    }
    let used = link.ask::<CalibrationUseEndpoint>(&usage).unwrap().unwrap();
    used.map_err(|refusal| match refusal {
        CalibrationRefusal::Unusable(said) => said.as_str().to_owned(),
        CalibrationRefusal::Refused(refusal) => format!("{refusal:?}"),
    })
}

#[test]
fn a_good_one_is_used_and_a_bad_one_is_not() {
    let bench = Bench::emulated(MirrorConfig::bench());
    let mut link = link(&bench);
    let used = upload(&mut link, &calibration().to_bytes()).expect("it is good");
    assert_eq!(
        (used.device.as_str(), used.date.as_str()),
        ("mirror 7", "2026-11-21")
    );
    assert_eq!(used.max_position_um, calibration().max_position().0);

    let mut damaged = calibration().to_bytes();
    damaged[500] ^= 1;
    let short = &calibration().to_bytes()[..2000];
    let mut other = calibration().to_bytes();
    other[4] = 14;
    for (bytes, named) in [
        (&damaged[..], "checksum"),
        (short, "it has 2000 bytes"),
        (&other[..], "format 14"),
    ] {
        let said = upload(&mut link, bytes).expect_err(named);
        assert!(said.contains(named), "{said}");
        let kept = link.ask::<CalibrationEndpoint>(&()).unwrap().unwrap();
        assert_eq!(kept, Ok(used.clone()));
    }

    // And again, into the place that the first exchange gave back.
    for _ in 0..3 {
        assert_eq!(
            upload(&mut link, &calibration().to_bytes()),
            Ok(used.clone())
        );
    }
}

#[test]
fn a_file_is_loaded_and_one_that_cannot_be_used_changes_nothing() {
    let bench = Bench::emulated(MirrorConfig::bench());
    let text = calibration::to_toml(&calibration());
    let write = |name: &str, text: &str| {
        std::fs::write(bench.directory().join(name), text).expect("written");
    };
    write("mirror-7.toml", &text);
    let loaded = bench.json(&["load-calibration", "mirror-7.toml"]);
    assert_eq!(loaded["calibration"], "mirror 7, 2026-11-21, kept in flash");
    assert_eq!(loaded["before"], "as the factory left it");

    write("cut.toml", &text[..text.len() / 2]);
    write("hot.toml", &text.replace("tcr", "ctr"));
    for file in ["cut.toml", "hot.toml", "nowhere.toml"] {
        let said = bench.tool(&["load-calibration", file, "--json"]);
        assert_eq!(said.code, 1, "{said:?}");
        assert!(said.err.contains(file), "{}", said.err);
        assert!(
            said.out.starts_with(r#"{"format":1,"error":{"code":"#),
            "{}",
            said.out
        );
        let status = bench.json(&["status"]);
        assert_eq!(status["calibration"]["device"], "mirror 7", "{status}");
    }
}

/// As `calibrate` leaves it that is killed in its trial.
#[test]
fn one_that_is_left_on_trial_gives_way_as_the_next_tool_greets() {
    let bench = Bench::emulated(MirrorConfig::bench());
    let bytes = calibration().to_bytes();
    let mut killed = link(&bench);
    let used = upload_for(CalibrationUse::OnTrial, &mut killed, &bytes).expect("it is good");
    assert_eq!(used.kept, Kept::OnTrial);
    drop(killed);
    let status = bench.json(&["status"]);
    assert_eq!(status["calibration"]["kept"], "Factory", "{status}");
}

#[test]
fn pieces_must_follow_each_other() {
    let bench = Bench::emulated(MirrorConfig::bench());
    let mut link = link(&bench);
    assert_eq!(write(&mut link, 0, &[1; 192]), Ok(()));
    assert_eq!(
        write(&mut link, 200, &[1; 192]),
        Err(Refusal::UploadGap { expected: 192 })
    );
    for i in 1.. {
        if write(&mut link, 192 * i, &[1; 192]) == Err(Refusal::UploadTooLong) {
            break;
        }
        assert!(i < 100, "it never ends");
    }
}

#[test]
fn it_is_still_there_after_the_power_was_cut() {
    let directory = tempfile::tempdir().expect("a directory");
    let flash = directory.path().join("flash");
    let board = || Bench::with_flash(MirrorConfig::bench(), Some(&flash));
    let in_use = |bench: &Bench| {
        let reply = link(bench).ask::<CalibrationEndpoint>(&()).unwrap();
        reply.unwrap().expect("greeted")
    };
    let mut bench = board();
    assert_eq!(in_use(&bench).kept, Kept::Factory);
    let used = upload(&mut link(&bench), &calibration().to_bytes()).expect("it is good");
    assert_eq!(used.kept, Kept::Yes);
    bench.kill_board();
    drop(bench);
    assert_eq!(in_use(&board()), used);

    let mut bytes = std::fs::read(&flash).expect("a file");
    // Behind the fault log (`src/flash.rs`).
    bytes[16 * 1024 + 100] ^= 1;
    std::fs::write(&flash, bytes).expect("the file");
    assert_eq!(in_use(&board()).kept, Kept::FactoryAsStoredIsBad);
}
