//! Frames over the bus, as the host tool's USB library sends them: in packets of 64 bytes, ended by a
//! shorter one, which may be empty.

use mirror_protocol::{ERROR_PATH, WireError};
use postcard_rpc::header::VarSeqKind;
use postcard_rpc::host_client::{HostClient, WireRx, WireSpawn, WireTx};
use virtual_usb::{HostSide, MAX_PACKET_BYTES, UsbFailure};

use crate::Device;

const QUEUED_REQUESTS: usize = 8;

/// A client on an enumerated device.
pub fn connect(host: &HostSide, device: &Device) -> HostClient<WireError> {
    let (out, in_) = device.endpoints;
    HostClient::new_with_wire(
        UsbTx(host.clone(), out),
        UsbRx(host.clone(), in_),
        Tasks,
        VarSeqKind::Seq2,
        ERROR_PATH,
        QUEUED_REQUESTS,
    )
}

/// Sends a frame in packets to the endpoint `out`, the last of them short.
///
/// # Errors
/// As of the bus.
pub async fn send_frame(host: &HostSide, out: u8, frame: &[u8]) -> Result<(), UsbFailure> {
    for packet in frame.chunks(MAX_PACKET_BYTES) {
        host.bulk_out(out, packet).await?;
    }
    if frame.len().is_multiple_of(MAX_PACKET_BYTES) {
        host.bulk_out(out, &[]).await?;
    }
    Ok(())
}

struct UsbTx(HostSide, u8);
struct UsbRx(HostSide, u8);
struct Tasks;

/// A failure of the bus, as the client asks for it.
#[derive(Debug)]
struct Lost(UsbFailure);

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

impl std::error::Error for Lost {}

impl WireTx for UsbTx {
    type Error = Lost;

    async fn send(&mut self, frame: Vec<u8>) -> Result<(), Lost> {
        send_frame(&self.0, self.1, &frame).await.map_err(Lost)
    }
}

impl WireRx for UsbRx {
    type Error = Lost;

    async fn receive(&mut self) -> Result<Vec<u8>, Lost> {
        let mut frame = Vec::new();
        loop {
            let packet = self.0.bulk_in(self.1).await.map_err(Lost)?;
            frame.extend(&packet);
            if packet.len() < MAX_PACKET_BYTES {
                return Ok(frame);
            }
        }
    }
}

impl WireSpawn for Tasks {
    fn spawn(&mut self, task: impl Future<Output = ()> + Send + 'static) {
        drop(tokio::spawn(task));
    }
}
