//! The USB device, whatever the controller under it: full speed, one vendor interface with two bulk
//! endpoints. Windows finds its driver by the descriptors.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_usb::driver::Driver;
use embassy_usb::{Config, UsbDevice};
use mirror_protocol::usb::{MANUFACTURER, PRODUCT, PRODUCT_ID, VENDOR_ID};
use postcard_rpc::server::impls::embassy_usb_v0_5::dispatch_impl::{WireRxImpl, WireStorage};
use postcard_rpc::server::impls::embassy_usb_v0_5::{EUsbWireTx, USB_FS_MAX_PACKET_SIZE};

/// Buffers of the device; for one [`open`].
pub type Storage<M, D> = WireStorage<M, D>;

/// The device, and what receives and sends frames once it runs.
pub type Opened<M, D> = (UsbDevice<'static, D>, WireRxImpl<D>, EUsbWireTx<M, D>);

/// Makes the device. `frame` holds a frame while it is sent; `serial` tells boards apart.
pub fn open<M: RawMutex, D: Driver<'static>>(
    storage: &'static Storage<M, D>,
    driver: D,
    frame: &'static mut [u8],
    serial: &'static str,
) -> Opened<M, D> {
    let mut config = Config::new(VENDOR_ID, PRODUCT_ID);
    config.manufacturer = Some(MANUFACTURER);
    config.product = Some(PRODUCT);
    config.serial_number = Some(serial);
    let (device, tx, rx) = storage.init(driver, config, frame, USB_FS_MAX_PACKET_SIZE);
    (device, rx, tx)
}
