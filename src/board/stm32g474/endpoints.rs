//! A USB driver that leaves alone what its controller does not have.
//!
//! A host may ask for the state of any of 16 endpoints, or stall it (USB 2.0, section 9.4), and this controller has eight.
//! embassy-stm32 0.6 takes the number for that of a register, and panics: any program on the host could stop the firmware.

use embassy_usb::driver::{
    Bus, Driver, EndpointAddress, EndpointAllocError, EndpointType, Event, Unsupported,
};

/// Endpoint registers of the STM32G4's controller (RM0440, USB_EPnR).
const ENDPOINTS: usize = 8;

/// A driver, whose bus is asked of endpoints that it has.
pub struct Bounded<D>(pub D);

/// Its bus.
pub struct BoundedBus<B>(B);

impl<'a, D: Driver<'a>> Driver<'a> for Bounded<D> {
    type EndpointOut = D::EndpointOut;
    type EndpointIn = D::EndpointIn;
    type ControlPipe = D::ControlPipe;
    type Bus = BoundedBus<D::Bus>;

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
        (BoundedBus(bus), control)
    }
}

impl<B: Bus> Bus for BoundedBus<B> {
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
        if address.index() < ENDPOINTS {
            self.0.endpoint_set_enabled(address, enabled);
        }
    }

    fn endpoint_set_stalled(&mut self, address: EndpointAddress, stalled: bool) {
        if address.index() < ENDPOINTS {
            self.0.endpoint_set_stalled(address, stalled);
        }
    }

    fn endpoint_is_stalled(&mut self, address: EndpointAddress) -> bool {
        address.index() < ENDPOINTS && self.0.endpoint_is_stalled(address)
    }

    fn force_reset(&mut self) -> Result<(), Unsupported> {
        self.0.force_reset()
    }

    async fn remote_wakeup(&mut self) -> Result<(), Unsupported> {
        self.0.remote_wakeup().await
    }
}
