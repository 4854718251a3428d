//! A USB driver that takes what a host may do to endpoints (USB 2.0, chapters 8 and 9).
//!
//! In embassy-stm32 0.6 a host can stop the firmware, or its USB, by it:
//!
//! - The number of an endpoint that this controller does not have is taken for that of a register, which panics.
//! - An endpoint that is to be halted no more is waited for in a loop that does not end where it was not halted, and is left
//!   halted where it was.
//! - A reset of the bus in the midst of a control transfer disables endpoint 0, and the transfer waits for it for ever.

use core::future::poll_fn;
use core::task::Poll;

use embassy_futures::select::{Either, select};
use embassy_stm32::pac;
use embassy_stm32::pac::usb::regs::Epr;
use embassy_stm32::pac::usb::vals::Stat;
use embassy_usb::driver::{
    Bus, ControlPipe, Driver, EndpointAddress, EndpointAllocError, EndpointError, EndpointType,
    Event, Unsupported,
};

/// Endpoints of the STM32G4's controller (RM0440, USB_EPnR).
const ENDPOINTS: usize = 8;

/// A driver with such a bus.
pub struct Mended<D>(pub D);

/// Its bus.
pub struct MendedBus<B>(B);

/// Its control pipe.
pub struct MendedControl<C>(C);

/// Waits until a reset of the bus has disabled endpoint 0, which nothing else does. The interrupt of a reset wakes the
/// device's task, in which this is polled.
async fn bus_reset() {
    poll_fn(|_| {
        let endpoint = pac::USB.epr(0).read();
        match (endpoint.stat_rx(), endpoint.stat_tx()) {
            (Stat::DISABLED, Stat::DISABLED) => Poll::Ready(()),
            _ => Poll::Pending,
        }
    })
    .await;
}

/// A stage of a control transfer, which a reset of the bus ends.
async fn until_reset<T>(
    stage: impl Future<Output = Result<T, EndpointError>>,
) -> Result<T, EndpointError> {
    match select(stage, bus_reset()).await {
        Either::First(result) => result,
        Either::Second(()) => Err(EndpointError::Disabled),
    }
}

/// Whether an endpoint can be halted: all but those for control, which a setup packet always reaches.
fn can_halt(address: EndpointAddress) -> bool {
    (1..ENDPOINTS).contains(&address.index())
}

/// The next packet of an endpoint is data 0 (section 9.4.5). Writing 1 toggles these bits, writing 0 clears the flags, and the
/// rest is written as it is (RM0440, USB_EPnR).
fn begin_with_data_0(address: EndpointAddress) {
    let register = pac::USB.epr(address.index());
    critical_section::with(|_| {
        let now = register.read();
        let mut write = Epr(now.0);
        write.set_ctr_rx(true);
        write.set_ctr_tx(true);
        write.set_stat_rx(Stat::from_bits(0));
        write.set_stat_tx(Stat::from_bits(0));
        write.set_dtog_rx(now.dtog_rx() && address.is_out());
        write.set_dtog_tx(now.dtog_tx() && address.is_in());
        register.write_value(write);
    });
}

impl<'a, D: Driver<'a>> Driver<'a> for Mended<D> {
    type EndpointOut = D::EndpointOut;
    type EndpointIn = D::EndpointIn;
    type ControlPipe = MendedControl<D::ControlPipe>;
    type Bus = MendedBus<D::Bus>;

    fn alloc_endpoint_out(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        packet: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointOut, EndpointAllocError> {
        self.0
            .alloc_endpoint_out(kind, address, packet, interval_ms)
    }

    fn alloc_endpoint_in(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        packet: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointIn, EndpointAllocError> {
        self.0.alloc_endpoint_in(kind, address, packet, interval_ms)
    }

    fn start(self, control_packet: u16) -> (Self::Bus, Self::ControlPipe) {
        let (bus, control) = self.0.start(control_packet);
        (MendedBus(bus), MendedControl(control))
    }
}

impl<B: Bus> Bus for MendedBus<B> {
    async fn enable(&mut self) {
        self.0.enable().await;
    }

    async fn disable(&mut self) {
        self.0.disable().await;
    }

    async fn poll(&mut self) -> Event {
        self.0.poll().await
    }

    fn endpoint_set_enabled(&mut self, address: EndpointAddress, enabled: bool) {
        self.0.endpoint_set_enabled(address, enabled);
    }

    fn endpoint_set_stalled(&mut self, address: EndpointAddress, stalled: bool) {
        if !can_halt(address) {
            return;
        }
        if stalled {
            self.0.endpoint_set_stalled(address, true);
            return;
        }
        begin_with_data_0(address);
        if self.0.endpoint_is_stalled(address) {
            self.0.endpoint_set_enabled(address, true);
        }
    }

    fn endpoint_is_stalled(&mut self, address: EndpointAddress) -> bool {
        can_halt(address) && self.0.endpoint_is_stalled(address)
    }

    fn force_reset(&mut self) -> Result<(), Unsupported> {
        self.0.force_reset()
    }

    async fn remote_wakeup(&mut self) -> Result<(), Unsupported> {
        self.0.remote_wakeup().await
    }
}

impl<C: ControlPipe> ControlPipe for MendedControl<C> {
    fn max_packet_size(&self) -> usize {
        self.0.max_packet_size()
    }

    async fn setup(&mut self) -> [u8; 8] {
        self.0.setup().await
    }

    async fn data_out(
        &mut self,
        bytes: &mut [u8],
        first: bool,
        last: bool,
    ) -> Result<usize, EndpointError> {
        until_reset(self.0.data_out(bytes, first, last)).await
    }

    async fn data_in(
        &mut self,
        bytes: &[u8],
        first: bool,
        last: bool,
    ) -> Result<(), EndpointError> {
        until_reset(self.0.data_in(bytes, first, last)).await
    }

    async fn accept(&mut self) {
        select(self.0.accept(), bus_reset()).await;
    }

    async fn reject(&mut self) {
        self.0.reject().await;
    }

    async fn accept_set_address(&mut self, address: u8) {
        select(self.0.accept_set_address(address), bus_reset()).await;
    }
}
