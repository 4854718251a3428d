//! From a mirror's description to the numbers that its simulation uses, with the differences among its actuators drawn.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::config::{MirrorConfig, Segment};
use crate::effects::heat::LossLaw;
use crate::effects::resistance::{leads, saturation};
use crate::material::{Laminate, Materials};
use crate::per_actuator::PerActuator;
use crate::shape::{Bend, Shape};
use crate::thermal::{Cell, LumpNode, Network};

/// The four actuators' factors, 1 on average.
struct Draws {
    ohm: PerActuator,
    tcr: PerActuator,
    air_loss: PerActuator,
    bend: PerActuator,
}

impl Draws {
    fn new(config: &MirrorConfig) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
        let mut factors = |sd: f64, trim: [f64; 4]| {
            PerActuator(trim.map(|trim| {
                let normal: f64 = StandardNormal.sample(&mut rng);
                trim * (1.0 + sd * normal.clamp(-2.0, 2.0))
            }))
        };
        let (spread, trim) = (&config.spread, &config.trim);
        Self {
            ohm: factors(spread.ohm, trim.ohm),
            tcr: factors(spread.tcr, trim.tcr),
            air_loss: factors(spread.air_loss, trim.air_loss),
            bend: factors(spread.bend, trim.bend),
        }
    }
}

/// What the simulation needs.
pub(crate) struct Build {
    pub(crate) network: Network,
    pub(crate) shape: Shape,
}

impl Build {
    pub(crate) fn new(config: &MirrorConfig) -> Self {
        let draws = Draws::new(config);
        let slices = slice(&config.segments, &config.materials);
        Self {
            network: network(config, &slices, &draws),
            shape: Shape::new(bends(&slices, &draws), &config.shape, &config.effects),
        }
    }
}

/// One cell of the beam with its films' properties.
struct Slice<'a> {
    segment: &'a Segment,
    films: Laminate,
    length: f64,
    width: f64,
}

impl Slice<'_> {
    /// Thermal resistance of half the cell (K/W).
    fn half(&self) -> f64 {
        0.5 * self.length / (self.films.conductance_w_k * self.width)
    }
}

fn slice<'a>(segments: &'a [Segment], materials: &Materials) -> Vec<Slice<'a>> {
    let cut = |segment: &'a Segment| {
        let films = Laminate::new(&segment.layers, materials);
        let length = segment.length_um * 1e-6 / segment.cells as f64;
        let width = segment.width_um * 1e-6;
        (0..segment.cells).map(move |_| Slice {
            segment,
            films,
            length,
            width,
        })
    };
    segments.iter().flat_map(cut).collect()
}

fn network(config: &MirrorConfig, slices: &[Slice], draws: &Draws) -> Network {
    let heated: f64 = slices
        .iter()
        .filter(|s| s.segment.heated)
        .map(|s| s.length)
        .sum();
    let cell = |(i, slice): (usize, &Slice)| {
        let onward = slices.get(i + 1).map_or(0.0, Slice::half);
        let share = if slice.segment.heated {
            slice.length / heated
        } else {
            0.0
        };
        Cell {
            inv_capacity: PerActuator::splat(
                1.0 / (slice.films.heat_j_m2_k * slice.width * slice.length),
            ),
            to_next: PerActuator::splat(1.0 / (slice.half() + onward)),
            to_air: draws.air_loss * (slice.segment.air_loss_w_m_k * slice.length),
            ohm: draws.ohm * (config.heater.ohm * share),
            to_gap: PerActuator::ZERO,
            surface: 2.0 * slice.width * slice.length,
        }
    };
    let (frame, package, frame_to_package) = substrate(config);
    Network {
        cells: slices.iter().enumerate().map(cell).collect(),
        to_frame: PerActuator::splat(1.0 / slices[0].half()),
        lumps: [plate(config), frame, package],
        frame_to_package,
        air_to_frame: if config.frame.is_some() {
            config.air_to_frame
        } else {
            0.0
        },
        stagnant: PerActuator::ZERO,
        loss: LossLaw::new(&config.effects, config.ambient_c, 0.0),
        tcr: draws.tcr * config.heater.tcr_per_k,
        tcr_tail: saturation(&config.effects),
        leads: PerActuator(config.heater.leads_ohm) + leads(&config.effects, config.seed),
        aged: PerActuator::splat(1.0),
        ambient: 0.0,
        ambient_set: 0.0,
    }
}

fn plate(config: &MirrorConfig) -> LumpNode {
    // A micrometre of aluminium mirrors the light.
    let (area, m) = ((config.plate.side_um * 1e-6).powi(2), &config.materials);
    let per_area = config.plate.silicon_um * m.si.heat_mj_m3_k + m.al.heat_mj_m3_k;
    LumpNode {
        inv_capacity: 1.0 / (area * per_area),
        to_room: config.plate.air_loss_uw_k * 1e-6,
    }
}

fn substrate(config: &MirrorConfig) -> (LumpNode, LumpNode, f64) {
    let Some(frame) = config.frame else {
        return (LumpNode::default(), LumpNode::default(), 0.0);
    };
    (
        LumpNode {
            inv_capacity: 1e6 / frame.frame_uj_k,
            to_room: 0.0,
        },
        LumpNode {
            inv_capacity: 1e3 / frame.package_mj_k,
            to_room: frame.package_to_room_uw_k * 1e-6,
        },
        frame.frame_to_package_uw_k * 1e-6,
    )
}

fn bends(slices: &[Slice], draws: &Draws) -> Vec<Bend> {
    let bend = |slice: &Slice| {
        let sign = if slice.segment.turned { -1.0 } else { 1.0 };
        Bend {
            length: slice.length,
            curvature: draws.bend * (sign * slice.films.curvature_per_m_k),
            residual: draws.bend * (sign * slice.films.residual_per_m),
            compliance: slice.length / (slice.films.stiffness_n_m * slice.width),
            turned: slice.segment.turned,
        }
    };
    slices.iter().map(bend).collect()
}
