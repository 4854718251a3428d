//! Families of mirrors without effects: random layouts, so that a diagnosis calibrated on some families can be tested on
//! others. They are what a null ensemble is drawn from.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::config::{
    Heater, MirrorConfig, Plate, Segment, SensorConfig, ShapeConfig, Spread, Trim,
};
use crate::effects::Effects;
use crate::material::{Film, Layer, Materials};

/// A way to lay a mirror out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// The paper's fold, lengths and films within fabrication's reach.
    A,
    /// Two halves in line, the second repeating the first; stiffly clamped.
    B,
    /// The fold with a beam close to the frame: more loss to the air near the substrate, thin aluminium.
    C,
    /// Short wide beams without overlaps, a small heavy plate.
    D,
    /// Metal leads across the isolation, and a heater that leaves the overlaps cold.
    E,
    /// A fold that is heated on its way out only: the return half is warmed by what flows on.
    F,
    /// One long half without a fold, thick films, two slim beams on a thick plate.
    G,
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::A,
        Self::B,
        Self::C,
        Self::D,
        Self::E,
        Self::F,
        Self::G,
    ];
}

impl MirrorConfig {
    /// A mirror of a family that has no effect, no curl and no resonance. The same family and seed give the same
    /// mirror.
    pub fn draw(family: Family, seed: u64) -> Self {
        let mut draw = Draw(ChaCha8Rng::seed_from_u64(
            seed ^ (0xfa30 + ((family as u64) << 48)),
        ));
        let segments = Layout::new(family, &mut draw).segments();
        Self {
            name: format!("family {family:?}, seed {seed}"),
            seed,
            ambient_c: draw.between(19.0, 26.0),
            drive_limit_v: 10.0,
            air_to_frame: 0.0,
            heater: Heater {
                ohm: draw.between(345.0, 375.0),
                tcr_per_k: 3.92e-3,
                leads_ohm: [0.0; 4],
            },
            materials: materials(&mut draw),
            segments,
            plate: plate(family, &mut draw),
            frame: None,
            shape: ShapeConfig {
                rest_height_um: 0.0,
                clamp: clamp(family, &mut draw),
            },
            motion: None,
            spread: spread(&mut draw),
            trim: Trim::default(),
            sensor: SensorConfig::default(),
            effects: Effects::default(),
        }
    }
}

struct Draw(ChaCha8Rng);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    /// A number within a part of itself.
    fn about(&mut self, nominal: f64, part: f64) -> f64 {
        nominal * self.between(1.0 - part, 1.0 + part)
    }
}

fn materials(draw: &mut Draw) -> Materials {
    let mut materials = Materials::default();
    materials.al.conductivity_w_m_k = draw.between(150.0, 235.0);
    materials.sio2.conductivity_w_m_k = draw.between(1.0, 1.4);
    materials.pt.conductivity_w_m_k = draw.between(30.0, 70.0);
    materials.al.modulus_gpa = draw.between(60.0, 75.0);
    materials.sio2.modulus_gpa = draw.between(62.0, 80.0);
    materials
}

fn plate(family: Family, draw: &mut Draw) -> Plate {
    let (side, silicon) = match family {
        Family::D => (draw.between(350.0, 500.0), draw.between(60.0, 100.0)),
        Family::G => (draw.between(600.0, 900.0), draw.between(100.0, 200.0)),
        _ => (draw.between(500.0, 1000.0), draw.between(20.0, 60.0)),
    };
    // Air below and above the plate, and some around its edges.
    let air_loss_uw_k = draw.between(180.0, 320.0) * (side * 1e-3f64).powi(2) + 20.0;
    Plate {
        side_um: side,
        silicon_um: silicon,
        air_loss_uw_k,
        lever_um: draw.between(0.6, 1.0) * side,
    }
}

fn clamp(family: Family, draw: &mut Draw) -> f64 {
    match family {
        Family::A | Family::C => draw.between(0.25, 0.7),
        Family::B => draw.between(0.5, 0.9),
        Family::D => draw.between(0.0, 0.6),
        Family::E => draw.between(0.35, 0.75),
        Family::F => draw.between(0.5, 0.8),
        Family::G => draw.between(0.15, 0.45),
    }
}

fn spread(draw: &mut Draw) -> Spread {
    Spread {
        ohm: draw.between(0.005, 0.02),
        tcr: draw.between(0.001, 0.004),
        air_loss: draw.between(0.005, 0.02),
        bend: draw.between(0.003, 0.012),
    }
}

/// What the two halves of a beam have in common.
struct Layout {
    family: Family,
    /// Lengths of isolation, NI, OL and IV (um).
    lengths: [f64; 4],
    width_um: f64,
    /// Films (um): aluminium, oxide below and above it, platinum, the insulation between.
    al: f64,
    oxide: f64,
    pt: f64,
    insulation: f64,
    /// Loss of the outward and of the return half (W/(m K)).
    loss: [f64; 2],
    /// Finer beams resolve the ends better.
    cells: [usize; 4],
}

impl Layout {
    fn new(family: Family, draw: &mut Draw) -> Self {
        let mut lengths = match family {
            Family::D => [
                draw.between(12.0, 25.0),
                draw.between(200.0, 240.0),
                0.0,
                draw.between(150.0, 200.0),
            ],
            Family::G => [
                draw.between(20.0, 40.0),
                draw.between(290.0, 340.0),
                draw.between(60.0, 100.0),
                draw.between(190.0, 240.0),
            ],
            _ => [
                draw.between(15.0, 40.0),
                draw.about(250.0, 0.08),
                draw.about(120.0, 0.15),
                draw.about(125.0, 0.1),
            ],
        };
        // From two slim beams an actuator to eight: heat capacity, and with it the fast time constant, spans 0.6 to 9 ms.
        let width_um = 30.0 * draw.between(0.0, 12.0f64.ln()).exp();
        lengths[0] *= 1.0 + width_um / 150.0; // so that the isolation still isolates
        let level = match family {
            Family::D => draw.between(0.19, 0.25),
            Family::F => draw.between(0.22, 0.27),
            Family::G => draw.between(0.18, 0.23),
            _ => draw.between(0.15, 0.21),
        };
        let uneven = match family {
            Family::C => draw.between(1.25, 1.7),
            _ => draw.between(0.9, 1.1),
        };
        let al = if family == Family::C {
            draw.between(0.7, 0.95)
        } else {
            draw.between(0.95, 1.2)
        };
        Self {
            family,
            lengths,
            width_um,
            al,
            oxide: draw.between(0.95, 1.2),
            pt: draw.between(0.15, 0.25),
            insulation: draw.between(0.05, 0.15),
            loss: [level * uneven, level],
            cells: if draw.between(0.0, 1.0) < 0.5 {
                [2, 6, 3, 4]
            } else {
                [3, 7, 3, 4]
            },
        }
    }

    fn segments(&self) -> Vec<Segment> {
        let names = ["isolation", "NI", "OL", "IV"];
        let straight = |kinds: &[usize]| kinds.iter().map(|&kind| (kind, false)).collect();
        let order: Vec<(usize, bool)> = match self.family {
            Family::B => straight(&[0, 1, 2, 3, 1, 2, 3, 0]),
            Family::G => straight(&[0, 1, 2, 3, 0]),
            _ => {
                let back = [3, 2, 1, 0].map(|kind| (kind, true));
                [0, 1, 2, 3]
                    .map(|kind| (kind, false))
                    .into_iter()
                    .chain(back)
                    .collect()
            }
        };
        let segment = |(place, (kind, turned)): (usize, (usize, bool))| Segment {
            name: names[kind].to_owned(),
            length_um: self.lengths[kind],
            width_um: self.width_um,
            cells: self.cells[kind],
            layers: self.layers(kind),
            air_loss_w_m_k: self.loss[usize::from(place >= 4)] * if kind == 0 { 0.6 } else { 1.0 },
            heated: match self.family {
                Family::E => kind == 1 || kind == 3,
                Family::F => kind != 0 && place < 4,
                _ => kind != 0,
            },
            turned,
        };
        order
            .into_iter()
            .enumerate()
            .map(segment)
            .filter(|segment| segment.length_um > 0.0)
            .collect()
    }

    fn layers(&self, kind: usize) -> Vec<Layer> {
        let layer = |film, um| Layer { film, um };
        let oxide = layer(Film::Sio2, self.oxide);
        let heater = [
            layer(Film::Pt, self.pt),
            layer(Film::Sio2, self.insulation),
            layer(Film::Al, self.al),
        ];
        match kind {
            0 if self.family == Family::E => {
                vec![
                    layer(Film::Sio2, 2.0 * self.oxide),
                    layer(Film::Pt, self.pt),
                ]
            }
            0 => vec![layer(Film::Sio2, 2.0 * self.oxide)],
            1 => [vec![oxide], heater.to_vec()].concat(),
            2 => [vec![oxide], heater.to_vec(), vec![oxide]].concat(),
            _ => [heater.to_vec(), vec![oxide]].concat(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VirtualMirror;

    #[test]
    fn every_mirror_drawn_is_one_that_could_be_built() {
        for family in Family::ALL {
            let mut range = (f64::INFINITY, 0.0f64);
            for seed in 0..40 {
                let config = MirrorConfig::draw(family, seed);
                let mut mirror = VirtualMirror::new(&config).expect("drawn mirrors are valid");
                mirror.advance([3.5; 4], 30.0);
                let state = mirror.state();
                range = (range.0.min(state.z_um), range.1.max(state.z_um));
                assert!(
                    (80.0..340.0).contains(&state.z_um),
                    "{family:?} {seed}: {state:?}"
                );
                assert!(
                    (60.0..190.0).contains(&state.heater_mean_k[0]),
                    "{family:?} {seed}: {state:?}"
                );
            }
            println!("{family:?}: {:.0} to {:.0} um at 3.5 V", range.0, range.1);
            assert!(
                range.1 > 1.2 * range.0,
                "{family:?} is too narrow: {range:?}"
            );
        }
    }

    #[test]
    fn a_draw_repeats_and_families_differ() {
        assert_eq!(
            MirrorConfig::draw(Family::B, 7),
            MirrorConfig::draw(Family::B, 7)
        );
        let [a, b] = [Family::A, Family::B].map(|family| MirrorConfig::draw(family, 7));
        assert_ne!(a.segments, b.segments);
    }
}
