//! The device's controller.

use embassy_usb_driver::{
    Bus, ControlPipe, Direction, Driver, Endpoint, EndpointAddress, EndpointAllocError,
    EndpointError, EndpointIn, EndpointInfo, EndpointOut, EndpointType, Event, Unsupported,
};

use crate::bus::{Control, Endpoint as Buffer, MAX_PACKET_BYTES, Status, Wire};

/// The controller before the device starts.
#[derive(Debug)]
pub struct DeviceSide(Wire);

/// The controller of a device that runs.
#[derive(Debug)]
pub struct DeviceBus(Wire);

/// The control endpoint.
#[derive(Debug)]
pub struct DeviceControl {
    wire: Wire,
    /// The transfer that is answered.
    transfer: u64,
}

/// A bulk endpoint, either way.
#[derive(Debug)]
pub struct DeviceEndpoint {
    wire: Wire,
    info: EndpointInfo,
}

impl DeviceSide {
    pub(crate) fn new(wire: Wire) -> Self {
        Self(wire)
    }

    fn allocate(
        &mut self,
        direction: Direction,
        ep_type: EndpointType,
        max_packet_size: u16,
        interval_ms: u8,
    ) -> Result<DeviceEndpoint, EndpointAllocError> {
        let fits = usize::from(max_packet_size) <= MAX_PACKET_BYTES;
        let mut bus = self.0.lock();
        let buffers = match direction {
            Direction::Out => &mut bus.outs,
            Direction::In => &mut bus.ins,
        };
        // Number 0 is the control endpoint.
        let free = (1..buffers.len()).find(|index| !buffers[*index].is_allocated);
        let (Some(index), true) = (free, fits) else {
            return Err(EndpointAllocError);
        };
        buffers[index].is_allocated = true;
        Ok(DeviceEndpoint {
            wire: self.0.clone(),
            info: EndpointInfo {
                addr: EndpointAddress::from_parts(index, direction),
                ep_type,
                max_packet_size,
                interval_ms,
            },
        })
    }
}

impl Driver<'static> for DeviceSide {
    type EndpointOut = DeviceEndpoint;
    type EndpointIn = DeviceEndpoint;
    type ControlPipe = DeviceControl;
    type Bus = DeviceBus;

    fn alloc_endpoint_out(
        &mut self,
        ep_type: EndpointType,
        _ep_addr: Option<EndpointAddress>,
        max_packet_size: u16,
        interval_ms: u8,
    ) -> Result<DeviceEndpoint, EndpointAllocError> {
        self.allocate(Direction::Out, ep_type, max_packet_size, interval_ms)
    }

    fn alloc_endpoint_in(
        &mut self,
        ep_type: EndpointType,
        _ep_addr: Option<EndpointAddress>,
        max_packet_size: u16,
        interval_ms: u8,
    ) -> Result<DeviceEndpoint, EndpointAllocError> {
        self.allocate(Direction::In, ep_type, max_packet_size, interval_ms)
    }

    fn start(self, _control_max_packet_size: u16) -> (DeviceBus, DeviceControl) {
        let control = DeviceControl {
            wire: self.0.clone(),
            transfer: 0,
        };
        (DeviceBus(self.0), control)
    }
}

impl DeviceBus {
    fn endpoint<T>(&self, address: EndpointAddress, act: impl FnOnce(&mut Buffer) -> T) -> T {
        let mut bus = self.0.lock();
        act(match address.direction() {
            Direction::Out => &mut bus.outs[address.index()],
            Direction::In => &mut bus.ins[address.index()],
        })
    }
}

impl Bus for DeviceBus {
    async fn enable(&mut self) {}

    async fn disable(&mut self) {}

    async fn poll(&mut self) -> Event {
        self.0.until(|bus| bus.events.pop_front()).await
    }

    fn endpoint_set_enabled(&mut self, ep_addr: EndpointAddress, enabled: bool) {
        self.endpoint(ep_addr, |buffer| {
            buffer.is_enabled = enabled;
            buffer.packet = None;
        });
    }

    fn endpoint_set_stalled(&mut self, ep_addr: EndpointAddress, stalled: bool) {
        self.endpoint(ep_addr, |buffer| buffer.is_stalled = stalled);
    }

    fn endpoint_is_stalled(&mut self, ep_addr: EndpointAddress) -> bool {
        self.endpoint(ep_addr, |buffer| buffer.is_stalled)
    }

    async fn remote_wakeup(&mut self) -> Result<(), Unsupported> {
        Err(Unsupported)
    }
}

impl Endpoint for DeviceEndpoint {
    fn info(&self) -> &EndpointInfo {
        &self.info
    }

    async fn wait_enabled(&mut self) {
        let index = self.info.addr.index();
        let is_in = self.info.addr.is_in();
        self.wire
            .until(|bus| {
                let buffer = match is_in {
                    true => &bus.ins[index],
                    false => &bus.outs[index],
                };
                buffer.is_enabled.then_some(())
            })
            .await;
    }
}

impl EndpointOut for DeviceEndpoint {
    async fn read(&mut self, buf: &mut [u8]) -> Result<usize, EndpointError> {
        let index = self.info.addr.index();
        let packet = self.wire.until(|bus| {
            let buffer = &mut bus.outs[index];
            match buffer.is_enabled {
                true => buffer.packet.take().map(Ok),
                false => Some(Err(EndpointError::Disabled)),
            }
        });
        let packet = packet.await?;
        let target = buf
            .get_mut(..packet.len())
            .ok_or(EndpointError::BufferOverflow)?;
        target.copy_from_slice(&packet);
        Ok(packet.len())
    }
}

impl EndpointIn for DeviceEndpoint {
    async fn write(&mut self, buf: &[u8]) -> Result<(), EndpointError> {
        if buf.len() > usize::from(self.info.max_packet_size) {
            return Err(EndpointError::BufferOverflow);
        }
        let index = self.info.addr.index();
        self.wire
            .until(|bus| {
                let buffer = &mut bus.ins[index];
                if !buffer.is_enabled {
                    return Some(Err(EndpointError::Disabled));
                }
                if buffer.packet.is_some() {
                    return None;
                }
                buffer.packet = Some(buf.to_vec());
                Some(Ok(()))
            })
            .await
    }
}

impl DeviceControl {
    /// Acts on the control endpoint, unless the host has begun another transfer since.
    fn answer(&self, act: impl FnOnce(&mut Control)) -> Result<(), EndpointError> {
        let mut bus = self.wire.lock();
        if bus.control.transfer != self.transfer {
            return Err(EndpointError::Disabled);
        }
        act(&mut bus.control);
        Ok(())
    }

    fn end(&self, status: Status) {
        // Where the host has gone on, nobody waits for the status.
        let _ = self.answer(|control| control.status = Some(status));
    }
}

impl ControlPipe for DeviceControl {
    fn max_packet_size(&self) -> usize {
        MAX_PACKET_BYTES
    }

    async fn setup(&mut self) -> [u8; 8] {
        let fetched = self.wire.until(|bus| {
            let setup = bus.control.setup.take()?;
            Some((setup, bus.control.transfer))
        });
        let (setup, transfer) = fetched.await;
        self.transfer = transfer;
        setup
    }

    async fn data_out(
        &mut self,
        buf: &mut [u8],
        _first: bool,
        _last: bool,
    ) -> Result<usize, EndpointError> {
        let transfer = self.transfer;
        let packet = self.wire.until(|bus| {
            if bus.control.transfer != transfer {
                return Some(Err(EndpointError::Disabled));
            }
            bus.control.data_out.pop_front().map(Ok)
        });
        let packet = packet.await?;
        buf.get_mut(..packet.len())
            .ok_or(EndpointError::BufferOverflow)?
            .copy_from_slice(&packet);
        Ok(packet.len())
    }

    async fn data_in(
        &mut self,
        data: &[u8],
        _first: bool,
        last: bool,
    ) -> Result<(), EndpointError> {
        self.answer(|control| {
            control.data_in.push_back(data.to_vec());
            if last {
                control.status = Some(Status::Accepted);
            }
        })
    }

    async fn accept(&mut self) {
        self.end(Status::Accepted);
    }

    async fn reject(&mut self) {
        self.end(Status::Stalled);
    }

    async fn accept_set_address(&mut self, addr: u8) {
        self.wire.lock().address = addr;
        self.end(Status::Accepted);
    }
}
