//! Mirrors that are made to a design of their family, and the design as a model file states it.

use mirror_model::Device;
use mirror_model::device::{Fact, Film, Quantity, Segment};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use virtual_mirror::{Family, MirrorConfig};

/// What is known of lengths and widths: a mask and its etching are off by 2 % of features of 100 um.
const MASK: f64 = 0.02;
/// What is known of thicknesses: films and etched silicon vary by 5 % over a wafer.
const DEPOSITION: f64 = 0.05;
/// Leads of a four-wire measurement that leaves out bond wires (ohm), and a microscope's height (um): value and tolerance. A
/// family's mirrors have neither leads nor height.
const LEADS_OHM: (f64, f64) = (2.0, 2.0);
const REST_HEIGHT_UM: (f64, f64) = (10.0, 10.0);

/// A family's design.
pub(crate) struct Design {
    family: Family,
    drawing: MirrorConfig,
}

impl Design {
    /// The design of a family that has this seed.
    pub(crate) fn of(family: Family, seed: u64) -> Self {
        Self {
            family,
            drawing: MirrorConfig::draw(family, seed),
        }
    }

    /// A mirror made to it: what a drawing does not say, as materials and losses, is the family's.
    pub(crate) fn made(&self, seed: u64) -> MirrorConfig {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x3ade);
        let mut off = || rng.random_range(-1.0..=1.0);
        let [length, width, silicon] = [MASK, MASK, DEPOSITION].map(|part| 1.0 + part * off());
        let films = Film::ALL.map(|_| 1.0 + DEPOSITION * off());
        let mut config = MirrorConfig::draw(self.family, seed);
        config.heater.leads_ohm = [(); 4].map(|()| LEADS_OHM.0 + LEADS_OHM.1 * off());
        config.shape.rest_height_um = REST_HEIGHT_UM.0 + REST_HEIGHT_UM.1 * off();
        config.plate.side_um = length * self.drawing.plate.side_um;
        config.plate.silicon_um = silicon * self.drawing.plate.silicon_um;
        let drawn = self.drawing.segments.iter();
        for (made, drawn) in config.segments.iter_mut().zip(drawn) {
            made.length_um = length * drawn.length_um;
            made.width_um = width * drawn.width_um;
            made.layers.clone_from(&drawn.layers);
            for layer in &mut made.layers {
                layer.um *= films[film(layer.film) as usize];
            }
        }
        config
    }

    /// As its owner's model file states it.
    pub(crate) fn told(&self) -> Device {
        let plate = &self.drawing.plate;
        let absolute = |(value, tolerance)| fact(value, tolerance);
        let facts = BTreeMap::from([
            (Quantity::Leads, absolute(LEADS_OHM)),
            (Quantity::RestHeight, absolute(REST_HEIGHT_UM)),
            (Quantity::PlateSide, part(plate.side_um, MASK)),
            (Quantity::PlateThickness, part(plate.silicon_um, DEPOSITION)),
        ]);
        let segments = self.drawing.segments.iter().map(|drawn| Segment {
            name: drawn.name.clone(),
            length: part(drawn.length_um, MASK),
            width: part(drawn.width_um, MASK),
            films: drawn
                .layers
                .iter()
                .map(|layer| (film(layer.film), part(layer.um, DEPOSITION)))
                .collect(),
            loss: None,
            heated: drawn.heated,
            turned: drawn.turned,
        });
        Device {
            facts,
            segments: segments.collect(),
        }
    }
}

fn part(value: f64, part: f64) -> Fact {
    fact(value, part * value)
}

fn fact(value: f64, tolerance: f64) -> Fact {
    Fact {
        value,
        tolerance,
        source: "design".into(),
    }
}

fn film(film: virtual_mirror::Film) -> Film {
    match film {
        virtual_mirror::Film::Al => Film::Aluminium,
        virtual_mirror::Film::Sio2 => Film::Oxide,
        virtual_mirror::Film::Pt => Film::Platinum,
    }
}
