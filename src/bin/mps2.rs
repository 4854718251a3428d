//! The emulated board: MPS2-AN386 in QEMU, in front of a virtual mirror.
#![no_std]
#![no_main]

use control_core::Controller;
use embassy_executor::Spawner;
use mirror_firmware::board::CalibrationFlash;
use mirror_firmware::board::mps2::{LockstepPlant, link, watchdog};
use mirror_firmware::calibration::{IN_USE, SPARE, UPLOADED, Upload};
use mirror_firmware::control::{self, Control};
use mirror_firmware::keeper::Keeper;
use mirror_firmware::mailbox::MAILBOX;
use mirror_firmware::watchdog::guard;
use mirror_firmware::{last_stop, rpc};

#[embassy_executor::main]
async fn main(_spawner: Spawner) -> ! {
    let Ok(plant) = LockstepPlant::open(&MAILBOX) else {
        defmt::panic!("no plant: start this image with `cargo xtask emulate`");
    };
    let Some((rx, tx)) = link::open() else {
        defmt::panic!("the link is already open")
    };
    defmt::info!("ready");

    let mut keeper = Keeper::new(CalibrationFlash::open());
    let uploaded = UPLOADED.take();
    let calibration = IN_USE.init(keeper.load(uploaded));
    let bad_calibration = keeper.fault();
    let upload = Upload::new(uploaded, SPARE.init(*calibration));
    let mut session = rpc::Session::new::<LockstepPlant>(&MAILBOX, calibration, upload, keeper);
    let mut control = Control::new(Controller::new(calibration), &MAILBOX);
    if let Some(fault) = bad_calibration {
        control.trip(fault);
    }
    if let Some(stopped) = last_stop::take() {
        control.trip(stopped.fault);
        session = session.after(stopped.text);
    }
    let serve = rpc::serve(tx, rx, rpc::FRAME.take(), session);
    watchdog::start();
    let guard = guard(watchdog::feed);
    embassy_futures::join::join3(control::run(plant, control), serve, guard)
        .await
        .0
}
