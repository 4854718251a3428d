//! Samples for PlotJuggler: JSON in UDP datagrams, one a sample (its UDP server, with "use field [timestamp]").

use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};

use mirror_protocol::Telemetry;
use serde_json::{Map, Value, json};

use crate::error::ToolError;
use crate::report::decimal;

/// Where samples are sent.
pub(super) struct Receiver(UdpSocket);

impl Receiver {
    /// One at `address`; whether anybody listens there does not matter.
    ///
    /// # Errors
    /// Where that is no address that this machine can send to.
    pub(super) fn open(address: &str) -> Result<Self, ToolError> {
        let open = || {
            let to = address
                .to_socket_addrs()?
                .next()
                .ok_or(std::io::ErrorKind::NotFound)?;
            let from: SocketAddr = match to {
                SocketAddr::V4(_) => ([0, 0, 0, 0], 0).into(),
                SocketAddr::V6(_) => ([0_u16; 8], 0).into(),
            };
            let socket = UdpSocket::bind(from)?;
            socket.connect(to)?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        open().map(Self).map_err(|source| ToolError::Address {
            address: address.to_owned(),
            source,
        })
    }

    /// Sends a sample of a board with so many control ticks a second. One that finds no room, or nobody, is lost, as
    /// with any datagram.
    pub(super) fn send(&self, sample: &Telemetry, tick_hz: u32) {
        let _ = self
            .0
            .send(datagram(sample, tick_hz).to_string().as_bytes());
    }
}

/// A sample; names are those of the columns of measurement files, where these have them.
fn datagram(sample: &Telemetry, tick_hz: u32) -> Value {
    let mut mirror = Map::new();
    let mut put = |name: String, value: Option<f32>| {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            mirror.insert(name, json!(decimal(value)));
        }
    };
    for i in 0..4 {
        put(format!("V{}_V", i + 1), Some(sample.drive_v[i]));
        put(format!("I{}_A", i + 1), Some(sample.current_a[i]));
        put(format!("dT{}_K", i + 1), sample.temperature_k[i]);
    }
    put("z_um".to_owned(), sample.sensor_z_um);
    put("pose_z_um".to_owned(), Some(sample.pose.z_um));
    let [tilt_x_rad, tilt_y_rad] = sample
        .pose
        .tilt_rad
        .map_or([None; 2], |tilts| tilts.map(Some));
    put(
        "pose_tilt_x_deg".to_owned(),
        tilt_x_rad.map(f32::to_degrees),
    );
    put(
        "pose_tilt_y_deg".to_owned(),
        tilt_y_rad.map(f32::to_degrees),
    );
    let uncertainty = sample.uncertainty;
    put(
        "uncertainty_z_um".to_owned(),
        uncertainty.map(|told| 1e-3 * f32::from(told.z_nm)),
    );
    put(
        "settles_in_ms".to_owned(),
        sample.settles_in_ms.map(f32::from),
    );
    mirror.insert("limits".to_owned(), json!(sample.limits));
    json!({
        "timestamp": f64::from(sample.tick) / f64::from(tick_hz),
        "mirror": mirror,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_arrives_as_json_and_what_is_unknown_is_left_out() {
        let server = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        let address = server.local_addr().expect("it has one").to_string();
        let receiver = Receiver::open(&address).expect("an address");
        let sample = Telemetry {
            tick: 12_345,
            drive_v: [1.9, 0.0, 0.0, 0.0],
            temperature_k: [Some(48.8), None, Some(f32::NAN), None],
            sensor_z_um: Some(16.5),
            limits: 4,
            ..Telemetry::default()
        };
        receiver.send(&sample, 10_000);
        let mut bytes = [0; 2000];
        let length = server.recv(&mut bytes).expect("a datagram");
        let told: Value = serde_json::from_slice(&bytes[..length]).expect("JSON");
        assert_eq!(told["timestamp"], 1.2345);
        let mirror = told["mirror"].as_object().expect("an object");
        assert_eq!(
            (&mirror["V1_V"], &mirror["dT1_K"]),
            (&json!(1.9), &json!(48.8))
        );
        assert_eq!(
            (&mirror["z_um"], &mirror["limits"]),
            (&json!(16.5), &json!(4))
        );
        for absent in ["dT2_K", "dT3_K", "pose_tilt_x_deg"] {
            assert!(!mirror.contains_key(absent), "{absent}: {told}");
        }
    }

    #[test]
    fn nobody_listening_is_no_failure_and_no_address_is_one() {
        let free = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        let address = free.local_addr().expect("it has one").to_string();
        drop(free);
        let receiver = Receiver::open(&address).expect("an address");
        for _ in 0..3 {
            receiver.send(&Telemetry::default(), 10_000);
        }
        assert!(Receiver::open("127.0.0.1").is_err(), "no port");
    }
}
