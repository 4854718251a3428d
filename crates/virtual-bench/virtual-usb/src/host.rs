//! The host's controller, a packet at a time.

use embassy_usb_driver::Event;

use crate::bus::{Control, MAX_PACKET_BYTES, Status, Wire};

/// The host's end of the bus. Copies share it.
#[derive(Clone, Debug)]
pub struct HostSide(Wire);

/// A control request (USB 2.0, section 9.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named as in the specification")]
pub struct ControlRequest {
    pub request_type: u8,
    pub request: u8,
    pub value: u16,
    pub index: u16,
    pub length: u16,
}

/// Why nothing was transferred.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UsbFailure {
    /// The device refused.
    Stalled,
    /// There is no such endpoint in the present configuration.
    NoEndpoint,
    /// The bus is suspended.
    Suspended,
}

impl HostSide {
    pub(crate) fn new(wire: Wire) -> Self {
        Self(wire)
    }

    /// The device sees a powered bus, and its reset.
    pub fn connect(&self) {
        self.0.lock().events.push_back(Event::PowerDetected);
        self.reset();
    }

    /// Resets the bus, at once and whatever is under way.
    pub fn reset(&self) {
        let mut bus = self.0.lock();
        bus.reset();
        bus.events.push_back(Event::Reset);
    }

    /// Stops all traffic. What the endpoints hold stays there.
    pub fn suspend(&self) {
        let mut bus = self.0.lock();
        bus.is_suspended = true;
        bus.events.push_back(Event::Suspend);
    }

    /// Takes the traffic up again.
    pub fn resume(&self) {
        let mut bus = self.0.lock();
        bus.is_suspended = false;
        bus.events.push_back(Event::Resume);
    }

    /// The address that the device has taken.
    pub fn address(&self) -> u8 {
        self.0.lock().address
    }

    /// Carries out a control request that reads; the data, at most as long as was asked for.
    ///
    /// # Errors
    /// Where the device refuses.
    pub async fn control_in(&self, request: ControlRequest) -> Result<Vec<u8>, UsbFailure> {
        self.begin(request, &[]);
        self.ended().await?;
        let mut bus = self.0.lock();
        Ok(bus.control.data_in.drain(..).flatten().collect())
    }

    /// Carries out a control request that writes `data`.
    ///
    /// # Errors
    /// Where the device refuses.
    pub async fn control_out(
        &self,
        request: ControlRequest,
        data: &[u8],
    ) -> Result<(), UsbFailure> {
        self.begin(request, data);
        self.ended().await
    }

    /// Begins a control request and does not wait for its end.
    pub fn begin(&self, request: ControlRequest, data: &[u8]) {
        let mut setup = [request.request_type, request.request, 0, 0, 0, 0, 0, 0];
        setup[2..4].copy_from_slice(&request.value.to_le_bytes());
        setup[4..6].copy_from_slice(&request.index.to_le_bytes());
        setup[6..8].copy_from_slice(&request.length.to_le_bytes());
        let mut bus = self.0.lock();
        bus.control = Control {
            setup: Some(setup),
            transfer: bus.control.transfer + 1,
            data_out: data.chunks(MAX_PACKET_BYTES).map(<[u8]>::to_vec).collect(),
            ..Control::default()
        };
    }

    async fn ended(&self) -> Result<(), UsbFailure> {
        match self.0.until(|bus| bus.control.status.take()).await {
            Status::Accepted => Ok(()),
            Status::Stalled => Err(UsbFailure::Stalled),
        }
    }

    /// Sends one packet, once the endpoint has room.
    ///
    /// # Errors
    /// Where there is no such endpoint, it is stalled, or the bus carries nothing.
    pub async fn bulk_out(&self, endpoint: u8, packet: &[u8]) -> Result<(), UsbFailure> {
        self.0
            .until(|bus| {
                if bus.is_suspended {
                    return Some(Err(UsbFailure::Suspended));
                }
                let buffer = bus.outs.get_mut(usize::from(endpoint))?;
                if !buffer.is_enabled {
                    return Some(Err(UsbFailure::NoEndpoint));
                }
                if buffer.is_stalled {
                    return Some(Err(UsbFailure::Stalled));
                }
                if buffer.packet.is_some() {
                    return None;
                }
                buffer.packet = Some(packet.to_vec());
                Some(Ok(()))
            })
            .await
    }

    /// Fetches one packet, once the endpoint holds one. `endpoint` is its number without the bit of
    /// its direction.
    ///
    /// # Errors
    /// Where there is no such endpoint, it is stalled, or the bus carries nothing.
    pub async fn bulk_in(&self, endpoint: u8) -> Result<Vec<u8>, UsbFailure> {
        self.0
            .until(|bus| {
                if bus.is_suspended {
                    return Some(Err(UsbFailure::Suspended));
                }
                let buffer = bus.ins.get_mut(usize::from(endpoint))?;
                if !buffer.is_enabled {
                    return Some(Err(UsbFailure::NoEndpoint));
                }
                if buffer.is_stalled {
                    return Some(Err(UsbFailure::Stalled));
                }
                buffer.packet.take().map(Ok)
            })
            .await
    }
}
