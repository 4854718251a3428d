//! What a host asks of a device that was plugged in (USB 2.0, sections 9.1.2 and 9.4).

use virtual_usb::{ControlRequest, HostSide, UsbFailure};

const DEVICE: u8 = 1;
const CONFIGURATION: u8 = 2;

const TO_HOST: u8 = 0x80;
const TO_DEVICE: u8 = 0x00;
const SET_ADDRESS: u8 = 5;
const GET_DESCRIPTOR: u8 = 6;
const SET_CONFIGURATION: u8 = 9;

/// The address that the host gives.
const ADDRESS: u16 = 17;

/// What a device says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// The device descriptor.
    pub device: Vec<u8>,
    /// The configuration descriptor with all that belongs to it.
    pub configuration: Vec<u8>,
    /// The numbers of the endpoints to and from the device.
    pub endpoints: (u8, u8),
}

/// Resets the bus, reads the descriptors as Linux does, and configures the device.
///
/// # Errors
/// Where the device refuses a request.
pub async fn enumerate(host: &HostSide) -> Result<Device, UsbFailure> {
    host.connect();
    get_descriptor(host, DEVICE, 0, 64).await?;
    host.reset();
    host.control_out(standard(TO_DEVICE, SET_ADDRESS, ADDRESS, 0), &[])
        .await?;
    let device = get_descriptor(host, DEVICE, 0, 18).await?;
    let head = get_descriptor(host, CONFIGURATION, 0, 9).await?;
    let length = u16::from_le_bytes([head[2], head[3]]);
    let configuration = get_descriptor(host, CONFIGURATION, 0, length).await?;
    let value = u16::from(head[5]);
    host.control_out(standard(TO_DEVICE, SET_CONFIGURATION, value, 0), &[])
        .await?;
    let endpoints = endpoints(&configuration);
    Ok(Device {
        device,
        configuration,
        endpoints,
    })
}

/// Reads a descriptor.
///
/// # Errors
/// Where the device has none such.
pub async fn get_descriptor(
    host: &HostSide,
    kind: u8,
    index: u8,
    length: u16,
) -> Result<Vec<u8>, UsbFailure> {
    let value = u16::from(kind) << 8 | u16::from(index);
    host.control_in(standard(TO_HOST, GET_DESCRIPTOR, value, length))
        .await
}

fn standard(request_type: u8, request: u8, value: u16, length: u16) -> ControlRequest {
    ControlRequest {
        request_type,
        request,
        value,
        index: 0,
        length,
    }
}

/// The numbers of the last endpoint of either direction; 0 for none.
fn endpoints(configuration: &[u8]) -> (u8, u8) {
    const ENDPOINT: u8 = 5;
    let mut found = (0, 0);
    let mut rest = configuration;
    while let [length, kind, body @ ..] = rest {
        if *kind == ENDPOINT {
            match body[0] & 0x80 {
                0 => found.0 = body[0],
                _ => found.1 = body[0] & 0x7f,
            }
        }
        rest = rest.get(usize::from(*length).max(2)..).unwrap_or_default();
    }
    found
}
