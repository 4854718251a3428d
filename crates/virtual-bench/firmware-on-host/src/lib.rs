//! The firmware's own application, behind a USB bus in memory: control loop, mailbox, rpc and the USB
//! device are the ones of the driver board, only the controller under them is not.

mod enumerate;
mod wire;

use std::cell::RefCell;
use std::future::{Future, poll_fn};
use std::pin::pin;

use control_core::{AdcCode, Ampere, PwmCode, SupplyCode};
use embassy_futures::join::join3;
use mirror_firmware::board::host::link::{Opened, Storage};
use mirror_firmware::board::host::{HostBoard, Plant, PlantCall};
use mirror_firmware::board::lockstep;
use mirror_firmware::flash::FLASH_BYTES;
use mirror_firmware::keeper::RECORD_BYTES;
use mirror_firmware::mailbox::Mailbox;
use mirror_firmware::origin::Origin;
use mirror_firmware::resets::Resets;
use mirror_firmware::retained::Keep;
use mirror_firmware::startup::{Memory, start};
use mirror_firmware::{rpc, usb};
use mirror_protocol::{
    Hello, HelloEndpoint, MAX_FRAME_BYTES, PROTOCOL_VERSION, ResetCause, WireError,
};
use plant_link::{Converters, NO_READING};
use postcard_rpc::host_client::HostClient;
use simulated_flash::{HalfWords, PAGE_BYTES, SharedFlash, SimulatedFlash};
use virtual_usb::HostSide;

pub use enumerate::{Device, enumerate, get_descriptor};
pub use wire::{connect, send_frame};

/// The serial number that this board tells.
pub const SERIAL: &str = "0123456789ABCDEF01234567";

/// Pages of the flash for fault log and calibrations, as on the driver board.
pub const FLASH_PAGES: usize = FLASH_BYTES / PAGE_BYTES;

/// About a cold heater's.
const RESISTANCE_OHM: f32 = 360.0;
const SUPPLY_MILLIVOLT: u32 = 5000;

/// Resistors in the place of a mirror, and no position sensor.
pub fn resistors() -> Plant {
    let current = |code: u16| Ampere(PwmCode(code).drive().0 / RESISTANCE_OHM);
    Box::new(move |pins| Converters {
        tick: pins.tick,
        current: pins.compare.map(|code| AdcCode::nearest(current(code)).0),
        supply: SupplyCode::from_millivolt(SUPPLY_MILLIVOLT).0,
        sensor_z_nm: NO_READING,
        ..Converters::default()
    })
}

/// The firmware of a driver board whose power has just come, in front of `plant`, its fault log and calibrations in `flash`: a
/// future that never ends, each of whose polls is a control tick, and the host's side of its bus.
pub fn power_up(flash: &SharedFlash, plant: Plant) -> (impl Future + use<>, HostSide) {
    let (device_side, host) = virtual_usb::bus();
    // A board's memory is static; this board's lives as long as the process.
    let mailbox = Box::leak(Box::new(Mailbox::new())).sides();
    let storage: &'static Storage = Box::leak(Box::new(Storage::new()));
    let frame = Box::leak(Box::new([0; MAX_FRAME_BYTES]));
    let received: &'static mut rpc::Frame = Box::leak(Box::new([0; _]));
    let stop = Box::leak(Box::new(usb::Stop(mailbox.0)));
    let (mut device, rx, tx): Opened = usb::open(storage, device_side, frame, SERIAL, stop);

    let memory = Memory {
        uploaded: Box::leak(Box::new([0; RECORD_BYTES])),
        in_use: |calibration| Box::leak(Box::new(calibration)),
        spare: |calibration| Box::leak(Box::new(calibration)),
        settled: |calibration| Box::leak(Box::new(calibration)),
        flash: |flash| Box::leak(Box::new(RefCell::new(flash))),
        fault_log: |log| Box::leak(Box::new(RefCell::new(log))),
    };
    let origin = Origin {
        cause: ResetCause::Power,
        last_stop: None,
        resets: Box::leak(Box::new(Resets::default())),
        retained: Box::leak(Box::new(Keep::empty())),
    };
    let (session, control) = start::<HostBoard>(Some(flash.clone()), memory, origin, mailbox);
    let board = HostBoard::new(PlantCall::new(plant));
    let firmware = async move {
        join3(
            lockstep::run(board, control),
            device.run(),
            rpc::serve(tx, rx, received, session),
        )
        .await
    };
    (firmware, host)
}

/// Runs `test` on the host's side of a bus with the driver board on it, in front of resistors; both take turns.
pub fn with_board<T>(test: impl AsyncFnOnce(HostSide) -> T) -> T {
    let flash = SimulatedFlash::new(FLASH_PAGES, HalfWords::Settle, 0);
    with_board_on(&SharedFlash::new(flash), test)
}

/// The same with a board whose fault log and calibrations lie in `flash`, and whose power has just come.
pub fn with_board_on<T>(flash: &SharedFlash, test: impl AsyncFnOnce(HostSide) -> T) -> T {
    let (firmware, host) = power_up(flash, resistors());
    let runtime = tokio::runtime::Builder::new_current_thread().build();
    runtime
        .expect("a runtime")
        .block_on(in_turns(firmware, test(host)))
}

/// The same, and `act` talks to the board, which has been greeted.
///
/// # Panics
/// Where the board does not answer.
pub fn with_client<T>(flash: &SharedFlash, act: impl AsyncFnOnce(HostClient<WireError>) -> T) -> T {
    with_board_on(flash, async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let client = connect(&host, &device);
        let hello = Hello {
            protocol_version: PROTOCOL_VERSION,
        };
        client
            .send_resp::<HelloEndpoint>(&hello)
            .await
            .expect("an answer");
        act(client).await
    })
}

/// Polls the firmware, which never ends, again and again until `test` does.
async fn in_turns<T, F>(firmware: impl Future<Output = F>, test: impl Future<Output = T>) -> T {
    let mut firmware = pin!(firmware);
    let mut test = pin!(test);
    poll_fn(|context| {
        let _ = firmware.as_mut().poll(context);
        let result = test.as_mut().poll(context);
        if result.is_pending() {
            context.waker().wake_by_ref();
        }
        result
    })
    .await
}
