//! What the owner of a mirror could still state of it, and the mirror with that stated.

use super::MEMBERS;
use super::families::member;
use super::families::stated::{beam, drawn};
use crate::quantile::{quantile, sorted};
use mirror_model::Device;
use mirror_model::device::{Fact, Quantity};

/// Tolerances of usual means: a four-wire measurement that leaves out bond wires (ohm), a microscope's height (um), a mask with
/// its etching and a deposition (parts of the value).
const LEADS_OHM: f64 = 2.0;
const REST_HEIGHT_UM: f64 = 10.0;
const MASK: f64 = 0.02;
const DEPOSITION: f64 = 0.05;

/// Something that could be stated of the mirror.
pub(crate) struct Unknown {
    /// Its key in `[device]`.
    pub(crate) key: &'static str,
    /// What to find out, and how well.
    pub(crate) what: String,
    /// What is known of the mirror, and this besides: as it is in the median member of the ensemble.
    pub(crate) device: Device,
}

/// Everything that could still be stated of a device.
pub(crate) fn unknowns(device: &Device) -> Vec<Unknown> {
    let members: Vec<_> = (0..MEMBERS as u64)
        .map(|seed| member(device, seed).0)
        .collect();
    let median = |quantity| {
        let values = members.iter().filter_map(|config| drawn(config, quantity));
        quantile(&sorted(values), 0.5)
    };
    let of_the_mirror = [
        (
            Quantity::Leads,
            format!("the resistance of the leads within {LEADS_OHM} ohm"),
            LEADS_OHM,
        ),
        (
            Quantity::RestHeight,
            format!("the height of the cold plate within {REST_HEIGHT_UM} um"),
            REST_HEIGHT_UM,
        ),
        (
            Quantity::PlateSide,
            format!("the plate's side within {} %", 100.0 * MASK),
            MASK * median(Quantity::PlateSide),
        ),
        (
            Quantity::PlateThickness,
            format!("the plate's thickness within {} %", 100.0 * DEPOSITION),
            DEPOSITION * median(Quantity::PlateThickness),
        ),
    ];
    let of_the_mirror = of_the_mirror
        .into_iter()
        .filter(|(quantity, ..)| !device.facts.contains_key(quantity))
        .map(|(quantity, what, tolerance)| {
            let mut known = device.clone();
            let fact = Fact {
                value: median(quantity),
                tolerance,
                source: format!("supposed: {what}"),
            };
            known.facts.insert(quantity, fact);
            Unknown {
                key: quantity.name(),
                what,
                device: known,
            }
        });
    let of_the_beam = device.segments.is_empty().then(|| Unknown {
        key: "segments",
        what: format!(
            "the beam's segments, lengths and widths within {} % and films within {} %",
            100.0 * MASK,
            100.0 * DEPOSITION
        ),
        device: Device {
            segments: beam(&members[0], MASK, DEPOSITION),
            ..device.clone()
        },
    });
    of_the_mirror.chain(of_the_beam).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_not_stated_could_still_be() {
        let mut device = Device::default();
        let all = [
            "leads",
            "rest_height",
            "plate_side",
            "plate_thickness",
            "segments",
        ];
        let supposed = unknowns(&device);
        let keys: Vec<_> = supposed.iter().map(|unknown| unknown.key).collect();
        assert_eq!(keys, all);
        let leads = &supposed[0].device.facts[&Quantity::Leads];
        // The middle of 0 to 4.5 times 5 to 9 ohm; of 240 numbers the median is known to 6 % of the range.
        assert!((leads.value - 15.75).abs() < 0.2 * 31.5, "{leads:?}");
        device.facts.insert(Quantity::Leads, leads.clone());
        device.segments.clone_from(&supposed[4].device.segments);
        let supposed = unknowns(&device);
        let keys: Vec<_> = supposed.iter().map(|unknown| unknown.key).collect();
        assert_eq!(keys, all[1..4]);
        // What is known already stays.
        assert!(
            supposed
                .iter()
                .all(|unknown| unknown.device.facts.contains_key(&Quantity::Leads))
        );
    }
}
