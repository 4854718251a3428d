//! What to do where a calibration is not kept.

use calibration_procedure::{Doubt, Drift};

/// What a person can look at, the likeliest first, and what to do after that.
pub(super) fn doubt_advice(doubt: &Doubt) -> &'static str {
    match doubt {
        // At rest a late sensor reads as one that is not, and what disturbs for a moment is in the mean of a dwell.
        Doubt::MovesWorse { .. } => {
            "in this order: is the sensor late? Name with --sensor-lag how late its maker says it is, and calibrate again. Was \
             the mirror touched or driven by something else meanwhile, or is there a draught? Shield it and calibrate again, \
             without --quick. If it stays, look at what the sensor reads on a move with `host-tool record`, and at what the \
             model lacks with `host-tool compare`"
        }
        Doubt::WorseThanBefore { .. } | Doubt::BrokenPromise { .. } => {
            "look at what the sensor reads with `host-tool record`, then calibrate again without --quick; if it stays, \
             `host-tool compare` shows what the model lacks"
        }
    }
}

/// What a person can look at where something moved meanwhile, and what to do after that.
pub(super) fn drift_advice(drift: &Drift) -> &'static str {
    match drift {
        Drift::NoRest { .. } | Drift::Jump { .. } => {
            "are sensor, stage and mirror held, and is the room still? See with `host-tool record` what the sensor reads of a mirror at rest, \
             and calibrate again"
        }
        Drift::OtherMirror { .. } => {
            "give --from the folder of this mirror's session, or leave --from out: `calibrate --keep FOLDER` measures one"
        }
        Drift::Room { .. } => {
            "let the room and whatever warms the mirror come to rest, and calibrate again; what a kelvin is worth `host-tool calibrate-room` \
             measures afterwards"
        }
        Drift::Air { .. } => {
            "is there a draught, was the mirror's cover taken off, or the chamber pumped? Shield it, and calibrate again"
        }
        Drift::Moved { .. } => {
            "was the sensor, its spot or the stage touched? Fasten them, let both come to rest, and calibrate again"
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::error::ToolError;
    use calibration_procedure::Doubt;
    use miette::Diagnostic;

    fn help(doubt: Doubt) -> String {
        let error = ToolError::from(doubt);
        error.help().expect("every error says it").to_string()
    }

    #[test]
    fn moves_that_are_worse_have_causes_that_a_person_can_check_in_their_order() {
        let help = help(Doubt::MovesWorse {
            figure: "the loop at 20 Hz",
            unit: "um",
            before: 0.1,
            after: 2.0,
        });
        let at = |words: &str| {
            help.find(words)
                .unwrap_or_else(|| panic!("{words}: {help}"))
        };
        let places = [
            "--sensor-lag",
            "touched or driven",
            "draught",
            "without --quick",
            "host-tool record",
            "host-tool compare",
        ]
        .map(at);
        assert!(places.is_sorted(), "{help}");
    }

    #[test]
    fn a_mirror_that_rests_worse_is_not_asked_for_a_late_sensor() {
        let help = help(Doubt::BrokenPromise {
            promised_rms_um: 0.1,
            after_rms_um: 5.0,
        });
        assert!(!help.contains("--sensor-lag"), "{help}");
        assert!(help.contains("host-tool record"), "{help}");
    }
}
