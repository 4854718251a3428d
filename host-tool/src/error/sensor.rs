//! What to do about a sensor by whose readings a mirror cannot be calibrated.

use calibration_procedure::SensorError;

/// Where all that it read is one number, that is what is wrong with it, whatever its range is.
pub(super) fn sensor_advice(error: &SensorError) -> &'static str {
    let counts = &error.counts;
    let read = counts.asked - counts.missing.min(counts.asked);
    match read > 0 && counts.clipped == read {
        true => {
            "all that it read is one number while the mirror moved: is it frozen, slower than the mirror, or is its spot beside the plate? Look at \
             what it reads as you move the mirror with `host-tool set-z`. The board has the calibration of before"
        }
        false => {
            "look at what it reads with `host-tool record`: is its spot on the plate, and its range as long as the mirror's? The board has the \
             calibration of before"
        }
    }
}

#[cfg(test)]
mod tests {
    use calibration_procedure::ReadingCounts;

    use super::*;

    #[test]
    fn a_sensor_that_reads_one_number_is_told_as_frozen() {
        let advice = |missing, outlying, clipped| {
            sensor_advice(&SensorError {
                experiment: "sine_20".to_owned(),
                counts: ReadingCounts {
                    asked: 300,
                    missing,
                    outlying,
                    clipped,
                },
            })
        };
        for (missing, outlying, clipped) in [(0, 0, 300), (100, 0, 200)] {
            assert!(advice(missing, outlying, clipped).contains("is it frozen"));
        }
        for (missing, outlying, clipped) in [(0, 10, 200), (300, 0, 0)] {
            assert!(advice(missing, outlying, clipped).contains("its range as long"));
        }
    }
}
