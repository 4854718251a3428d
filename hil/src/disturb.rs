//! What can go wrong on a link.

use mirror_protocol::StatusEndpoint;

use crate::RawLink;

/// A kind of disturbance.
#[derive(Clone, Copy)]
pub struct Disturbance {
    /// What it is.
    pub name: &'static str,
    bytes: fn(&mut RawLink, &mut u32) -> Vec<u8>,
}

/// All kinds.
pub const DISTURBANCES: [Disturbance; 4] = [
    Disturbance {
        name: "noise",
        bytes: |_, seed| random(seed, 200),
    },
    Disturbance {
        name: "partial frame",
        bytes: |link, seed| {
            let mut frame = link.request::<StatusEndpoint>(&());
            frame.truncate(1 + *seed as usize % (frame.len() - 1));
            random(seed, 1);
            frame
        },
    },
    Disturbance {
        name: "one bit wrong",
        bytes: |link, seed| {
            let mut frame = link.request::<StatusEndpoint>(&());
            let end = frame.len() - 1;
            let place = random(seed, 2);
            frame[usize::from(place[0]) % end] ^= 1 << (place[1] % 8);
            frame
        },
    },
    Disturbance {
        name: "flood of 50 frames",
        bytes: |link, _| {
            (0..50)
                .flat_map(|_| link.request::<StatusEndpoint>(&()))
                .collect()
        },
    },
];

impl Disturbance {
    /// Sends one of this kind, drawn from `seed`, and ends it, so that the next frame can be a good one.
    ///
    /// # Panics
    /// Where the link is gone.
    pub fn send(&self, link: &mut RawLink, seed: &mut u32) {
        let bytes = (self.bytes)(link, seed);
        link.send_bytes(&bytes).expect("the link is there");
        link.send_bytes(&[0]).expect("the link is there");
    }
}

fn random(seed: &mut u32, bytes: usize) -> Vec<u8> {
    let mut byte = || {
        *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (*seed >> 24) as u8
    };
    (0..bytes).map(|_| byte()).collect()
}
