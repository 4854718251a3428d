//! What is wrong with a sensor, and what to do about one by whose readings a mirror cannot be calibrated.

use std::path::PathBuf;

use calibration_procedure::SensorError;

/// Why a sensor does not tell where the mirror is.
#[derive(Debug, thiserror::Error, miette::Diagnostic, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[expect(missing_docs, reason = "each message says what its fields are")]
pub enum SensorFault {
    #[error("the board reads no position sensor: none is at its input, or it is silent")]
    #[diagnostic(help(
        "is it switched on, and does it see the mirror? One that is not at the board is named: --sensor /dev/ttyACM0, or --sensor FILE for a recording"
    ))]
    NoSensor,

    #[error("the sensor at {} cannot be read: {reason}", path.display())]
    #[diagnostic(help(
        "a serial sensor sends lines of micrometres (`/dev/ttyUSB0@115200` sets its speed); a recording has \
         lines of seconds and micrometres, `0.5,12.3`, the experiment beginning at 0"
    ))]
    Sensor { path: PathBuf, reason: String },

    #[error("{} is no sensor that can be read at any time, as this asks for: {reason}", path.display())]
    #[diagnostic(help(
        "name the board's own sensor, `board`, or a serial one, such as /dev/ttyACM0; a recording is for `host-tool measure`"
    ))]
    NotAtAnyTime { path: PathBuf, reason: &'static str },

    #[error(
        "the sensor seems to count in another unit than micrometres: {numbers} of its numbers are beyond {longest_um} um, up to {largest_um:.0}, \
         which no mirror reaches"
    )]
    #[diagnostic(help(
        "does it count in nm? Have it send micrometres, and calibrate again. The board has the calibration of before"
    ))]
    OtherUnit {
        numbers: usize,
        largest_um: f64,
        longest_um: f64,
    },

    #[error(
        "the board did not drive what was asked for when the sensor was read: {found}; that reading is not kept"
    )]
    #[diagnostic(help(
        "ask for it again, and measure this point once more; what was read before stays. A board ramps to zero where the machine of this \
         tool sleeps or has no time for it: `host-tool explain lease-lapsed` says more"
    ))]
    DrivenOtherwise { found: String },

    #[error(
        "the sensor read {read_um:+.3} um where the stage was to have moved the mirror by {moved_um:+.3} um: {found} That reading is not kept"
    )]
    #[diagnostic(help(
        "a height is how far the stage has moved the whole mirror towards the side of the substrate, where positions count to; move it there, and measure the reference again"
    ))]
    StageUnseen {
        moved_um: f64,
        read_um: f64,
        found: &'static str,
    },
}

/// Where all that it read is one number, that is what is wrong with it, whatever its range is.
pub(super) fn sensor_advice(error: &SensorError) -> &'static str {
    let counts = &error.counts;
    let read = counts.asked - counts.missing.min(counts.asked);
    let is_frozen = read > 0 && counts.clipped == read;
    match (is_frozen, counts.repeated > counts.without_weight() / 2) {
        (true, _) => {
            "all that it read is one number while the mirror moved: is it frozen, slower than the mirror, or is its spot beside the plate? Look at \
             what it reads as you move the mirror with `host-tool set-z`. The board has the calibration of before"
        }
        (false, true) => {
            "does it stall, or does what passes its readings on? Each reading is to be of the moment in which it is read; see with `host-tool record`. The board \
             has the calibration of before"
        }
        (false, false) => {
            "look at what it reads with `host-tool record`: is its spot on the plate, and its range from below the mirror's rest to beyond its \
             highest drive? The board has the calibration of before"
        }
    }
}

#[cfg(test)]
mod tests {
    use calibration_procedure::ReadingCounts;

    use super::*;

    #[test]
    fn a_sensor_that_reads_one_number_is_told_as_frozen() {
        let advice = |missing, outlying, repeated, clipped| {
            sensor_advice(&SensorError {
                experiment: "sine_20".to_owned(),
                counts: ReadingCounts {
                    asked: 300,
                    missing,
                    outlying,
                    repeated,
                    clipped,
                },
            })
        };
        for (missing, clipped) in [(0, 300), (100, 200)] {
            assert!(advice(missing, 0, 0, clipped).contains("is it frozen"));
        }
        for (missing, outlying, clipped) in [(0, 10, 200), (300, 0, 0)] {
            assert!(advice(missing, outlying, 0, clipped).contains("its range from below"));
        }
        assert!(advice(0, 0, 158, 0).contains("does it stall"));
    }
}
