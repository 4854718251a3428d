//! The emulated board: MPS2-AN386 in QEMU, in front of a virtual mirror.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use mirror_firmware::board::BoardFlash;
use mirror_firmware::board::lockstep::{self, LockstepBoard};
use mirror_firmware::board::mps2::{PlantFifos, link, origin, stop_fifos, watchdog};
use mirror_firmware::startup::{Memory, start};
use mirror_firmware::watchdog::guard;
use mirror_firmware::{mailbox, rpc};

#[embassy_executor::main]
async fn main(_spawner: Spawner) -> ! {
    let Ok(plant) = PlantFifos::open() else {
        defmt::panic!("no plant: start this image with `cargo xtask emulate`");
    };
    let Some((rx, tx)) = link::open() else {
        defmt::panic!("the link is already open")
    };
    defmt::info!("ready");

    let memory = Memory::of_the_image();
    let flash = BoardFlash::open();
    let mailbox = mailbox::take();
    let stop = stop_fifos::serve(mailbox.0);
    let (session, control) = start::<LockstepBoard<PlantFifos>>(flash, memory, origin(), mailbox);
    let serve = rpc::serve(tx, rx, rpc::FRAME.take(), session);
    watchdog::start();
    let guard = guard(watchdog::feed);
    embassy_futures::join::join4(
        lockstep::run(LockstepBoard::new(plant), control),
        serve,
        stop,
        guard,
    )
    .await
    .0
}
