//! The host at the board's bus: carries frames between tools and device, and stops.

use std::cell::Cell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Poll;

use embassy_futures::join::join;
use embassy_futures::{poll_once, yield_now};
use emulated_board::{StopFifos, ToolLink};
use firmware_on_host::{Device, enumerate};
use mirror_protocol::usb::STOP_REQUEST;
use virtual_usb::{ControlRequest, HostSide, MAX_PACKET_BYTES, UsbFailure};

/// Polls from one look at the tool's socket and the stops to the next, each a control tick of 0.1 ms: a look takes as long as
/// a tick of the firmware, and a frame of USB is 1 ms.
const LOOK_POLLS: u32 = 4;

/// Vendor requests to the device, in either direction (USB 2.0, table 9-2).
const TO_DEVICE: u8 = 0x40;
const TO_HOST: u8 = 0xc0;

/// Whether the board's time stands. A tool that gets no processor takes no frames, and the device, which waits for a host for some
/// milliseconds of its time, would give up samples and answers: an emulated board waits for its tool rather than losing them. A
/// stop waits for nobody.
#[derive(Debug, Default)]
pub(crate) struct HostTime {
    has_no_room: Cell<bool>,
    is_stopping: Cell<bool>,
}

impl HostTime {
    /// Whether the board is to be left alone until the tool takes frames again.
    pub(crate) fn stands(&self) -> bool {
        self.has_no_room.get() && !self.is_stopping.get()
    }
}

/// A host in front of the bus, and behind it a tool's socket and the FIFOs of stops.
pub(crate) struct UsbHost {
    pub(crate) bus: HostSide,
    pub(crate) link: ToolLink,
    pub(crate) stops: StopFifos,
}

impl UsbHost {
    /// Comes to know the device, then serves for ever. A device that refuses is none, and is not served.
    pub(crate) async fn run(self, is_known: &AtomicBool, time: &HostTime) {
        let Self { bus, link, stops } = self;
        let Ok(device) = enumerate(&bus).await else {
            return;
        };
        is_known.store(true, Ordering::Relaxed);
        join(
            carry_frames(&bus, Tool::at(link), &device, time),
            carry_stops(&bus, stops, time),
        )
        .await;
    }
}

async fn carry_frames(
    bus: &HostSide,
    mut tool: Tool,
    device: &Device,
    time: &HostTime,
) -> Infallible {
    let (out, in_) = device.endpoints;
    let mut polls = 0_u32;
    loop {
        if polls.is_multiple_of(LOOK_POLLS) {
            tool.look();
        }
        if let Some(packet) = tool.to_device.front()
            && poll_once(bus.bulk_out(out, packet)).is_ready()
        {
            tool.to_device.pop_front();
        }
        // Without a tool nobody asks the device for any frame, and its samples wait.
        if tool.link.has_room()
            && tool.link.is_connected()
            && let Poll::Ready(Ok(packet)) = poll_once(bus.bulk_in(in_))
        {
            tool.take(&packet);
        }
        let has_no_room = tool.link.is_connected() && !tool.link.has_room();
        time.has_no_room.set(has_no_room);
        polls = polls.wrapping_add(1);
        yield_now().await;
    }
}

async fn carry_stops(bus: &HostSide, mut stops: StopFifos, time: &HostTime) -> Infallible {
    loop {
        for _ in 0..LOOK_POLLS {
            yield_now().await;
        }
        let marks = stops.take();
        if marks.is_empty() {
            continue;
        }
        time.is_stopping.set(true);
        if stop(bus).await.is_ok() {
            stops.tell(&marks);
        }
        time.is_stopping.set(false);
    }
}

/// Stops the board, and waits until a control tick has carried it out.
async fn stop(bus: &HostSide) -> Result<(), UsbFailure> {
    bus.control_out(request(TO_DEVICE, 0), &[]).await?;
    while bus.control_in(request(TO_HOST, 1)).await? == [0] {}
    Ok(())
}

/// A tool, and its frames on their way.
struct Tool {
    link: ToolLink,
    /// Packets that wait for room in the device.
    to_device: VecDeque<Vec<u8>>,
    /// The packets of a frame that is not yet whole.
    arrived: Vec<u8>,
}

impl Tool {
    fn at(link: ToolLink) -> Self {
        Self {
            link,
            to_device: VecDeque::new(),
            arrived: Vec::new(),
        }
    }

    /// Takes what has come from the tool, and sends what is to go to it.
    fn look(&mut self) {
        if !self.link.has_tool() {
            self.arrived.clear();
        }
        for frame in self.link.exchange() {
            let fills_packets = frame.len().is_multiple_of(MAX_PACKET_BYTES);
            self.to_device
                .extend(frame.chunks(MAX_PACKET_BYTES).map(<[u8]>::to_vec));
            // A packet that is not full ends a frame.
            self.to_device.extend(fills_packets.then(Vec::new));
        }
    }

    /// Takes a packet of the device's.
    fn take(&mut self, packet: &[u8]) {
        self.arrived.extend(packet);
        if packet.len() < MAX_PACKET_BYTES {
            self.link.send(&std::mem::take(&mut self.arrived));
        }
    }
}

fn request(request_type: u8, length: u16) -> ControlRequest {
    ControlRequest {
        request_type,
        request: STOP_REQUEST,
        value: 0,
        index: 0,
        length,
    }
}
