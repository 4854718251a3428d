//! What was drawn of a virtual mirror, as its owner would state it.

use mirror_model::device::{Fact, Film, Quantity, Segment};
use virtual_mirror::{Effect, MirrorConfig};

/// Leads of the virtual mirrors' `series-resistance` at strength 1: the middle of 5 to 9 ohm.
const LEADS_OHM: f64 = 7.0;

/// A quantity of the whole mirror, in its unit; none of a segment's.
pub(in crate::null_ensemble) fn drawn(config: &MirrorConfig, quantity: Quantity) -> Option<f64> {
    match quantity {
        Quantity::Leads => {
            let stated = config.heater.leads_ohm;
            let strength = config.effects.strength(Effect::SeriesResistance);
            Some(LEADS_OHM * strength + stated.iter().sum::<f64>() / stated.len() as f64)
        }
        Quantity::RestHeight => Some(config.shape.rest_height_um),
        Quantity::PlateSide => Some(config.plate.side_um),
        Quantity::PlateThickness => Some(config.plate.silicon_um),
        Quantity::PlateLoss => Some(config.plate.air_loss_uw_k),
        Quantity::Length | Quantity::Width | Quantity::Thickness | Quantity::Loss => None,
    }
}

/// The beam, lengths and widths stated to a part of themselves and thicknesses to another.
pub(in crate::null_ensemble) fn beam(
    config: &MirrorConfig,
    of_lengths: f64,
    of_thicknesses: f64,
) -> Vec<Segment> {
    let fact = |value: f64, part: f64| Fact {
        value,
        tolerance: part * value,
        source: format!("supposed within {} %", 100.0 * part),
    };
    let stated = config.segments.iter().map(|segment| Segment {
        name: segment.name.clone(),
        length: fact(segment.length_um, of_lengths),
        width: fact(segment.width_um, of_lengths),
        films: segment
            .layers
            .iter()
            .map(|layer| (film(layer.film), fact(layer.um, of_thicknesses)))
            .collect(),
        loss: None,
        heated: segment.heated,
        turned: segment.turned,
    });
    stated.collect()
}

fn film(film: virtual_mirror::Film) -> Film {
    match film {
        virtual_mirror::Film::Al => Film::Aluminium,
        virtual_mirror::Film::Sio2 => Film::Oxide,
        virtual_mirror::Film::Pt => Film::Platinum,
    }
}
