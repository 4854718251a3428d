//! A calibration uploaded over USB, and what a board comes up with after its power was cut.

use crate::{erased, with_a_bad_calibration};
use control_core::Calibration;
use control_core::calibration::{BYTES, Label, Parts};
use firmware_on_host::with_client;
use mirror_firmware::factory;
use mirror_firmware::flash::LOG_BYTES;
use mirror_protocol::{
    CalibrationChunk, CalibrationEndpoint, CalibrationInfo, CalibrationRevertEndpoint,
    CalibrationUse, CalibrationUseEndpoint, CalibrationWriteEndpoint, Chunk, Hello, HelloEndpoint,
    Kept, PROTOCOL_VERSION, Position, Refusal, Sense, SenseEndpoint, SenseInfo,
    SetPositionEndpoint, SetSenseEndpoint, WireError,
};
use postcard_rpc::host_client::HostClient;
use protection::Fault;
use simulated_flash::{PAGE_BYTES, SharedFlash, WORD_BYTES};

fn of_device(device: &str) -> Calibration {
    let mut parts: Parts = *factory::calibration().parts();
    parts.origin.device = Label::new(device).expect("short");
    Calibration::new(parts).expect("only its name is another")
}

/// What a board that starts on `flash` says of its calibration.
fn found(flash: &SharedFlash) -> CalibrationInfo {
    with_client(flash, async |client| {
        let reply = client.send_resp::<CalibrationEndpoint>(&()).await;
        reply.expect("an answer").expect("greeted")
    })
}

fn upload(flash: &SharedFlash, calibration: &Calibration) -> CalibrationInfo {
    with_client(flash, async |client| {
        put_to_use(&client, calibration, CalibrationUse::ForGood).await
    })
}

async fn put_to_use(
    client: &HostClient<WireError>,
    calibration: &Calibration,
    usage: CalibrationUse,
) -> CalibrationInfo {
    put_bytes_to_use(client, &calibration.to_bytes(), usage).await
}

async fn put_bytes_to_use(
    client: &HostClient<WireError>,
    bytes: &[u8],
    usage: CalibrationUse,
) -> CalibrationInfo {
    let capacity = Chunk::new().capacity();
    for (i, piece) in bytes.chunks(capacity).enumerate() {
        let chunk = CalibrationChunk {
            offset: (i * capacity) as u16,
            bytes: Chunk::from_slice(piece).expect("it fits"),
        };
        let reply = client.send_resp::<CalibrationWriteEndpoint>(&chunk).await;
        reply.expect("an answer").expect("taken");
    }
    let reply = client.send_resp::<CalibrationUseEndpoint>(&usage).await;
    reply.expect("an answer").expect("used")
}

async fn revert(client: &HostClient<WireError>) -> CalibrationInfo {
    let reply = client.send_resp::<CalibrationRevertEndpoint>(&()).await;
    reply.expect("an answer").expect("reverted")
}

#[test]
fn it_survives_a_reset() {
    let flash = erased();
    assert_eq!(found(&flash).kept, Kept::Factory);
    for device in ["first", "second"] {
        assert_eq!(upload(&flash, &of_device(device)).kept, Kept::Yes);
        let info = found(&flash);
        assert_eq!((info.device.as_str(), info.kept), (device, Kept::Yes));
    }
}

#[test]
fn one_on_trial_gives_way_to_the_one_before() {
    let flash = erased();
    upload(&flash, &of_device("old"));
    let of = |info: CalibrationInfo| (info.device.as_str().to_owned(), info.kept);
    let old = ("old".to_owned(), Kept::Yes);
    with_client(&flash, async |client| {
        for device in ["first try", "second try"] {
            let used = put_to_use(&client, &of_device(device), CalibrationUse::OnTrial).await;
            assert_eq!(of(used), (device.to_owned(), Kept::OnTrial));
        }
        assert_eq!(of(revert(&client).await), old);
        // Nothing is on trial any more.
        assert_eq!(of(revert(&client).await), old);
        put_to_use(&client, &of_device("left behind"), CalibrationUse::OnTrial).await;
        let hello = Hello {
            protocol_version: PROTOCOL_VERSION,
        };
        let greeted = client.send_resp::<HelloEndpoint>(&hello).await;
        greeted.expect("an answer");
        let in_use = client.send_resp::<CalibrationEndpoint>(&()).await;
        let in_use = in_use.expect("an answer").expect("greeted");
        assert_eq!(of(in_use), old, "the next tool greets");
        put_to_use(&client, &of_device("left alone"), CalibrationUse::OnTrial).await;
    });
    assert_eq!(of(found(&flash)), old, "after a reset");

    // A try that was put to use for good is what the next one gives way to; without flash, too.
    with_client(&flash, async |client| {
        flash.lock().cut_power_after(0);
        for usage in [CalibrationUse::OnTrial, CalibrationUse::ForGood] {
            put_to_use(&client, &of_device("new"), usage).await;
        }
        put_to_use(&client, &of_device("newer"), CalibrationUse::OnTrial).await;
        assert_eq!(
            of(revert(&client).await),
            ("new".to_owned(), Kept::No),
            "its flash did not take it"
        );
    });
}

#[test]
fn after_a_power_cut_at_any_operation_the_old_or_the_new_one_is_in_use() {
    let flash = erased();
    upload(&flash, &of_device("old"));
    let before = flash.lock().clone();
    upload(&flash, &of_device("new"));
    let operations = flash.lock().operations() - before.operations();
    let words = BYTES.div_ceil(WORD_BYTES) as u64;
    assert!(operations > words, "{operations}");
    // Every operation is cut in `calibration-store`; here some, through the whole firmware.
    for operation in (0..operations)
        .step_by(17)
        .chain(operations - 5..operations)
    {
        let flash = SharedFlash::new(before.reseeded(operation));
        flash.lock().cut_power_after(operation);
        let acknowledged = upload(&flash, &of_device("new")).kept;
        assert_eq!(acknowledged, kept_by(operation, operations), "{operation}");
        flash.lock().power_up();
        let info = found(&flash);
        assert_eq!(info.kept, Kept::Yes, "{operation}");
        let device = info.device.as_str();
        assert!(
            device == "new" || device == "old" && acknowledged == Kept::No,
            "{operation}"
        );
    }
}

#[test]
fn a_flash_that_wears_out_at_any_operation_keeps_the_old_or_the_new_one_and_the_board_says_so() {
    let flash = erased();
    upload(&flash, &of_device("old"));
    let before = flash.lock().clone();
    upload(&flash, &of_device("new"));
    let operations = flash.lock().operations() - before.operations();
    for operation in (0..operations)
        .step_by(13)
        .chain(operations - 3..operations)
    {
        let flash = SharedFlash::new(before.clone());
        flash.lock().wear_out_after(operation);
        let used = upload(&flash, &of_device("new"));
        assert_eq!(
            used.device.as_str(),
            "new",
            "it is in use until the next reset"
        );
        assert_eq!(used.kept, kept_by(operation, operations), "{operation}");
        let info = found(&flash);
        let device = info.device.as_str();
        assert_eq!(info.kept, Kept::Yes, "{operation}");
        // One that lacks its seal only is there, although the board promised nothing.
        assert!(
            device == "new" || device == "old" && used.kept == Kept::No,
            "{operation}: {device}"
        );
    }
}

/// What a board may say of an update that was cut at `operation` of `operations`: the last two take the seal off the record
/// before, when the new one is whole.
fn kept_by(operation: u64, operations: u64) -> Kept {
    if operation < operations - 2 {
        Kept::No
    } else {
        Kept::Yes
    }
}

fn set_sense(flash: &SharedFlash, gain: f32) -> SenseInfo {
    with_client(flash, async |client| {
        let sense = Sense {
            zero_a: [2e-6; 4],
            gain: [gain; 4],
        };
        let reply = client.send_resp::<SetSenseEndpoint>(&sense).await;
        reply.expect("an answer").expect("plausible")
    })
}

fn found_sense(flash: &SharedFlash) -> SenseInfo {
    with_client(flash, async |client| {
        let reply = client.send_resp::<SenseEndpoint>(&()).await;
        reply.expect("an answer").expect("greeted")
    })
}

#[test]
fn the_senses_calibration_survives_beside_the_mirrors_and_each_an_update_of_the_other() {
    let flash = erased();
    assert_eq!(found_sense(&flash).kept, Kept::Factory);
    assert_eq!(set_sense(&flash, 1.01).kept, Kept::Yes);
    assert_eq!(found(&flash).kept, Kept::Factory);
    for (device, gain) in [("first", 1.01), ("second", 0.99)] {
        assert_eq!(upload(&flash, &of_device(device)).kept, Kept::Yes);
        let sense = set_sense(&flash, gain);
        assert_eq!(found_sense(&flash), sense);
        assert_eq!((sense.sense.gain, sense.kept), ([gain; 4], Kept::Yes));
        let info = found(&flash);
        assert_eq!((info.device.as_str(), info.kept), (device, Kept::Yes));
    }
}

/// The factory's calibration as firmware had it whose calibrations had format 3.
const FORMAT_3: &[u8] = include_bytes!("calibration-3.bin");

#[test]
fn a_calibration_of_the_format_before_is_taken_kept_and_knows_no_levers() {
    let flash = erased();
    assert_eq!(upload(&flash, &of_device("longer")).kept, Kept::Yes);
    let used = with_client(&flash, async |client| {
        put_bytes_to_use(&client, FORMAT_3, CalibrationUse::ForGood).await
    });
    assert_eq!(used.kept, Kept::Yes);
    // Behind it in the same record.
    let sense = set_sense(&flash, 1.01);
    let info = found(&flash);
    assert_eq!((info.kept, found_sense(&flash)), (Kept::Yes, sense));
    let reaches = |lever: &mirror_protocol::Lever| lever.x_um != 0.0 || lever.y_um != 0.0;
    assert!(!info.levers.iter().any(reaches), "{info:?}");
    assert_eq!(info.max_position_um, used.max_position_um);
}

#[test]
fn after_a_power_cut_at_any_operation_the_old_or_the_new_sense_is_in_use_and_the_mirrors_is_there()
{
    let flash = erased();
    upload(&flash, &of_device("mirror"));
    set_sense(&flash, 1.01);
    let before = flash.lock().clone();
    set_sense(&flash, 0.99);
    let operations = flash.lock().operations() - before.operations();
    for operation in (0..operations)
        .step_by(17)
        .chain(operations - 5..operations)
    {
        let flash = SharedFlash::new(before.reseeded(operation));
        flash.lock().cut_power_after(operation);
        let acknowledged = set_sense(&flash, 0.99).kept;
        assert_eq!(acknowledged, kept_by(operation, operations), "{operation}");
        flash.lock().power_up();
        let sense = found_sense(&flash);
        assert_eq!(sense.kept, Kept::Yes, "{operation}");
        let gain = sense.sense.gain;
        assert!(
            gain == [0.99; 4] || gain == [1.01; 4] && acknowledged == Kept::No,
            "{operation}"
        );
        let info = found(&flash);
        assert_eq!((info.device.as_str(), info.kept), ("mirror", Kept::Yes));
    }
}

#[test]
fn a_bad_one_falls_back_to_the_factorys_and_the_board_says_so() {
    let flash = with_a_bad_calibration();
    let info = found(&flash);
    assert_eq!(info.kept, Kept::FactoryAsStoredIsBad);
    assert_eq!(info.device, found(&erased()).device);

    // Nothing is driven until somebody has seen it.
    let fault = Fault::CalibrationBad.code();
    assert_eq!(refusal_to_move(&flash), Some(Refusal::Tripped { fault }));
}

#[test]
fn rot_of_the_newest_is_told_and_the_one_before_is_the_users_choice() {
    let flash = erased();
    upload(&flash, &of_device("mirror 1, sold"));
    upload(&flash, &of_device("mirror 2, here"));
    // A bit of the second slot's payload; a slot is two pages.
    flash.lock().flip(8 * (LOG_BYTES + 2 * PAGE_BYTES + 100));

    let info = found(&flash);
    assert_eq!(
        (info.device.as_str(), info.kept),
        ("mirror 1, sold", Kept::Outdated)
    );
    let fault = Fault::CalibrationOutdated.code();
    assert_eq!(refusal_to_move(&flash), Some(Refusal::Tripped { fault }));

    // A calibration of the sense is not what decides it.
    with_client(&flash, async |client| {
        let sense = Sense {
            zero_a: [1e-6; 4],
            gain: [1.0; 4],
        };
        let reply = client.send_resp::<SetSenseEndpoint>(&sense).await;
        assert_eq!(reply.expect("an answer").expect("used").kept, Kept::No);
    });
    assert_eq!(found(&flash).kept, Kept::Outdated);

    upload(&flash, &of_device("mirror 2, here"));
    let info = found(&flash);
    assert_eq!(
        (info.device.as_str(), info.kept),
        ("mirror 2, here", Kept::Yes)
    );
}

/// Why a board that starts on `flash` does not move.
fn refusal_to_move(flash: &SharedFlash) -> Option<Refusal> {
    with_client(flash, async |client| {
        let position = Position {
            z_um: 50.0,
            lease_ms: 1000,
        };
        let reply = client.send_resp::<SetPositionEndpoint>(&position).await;
        reply.expect("an answer").err()
    })
}
