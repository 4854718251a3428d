//! How a host gets to know a device (USB 2.0, section 9.1.2; the order is Linux').

use super::transfer::Request;

/// What a device says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// The device descriptor.
    pub device: Vec<u8>,
    /// The configuration descriptor with all that belongs to it.
    pub configuration: Vec<u8>,
    /// Its serial number.
    pub serial: String,
    /// The numbers of the bulk endpoints to and from the device.
    pub endpoints: (u8, u8),
}

/// What the host does next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Next {
    Reset,
    Address(u8),
    Pause(f64),
    Request(Request),
    Nothing,
}

const TO_HOST: u8 = 0x80;
const TO_DEVICE: u8 = 0x00;
const SET_ADDRESS: u8 = 5;
const GET_DESCRIPTOR: u8 = 6;
const SET_CONFIGURATION: u8 = 9;

const DEVICE: u8 = 1;
const CONFIGURATION: u8 = 2;
const STRING: u8 = 3;
const ENDPOINT: u8 = 5;
const BULK: u8 = 2;

const DEVICE_BYTES: usize = 18;
const CONFIGURATION_BYTES: usize = 9;
/// The address that the host gives.
const ADDRESS: u8 = 17;
/// A device has so long to take it (USB 2.0, section 9.2.6.3).
const ADDRESS_S: f64 = 2e-3;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Step {
    #[default]
    FirstLook,
    SecondReset,
    GiveAddress,
    UseAddress,
    WaitForAddress,
    Device,
    Serial,
    ConfigurationHead,
    Configuration,
    Configure,
    Done,
}

/// Where the enumeration is.
#[derive(Clone, Debug, Default)]
pub(super) struct Enumeration {
    step: Step,
    device: Vec<u8>,
    configuration: Vec<u8>,
    serial: String,
    known: Option<Device>,
}

fn descriptor(kind: u8, index: u8, length: usize) -> Next {
    Next::Request(Request {
        kind: TO_HOST,
        request: GET_DESCRIPTOR,
        value: u16::from(kind) << 8 | u16::from(index),
        length: length as u16,
    })
}

fn set(request: u8, value: u16) -> Next {
    Next::Request(Request {
        kind: TO_DEVICE,
        request,
        value,
        length: 0,
    })
}

impl Enumeration {
    pub(super) fn device(&self) -> Option<&Device> {
        self.known.as_ref()
    }

    /// The largest packet of endpoint 0, as far as the device has said it.
    pub(super) fn packet_bytes(&self) -> usize {
        self.device.get(7).map_or(8, |bytes| usize::from(*bytes))
    }

    /// What to do next; a step without a request is over by that.
    pub(super) fn next(&mut self) -> Next {
        let index_of_serial = self.device.get(16).copied().unwrap_or_default();
        match self.step {
            // Linux asks for 64 bytes and takes the first packet; 8 bytes say as much.
            Step::FirstLook => descriptor(DEVICE, 0, 8),
            Step::SecondReset => self.over(Step::GiveAddress, Next::Reset),
            Step::GiveAddress => set(SET_ADDRESS, ADDRESS.into()),
            Step::UseAddress => self.over(Step::WaitForAddress, Next::Address(ADDRESS)),
            Step::WaitForAddress => self.over(Step::Device, Next::Pause(ADDRESS_S)),
            Step::Device => descriptor(DEVICE, 0, DEVICE_BYTES),
            Step::Serial => descriptor(STRING, index_of_serial, 255),
            Step::ConfigurationHead => descriptor(CONFIGURATION, 0, CONFIGURATION_BYTES),
            Step::Configuration => {
                let total = [self.configuration[2], self.configuration[3]];
                descriptor(CONFIGURATION, 0, u16::from_le_bytes(total).into())
            }
            Step::Configure => set(SET_CONFIGURATION, self.configuration[5].into()),
            Step::Done => Next::Nothing,
        }
    }

    fn over(&mut self, step: Step, next: Next) -> Next {
        self.step = step;
        next
    }

    /// Takes the answer to the last request.
    pub(super) fn take(&mut self, data: &[u8]) -> Result<(), String> {
        self.step = match self.step {
            Step::FirstLook => {
                check(data, DEVICE, 8)?;
                self.device = data.to_vec();
                Step::SecondReset
            }
            Step::GiveAddress => Step::UseAddress,
            Step::Device => {
                check(data, DEVICE, DEVICE_BYTES)?;
                self.device = data.to_vec();
                Step::Serial
            }
            Step::Serial => {
                check(data, STRING, 2)?;
                let units: Vec<u16> = data[2..]
                    .as_chunks()
                    .0
                    .iter()
                    .map(|unit| u16::from_le_bytes(*unit))
                    .collect();
                self.serial = String::from_utf16_lossy(&units);
                Step::ConfigurationHead
            }
            Step::ConfigurationHead => {
                check(data, CONFIGURATION, CONFIGURATION_BYTES)?;
                self.configuration = data.to_vec();
                Step::Configuration
            }
            Step::Configuration => {
                let total = u16::from_le_bytes([self.configuration[2], self.configuration[3]]);
                check(data, CONFIGURATION, total.into())?;
                self.configuration = data.to_vec();
                Step::Configure
            }
            Step::Configure => {
                self.known = Some(Device {
                    device: self.device.clone(),
                    configuration: self.configuration.clone(),
                    serial: self.serial.clone(),
                    endpoints: bulk_endpoints(&self.configuration)?,
                });
                Step::Done
            }
            step => step,
        };
        Ok(())
    }
}

/// Whether a descriptor is of its kind and whole.
fn check(data: &[u8], kind: u8, bytes: usize) -> Result<(), String> {
    match data {
        [_, there, ..] if *there == kind && data.len() >= bytes => Ok(()),
        _ => Err(format!(
            "descriptor {kind} is not one of {bytes} bytes: {data:02x?}"
        )),
    }
}

/// The numbers of the bulk endpoints of either direction.
fn bulk_endpoints(configuration: &[u8]) -> Result<(u8, u8), String> {
    let (mut out, mut in_) = (None, None);
    let mut rest = configuration;
    while let [length, kind, ..] = *rest {
        if let (ENDPOINT, [_, _, address, attributes, ..]) = (kind, rest)
            && attributes & 3 == BULK
        {
            match address & 0x80 {
                0 => out = Some(address & 0xf),
                _ => in_ = Some(address & 0xf),
            }
        }
        rest = rest.get(usize::from(length).max(2)..).unwrap_or_default();
    }
    out.zip(in_)
        .ok_or("the configuration has no pair of bulk endpoints".to_owned())
}
