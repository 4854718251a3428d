//! A short lease, for whose renewal an emulated board's time stands.

use firmware_on_host::with_client;
use mirror_protocol::{
    Drives, RenewEndpoint, Renewal, SetDriveEndpoint, StatusEndpoint, Stream, StreamEndpoint,
    WireError,
};
use postcard_rpc::host_client::HostClient;

use crate::erased;

const LEASE_MS: u32 = 100;

/// Waits until the board's time stands.
async fn stand_still(client: &HostClient<WireError>) {
    let mut last = None;
    loop {
        let status = client.send_resp::<StatusEndpoint>(&()).await;
        let tick = status.expect("an answer").expect("a status").telemetry.tick;
        if last == Some(tick) {
            return;
        }
        last = Some(tick);
    }
}

#[test]
fn what_is_asked_before_the_renewal_does_not_end_the_lease() {
    with_client(&erased(), async |client| {
        let drives = Drives {
            drive_v: [1.0; 4],
            lease_ms: LEASE_MS,
        };
        let driven = client.send_resp::<SetDriveEndpoint>(&drives).await;
        driven.expect("an answer").expect("it drives");
        for _ in 0..3 {
            stand_still(&client).await;
            let stream = Stream {
                period_ticks: 10,
                count: 1,
                ..Stream::default()
            };
            let begun = client.send_resp::<StreamEndpoint>(&stream).await;
            begun.expect("an answer").expect("a stream");
        }
        let renewal = Renewal { lease_ms: LEASE_MS };
        let renewed = client.send_resp::<RenewEndpoint>(&renewal).await;
        renewed.expect("an answer").expect("it is still driven");
    });
}
