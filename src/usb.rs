//! The USB device, whatever the controller under it: full speed, one vendor interface with two bulk
//! endpoints. Windows finds its driver by the descriptors.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_usb::control::{InResponse, OutResponse, Recipient, Request, RequestType};
use embassy_usb::driver::Driver;
use embassy_usb::{Config, Handler, UsbDevice};
use mirror_protocol::usb::{MANUFACTURER, PRODUCT, PRODUCT_ID, STOP_REQUEST, VENDOR_ID};
use postcard_rpc::server::impls::embassy_usb_v0_5::dispatch_impl::{WireRxImpl, WireStorage};
use postcard_rpc::server::impls::embassy_usb_v0_5::{EUsbWireTx, USB_FS_MAX_PACKET_SIZE};

use crate::mailbox::LinkSide;

/// Buffers of the device; for one [`open`].
pub type Storage<M, D> = WireStorage<M, D>;

/// The device, and what receives and sends frames once it runs.
pub type Opened<M, D> = (UsbDevice<'static, D>, WireRxImpl<D>, EUsbWireTx<M, D>);

/// Stops the board for whoever asks on endpoint 0, which no process can keep from another.
pub struct Stop(pub LinkSide);

impl Handler for Stop {
    fn control_out(&mut self, request: Request, _data: &[u8]) -> Option<OutResponse> {
        is_stop(&request).then(|| {
            self.0.stop();
            OutResponse::Accepted
        })
    }

    fn control_in<'a>(
        &'a mut self,
        request: Request,
        buffer: &'a mut [u8],
    ) -> Option<InResponse<'a>> {
        let answer = buffer.get_mut(..1).filter(|_| is_stop(&request))?;
        answer.fill(u8::from(!self.0.is_stopping()));
        Some(InResponse::Accepted(answer))
    }
}

fn is_stop(request: &Request) -> bool {
    (request.request_type, request.recipient) == (RequestType::Vendor, Recipient::Device)
        && request.request == STOP_REQUEST
}

/// Makes the device. `frame` holds a frame while it is sent; `serial` tells boards apart.
pub fn open<M: RawMutex, D: Driver<'static>>(
    storage: &'static Storage<M, D>,
    driver: D,
    frame: &'static mut [u8],
    serial: &'static str,
    stop: &'static mut Stop,
) -> Opened<M, D> {
    let mut config = Config::new(VENDOR_ID, PRODUCT_ID);
    config.manufacturer = Some(MANUFACTURER);
    config.product = Some(PRODUCT);
    config.serial_number = Some(serial);
    let packet = USB_FS_MAX_PACKET_SIZE;
    let (mut builder, tx, rx) = storage.init_without_build(driver, config, frame, packet);
    builder.handler(stop);
    (builder.build(), rx, tx)
}
