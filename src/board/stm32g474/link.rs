//! The host link: USB full speed on the controller of the STM32G4.

use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::{PA11, PA12, USB};
use embassy_stm32::{Peri, bind_interrupts, usb};
use embassy_sync::blocking_mutex::raw::ThreadModeRawMutex;
use embassy_usb::UsbDevice;
use mirror_protocol::MAX_FRAME_BYTES;
use postcard_rpc::server::impls::embassy_usb_v0_5::EUsbWireTx;
use postcard_rpc::server::impls::embassy_usb_v0_5::dispatch_impl::WireRxImpl;
use static_cell::{ConstStaticCell, StaticCell};

use super::endpoints::Mended;
use crate::mailbox::LinkSide;
use crate::usb::{Stop, Storage, open as open_usb};

/// Sends frames to the host.
pub type LinkTx = EUsbWireTx<ThreadModeRawMutex, Driver>;
/// Receives frames from the host.
pub type LinkRx = WireRxImpl<Driver>;

type Driver = Mended<usb::Driver<'static, USB>>;

bind_interrupts!(struct Interrupts {
    USB_LP => usb::InterruptHandler<USB>;
});

/// Opens the link once. The device must be run for it to work; it stops the board by `mailbox`.
pub fn open(
    usb: Peri<'static, USB>,
    dp: Peri<'static, PA12>,
    dm: Peri<'static, PA11>,
    mailbox: LinkSide,
) -> (Device, LinkRx, LinkTx) {
    static STORAGE: Storage<ThreadModeRawMutex, Driver> = Storage::new();
    static FRAME: ConstStaticCell<[u8; MAX_FRAME_BYTES]> =
        ConstStaticCell::new([0; MAX_FRAME_BYTES]);
    static STOP: StaticCell<Stop> = StaticCell::new();

    // Below the control loop.
    interrupt::USB_LP.set_priority(Priority::P2);
    let driver = Mended(usb::Driver::new(usb, Interrupts, dp, dm));
    let serial = embassy_stm32::uid::uid_hex();
    let (device, rx, tx) = open_usb(
        &STORAGE,
        driver,
        FRAME.take(),
        serial,
        STOP.init(Stop(mailbox)),
    );
    (Device(device), rx, tx)
}

/// The USB device behind the link.
pub struct Device(UsbDevice<'static, Driver>);

impl Device {
    /// Answers the bus, for ever.
    pub async fn run(mut self) -> ! {
        self.0.run().await
    }
}
