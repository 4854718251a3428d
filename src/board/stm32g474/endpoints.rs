//! A USB driver that takes what a host may ask about an endpoint (USB 2.0, section 9.4).
//!
//! In embassy-stm32 0.6 any program on the host could stop the firmware by it: the number of an endpoint that this controller
//! does not have is taken for that of a register, which panics; and one that is to be halted no more is waited for in a loop
//! that does not end where it was not halted, and left halted where it was.

use embassy_stm32::pac;
use embassy_stm32::pac::usb::regs::Epr;
use embassy_stm32::pac::usb::vals::Stat;
use embassy_usb::driver::{
    Bus, Driver, EndpointAddress, EndpointAllocError, EndpointType, Event, Unsupported,
};

/// Endpoints of the STM32G4's controller (RM0440, USB_EPnR).
const ENDPOINTS: usize = 8;

/// A driver with such a bus.
pub struct Mended<D>(pub D);

/// Its bus.
pub struct MendedBus<B>(B);

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
    type ControlPipe = D::ControlPipe;
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
        (MendedBus(bus), control)
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
