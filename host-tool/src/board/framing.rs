//! Frames in a stream of bytes: COBS between zero bytes.

/// Longest frame that is waited for; longer ones are noise.
const MAX_FRAME_BYTES: usize = 4096;

/// A frame as bytes, with the zero that ends it.
pub fn encode(frame: &[u8]) -> Vec<u8> {
    let mut bytes = cobs::encode_vec(frame);
    bytes.push(0);
    bytes
}

/// Finds frames in what arrives.
#[derive(Debug, Default)]
pub struct Decoder {
    arrived: Vec<u8>,
}

impl Decoder {
    /// Where arriving bytes are put.
    pub fn buffer(&mut self) -> &mut Vec<u8> {
        if self.arrived.len() > MAX_FRAME_BYTES {
            self.arrived.clear();
        }
        &mut self.arrived
    }

    /// The next whole frame that has arrived. What does not decode was disturbed, and is passed
    /// over.
    pub fn next_frame(&mut self) -> Option<Vec<u8>> {
        while let Some(end) = self.arrived.iter().position(|byte| *byte == 0) {
            let rest = self.arrived.split_off(end + 1);
            let encoded = std::mem::replace(&mut self.arrived, rest);
            match cobs::decode_vec(&encoded[..end]) {
                Ok(frame) if !frame.is_empty() => return Some(frame),
                _ => {}
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn frames_come_back_after_any_noise_and_in_any_pieces(
            noise in proptest::collection::vec(any::<u8>(), 0..100),
            frames in proptest::collection::vec(
                proptest::collection::vec(any::<u8>(), 1..300), 1..5),
            piece in 1_usize..50,
        ) {
            let mut bytes = noise;
            bytes.push(0);
            frames.iter().for_each(|frame| bytes.extend(encode(frame)));
            let mut decoder = Decoder::default();
            let mut found = Vec::new();
            for piece in bytes.chunks(piece) {
                decoder.buffer().extend(piece);
                found.extend(std::iter::from_fn(|| decoder.next_frame()));
            }
            // Noise may happen to hold frames of its own.
            prop_assert!(found.ends_with(&frames));
        }
    }
}
