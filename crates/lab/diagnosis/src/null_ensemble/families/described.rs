//! What a user states of a mirror, in the place of what was drawn.

use mirror_model::device::{Device, Fact, Film, Quantity};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashMap;
use virtual_mirror::{Effect, Layer, MirrorConfig, Segment};

/// A cell of a stated segment is about so long (um), and a segment has so many: as those of the families.
const CELL_UM: f64 = 40.0;
const CELLS: (f64, f64) = (2.0, 8.0);

/// Puts what is stated into a mirror, each number drawn within its tolerance.
pub(super) fn state(config: &mut MirrorConfig, device: &Device, seed: u64) {
    let mut draw = Draw::new(seed);
    if let Some(leads) = device.facts.get(&Quantity::Leads) {
        config.effects.set(Effect::SeriesResistance, 0.0);
        config.heater.leads_ohm = std::array::from_fn(|_| draw.within(leads));
    }
    for (quantity, place) in [
        (Quantity::RestHeight, &mut config.shape.rest_height_um),
        (Quantity::PlateSide, &mut config.plate.side_um),
        (Quantity::PlateThickness, &mut config.plate.silicon_um),
        (Quantity::PlateLoss, &mut config.plate.air_loss_uw_k),
    ] {
        if let Some(fact) = device.facts.get(&quantity) {
            *place = draw.within(fact);
        }
    }
    if !device.segments.is_empty() {
        let stated = device.segments.iter();
        config.segments = stated
            .map(|segment| draw.segment(segment, &config.segments))
            .collect();
    }
}

/// Draws within tolerances. What is stated alike is one film or one mask, and is off alike.
struct Draw {
    rng: ChaCha8Rng,
    off: HashMap<(Quantity, Option<Film>, [u64; 2]), f64>,
}

impl Draw {
    fn new(seed: u64) -> Self {
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed ^ 0xde71_ce00),
            off: HashMap::new(),
        }
    }

    fn within(&mut self, fact: &Fact) -> f64 {
        fact.value + fact.tolerance * self.rng.random_range(-1.0..=1.0)
    }

    fn alike(&mut self, quantity: Quantity, film: Option<Film>, fact: &Fact) -> f64 {
        let stated = [fact.value, fact.tolerance].map(f64::to_bits);
        if let Some(&value) = self.off.get(&(quantity, film, stated)) {
            return value;
        }
        let value = self.within(fact);
        self.off.insert((quantity, film, stated), value);
        value
    }

    /// A stated segment. A loss that is not stated is that of the drawn segment which is most like it.
    fn segment(&mut self, stated: &mirror_model::device::Segment, drawn: &[Segment]) -> Segment {
        let cells = (stated.length.value / CELL_UM).round();
        let layers = stated.films.iter().map(|(film, thickness)| Layer {
            film: material(*film),
            um: self.alike(Quantity::Thickness, Some(*film), thickness),
        });
        Segment {
            layers: layers.collect(),
            name: stated.name.clone(),
            length_um: self.alike(Quantity::Length, None, &stated.length),
            width_um: self.alike(Quantity::Width, None, &stated.width),
            cells: cells.clamp(CELLS.0, CELLS.1) as usize,
            air_loss_w_m_k: match &stated.loss {
                Some(loss) => self.alike(Quantity::Loss, None, loss),
                None => loss_of_the_like(stated.heated, stated.turned, drawn),
            },
            heated: stated.heated,
            turned: stated.turned,
        }
    }
}

fn loss_of_the_like(heated: bool, turned: bool, drawn: &[Segment]) -> f64 {
    let differences =
        |other: &&Segment| 2 * u8::from(other.heated != heated) + u8::from(other.turned != turned);
    let like = drawn.iter().min_by_key(differences);
    like.map_or(0.0, |segment| segment.air_loss_w_m_k)
}

fn material(film: Film) -> virtual_mirror::Film {
    match film {
        Film::Aluminium => virtual_mirror::Film::Al,
        Film::Oxide => virtual_mirror::Film::Sio2,
        Film::Platinum => virtual_mirror::Film::Pt,
    }
}

#[cfg(test)]
mod tests {
    use super::super::draw_mirror;
    use super::*;
    use mirror_model::device;

    fn fact(value: f64, tolerance: f64) -> Fact {
        Fact {
            value,
            tolerance,
            source: "drawing".into(),
        }
    }

    /// A fold of two equal halves, of which everything is stated.
    fn fold() -> Device {
        let half = |turned| device::Segment {
            name: "NI".into(),
            length: fact(250.0, 5.0),
            width: fact(100.0, 2.0),
            films: vec![
                (Film::Oxide, fact(1.1, 0.1)),
                (Film::Platinum, fact(0.2, 0.02)),
                (Film::Aluminium, fact(1.1, 0.1)),
            ],
            loss: None,
            heated: true,
            turned,
        };
        Device {
            facts: [
                (Quantity::Leads, fact(6.0, 1.0)),
                (Quantity::RestHeight, fact(180.0, 10.0)),
                (Quantity::PlateSide, fact(800.0, 8.0)),
            ]
            .into(),
            segments: vec![half(false), half(true)],
        }
    }

    /// What is drawn of a mirror of which nothing is known, as it was drawn before anything could be: what a verdict without a
    /// description rests on.
    #[test]
    fn what_is_not_stated_is_drawn_as_ever() {
        let line = |seed: u64| {
            let c = draw_mirror(seed, &Device::default());
            let sum = |of: fn(&Segment) -> f64| c.segments.iter().map(of).sum::<f64>();
            format!(
                "{seed} {:.6} {:.6} {:.6} {:.6} {:.6} {:.6} {:.6} {:.6} {:?}\n",
                c.plate.air_loss_uw_k,
                c.plate.silicon_um,
                c.shape.clamp,
                c.shape.rest_height_um,
                c.effects.strength(Effect::SeriesResistance),
                sum(|s| s.length_um),
                sum(|s| s.width_um),
                sum(|s| s.air_loss_w_m_k),
                c.heater.leads_ohm,
            )
        };
        let drawn: String = (0..10).map(line).collect();
        assert_eq!(drawn, include_str!("drawn.txt"));
    }

    #[test]
    fn what_is_stated_is_drawn_within_its_tolerance() {
        let device = fold();
        let mut highest: f64 = 0.0;
        for seed in 0..200 {
            let c = draw_mirror(seed, &device);
            let lies = |value: f64, fact: &Fact| {
                let (low, high) = fact.interval();
                assert!((low..=high).contains(&value), "{value}");
            };
            for ohm in c.heater.leads_ohm {
                lies(ohm, &device.facts[&Quantity::Leads]);
                highest = highest.max(ohm);
            }
            lies(c.shape.rest_height_um, &device.facts[&Quantity::RestHeight]);
            lies(c.plate.side_um, &device.facts[&Quantity::PlateSide]);
            assert_eq!(c.effects.strength(Effect::SeriesResistance), 0.0);
            let [out, back] = &c.segments[..] else {
                panic!("two segments")
            };
            lies(out.length_um, &device.segments[0].length);
            // One mask, and one film.
            assert_eq!(out.length_um, back.length_um);
            assert_eq!(out.layers, back.layers);
            assert_ne!(
                out.layers[0].um, out.layers[2].um,
                "two films that are as thick"
            );
        }
        // Of 800 numbers the highest lies nearer to the end than 1 % of the interval, but for 0.99^800 = 3e-4.
        assert!(highest > 6.98, "{highest}");
    }

    #[test]
    fn what_a_description_leaves_open_is_as_wide_as_without_it() {
        let device = fold();
        for seed in 0..20 {
            let [stated, open] = [&device, &Device::default()].map(|d| draw_mirror(seed, d));
            assert_eq!(stated.plate.silicon_um, open.plate.silicon_um);
            assert_eq!(stated.shape.clamp, open.shape.clamp);
            assert_eq!(stated.materials, open.materials);
            let losses = open.segments.iter().map(|s| s.air_loss_w_m_k);
            let losses: Vec<f64> = losses.collect();
            assert!(
                stated
                    .segments
                    .iter()
                    .all(|s| losses.contains(&s.air_loss_w_m_k))
            );
        }
    }

    #[test]
    fn whatever_may_be_stated_is_a_mirror_that_can_be() {
        let at_an_end = |quantity: Quantity, is_high: bool| {
            let (low, high) = quantity.range();
            let tolerance = 1e-3 * (high - low);
            fact(
                if is_high {
                    high - tolerance
                } else {
                    low + tolerance
                },
                tolerance,
            )
        };
        for is_high in [false, true] {
            let end = |quantity| at_an_end(quantity, is_high);
            let segment = device::Segment {
                name: String::new(),
                length: end(Quantity::Length),
                width: end(Quantity::Width),
                films: vec![
                    (Film::Aluminium, end(Quantity::Thickness));
                    device::Segment::MOST_FILMS
                ],
                loss: Some(end(Quantity::Loss)),
                heated: true,
                turned: false,
            };
            let device = Device {
                facts: Quantity::OF_THE_MIRROR
                    .map(|quantity| (quantity, end(quantity)))
                    .into(),
                segments: vec![segment; device::Segment::MOST],
            };
            for seed in 0..5 {
                let drawn = draw_mirror(seed, &device);
                drawn.check().expect("a mirror that can be");
            }
        }
    }
}
