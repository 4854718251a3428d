//! Shape and memory, forward, and linear in what is sought: a bend of the tables' curve, the weights of play operators of
//! given radii (Prandtl-Ishlinskii), the weights of creep (Kelvin-Voigt).

use control_core::calibration::{LAGS, Lag, Memory, PLAYS, Play};
use control_core::{Micrometre, Second};
use least_squares::{Bounds, bounded, normal_factor};
use nalgebra::{DMatrix, DVector};

use super::films::Films;
use super::heat::Lags;
use super::timeline::TimeStep;
use super::unknowns::Unknowns;

/// Terms of the bend: Chebyshev polynomials up to the tenth order. What a table's curve is off is smooth.
const BENDS: usize = 11;
/// Of memory: the weights of play operators and of creep.
const MEMORY: usize = PLAYS + LAGS;
/// All that is sought: these, and where the mirror rests.
const TERMS: usize = BENDS + MEMORY + 1;
/// How large the terms are before anything has been measured, one standard deviation: a bend as a share of the range, as far
/// as models at rest were off (`docs/figures/positioning.md`, before a calibration); a weight, as much as creep and hysteresis
/// of thin films have. What the data do not determine stays small.
const BEND: f64 = 0.05;
const WEIGHT: f64 = 0.02;
/// A lag's part of the creep is none beyond these, which a board takes (`control_core`).
const CREEP_WEIGHTS: (f64, f64) = (-0.2, 0.2);
/// And how far films come to rest from where they did before they were hot for the first time (um).
const REST_UM: f64 = 1.0;

/// The displacements that the stages make: of the shape, and behind its play operators (um).
pub(super) struct Displacements {
    shape_um: Vec<f64>,
    behind_plays_um: Vec<f64>,
}

impl Displacements {
    /// Without any memory, and with the tables' own shape.
    pub(super) fn without_memory(places_um: &[f64]) -> Self {
        Self {
            shape_um: places_um.to_vec(),
            behind_plays_um: places_um.to_vec(),
        }
    }
}

/// What a weight of one would add at every time step (um): play operators, then creep.
///
/// Both depend on the displacement that they are driven by, which depends on them. So they follow an earlier estimate of it,
/// and the fit is repeated with its own outcome.
pub(super) struct MemoryTerms(Vec<[f64; MEMORY]>);

impl MemoryTerms {
    /// `top_um`: where the tables end; `highest_v`: the drive that the release counts at.
    pub(super) fn new(
        steps: &[TimeStep],
        (top_um, highest_v): (f64, f64),
        unknowns: &Unknowns,
        estimate: &Displacements,
    ) -> Self {
        let Unknowns {
            release_s,
            creep_s,
            radii,
            ..
        } = *unknowns;
        let mut plays = [0.0_f64; PLAYS];
        let mut crept = [0.0; LAGS];
        let mut creeps = Lags::of(creep_s);
        let mut y_before = 0.0;
        let inputs = estimate.shape_um.iter().zip(&estimate.behind_plays_um);
        let rows = steps.iter().zip(inputs).map(|(step, (&x, &y))| {
            let mut row = [0.0; MEMORY];
            let kept = (-step.duration_s / release_s * step.drive_v / highest_v).exp();
            for (k, play) in plays.iter_mut().enumerate() {
                let radius = radii[k] * top_um;
                *play = (x + (*play - x) * kept).clamp(x - radius, x + radius);
                row[k] = *play - x;
            }
            if step.duration_s > 0.0 {
                for (state, lag) in crept.iter_mut().zip(creeps.over(step.duration_s)) {
                    *state = lag.after(*state, y_before, y);
                }
            }
            row[PLAYS..].copy_from_slice(&crept);
            y_before = y;
            row
        });
        Self(rows.collect())
    }
}

/// Shape and memory, fitted.
#[derive(Clone, Debug)]
pub(super) struct LinearStages {
    top_um: f64,
    bends: [f64; BENDS],
    memory: [f64; MEMORY],
    rest_um: f64,
}

/// The bend's terms at a share of the range: Chebyshev polynomials, each times the share, so that each is 0 at rest.
pub(crate) fn bend_terms<const N: usize>(share: f64) -> [f64; N] {
    let s = 2.0 * share - 1.0;
    let (mut before, mut now) = (1.0, s);
    std::array::from_fn(|k| {
        let chebyshev = if k == 0 { 1.0 } else { now };
        if k > 0 {
            (before, now) = (now, 2.0 * s * now - before);
        }
        share * chebyshev
    })
}

/// What each term adds to a displacement at a place of the tables (um).
fn terms(top_um: f64, place_um: f64, memory: &[f64; MEMORY]) -> [f64; TERMS] {
    let bends: [f64; BENDS] = bend_terms(place_um / top_um);
    let mut terms = [1.0; TERMS];
    terms[..BENDS].copy_from_slice(&bends.map(|bend| top_um * bend));
    terms[BENDS..BENDS + MEMORY].copy_from_slice(memory);
    terms
}

impl LinearStages {
    /// Least squares of the readings, with the terms' prior, where weights of play operators are not negative: they hold back. Nor are those of
    /// creep of usual films: creep that went back would be heat, which the poles are for.
    ///
    /// `None` where the normal equations are no numbers.
    pub(super) fn fit(
        steps: &[TimeStep],
        top_um: f64,
        places_um: &[f64],
        memory: &MemoryTerms,
        films: Films,
    ) -> Option<Self> {
        let mut normal = [[0.0; TERMS]; TERMS];
        let mut right = DVector::<f64>::zeros(TERMS);
        for ((step, &place), row) in steps.iter().zip(places_um).zip(&memory.0) {
            let Some(reading) = step.displacement else {
                continue;
            };
            let sigma = reading.standard_deviation_um;
            let row = terms(top_um, place, row).map(|term| term / sigma);
            let missing = (reading.z_um - place) / sigma;
            for (i, column) in normal.iter_mut().enumerate() {
                right[i] += row[i] * missing;
                for (sum, term) in column.iter_mut().zip(row) {
                    *sum += row[i] * term;
                }
            }
        }
        for (i, column) in normal.iter_mut().enumerate() {
            let size: f64 = match i {
                _ if i < BENDS => BEND,
                _ if i < BENDS + MEMORY => WEIGHT,
                _ => REST_UM,
            };
            column[i] += size.powi(-2);
        }
        // Usual films rest where displacements count from.
        let (sought, creep) = match films {
            Films::Usual => (BENDS + MEMORY, (0.0, f64::INFINITY)),
            Films::Unusual => (TERMS, CREEP_WEIGHTS),
        };
        let normal = DMatrix::from_fn(sought, sought, |i, j| normal[j][i]);
        let (factor, right) = normal_factor(normal, &right.rows(0, sought).into_owned())?;
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        let shape = [free; BENDS].into_iter();
        let memory = [(0.0, f64::INFINITY); PLAYS]
            .into_iter()
            .chain([creep; LAGS]);
        let bounds = Bounds::new(shape.chain(memory).chain([free]).take(sought));
        let solution = bounded(&factor, &right, &bounds)?;
        Some(Self {
            top_um,
            bends: std::array::from_fn(|k| solution[k]),
            memory: std::array::from_fn(|k| solution[BENDS + k]),
            rest_um: solution.get(BENDS + MEMORY).copied().unwrap_or(0.0),
        })
    }

    /// The displacement at the end of every time step (um).
    pub(super) fn predict<'a>(
        &'a self,
        places_um: &'a [f64],
        memory: &'a MemoryTerms,
    ) -> impl Iterator<Item = f64> + 'a {
        let rows = places_um.iter().zip(&memory.0);
        rows.map(|(&place, row)| self.rest_um + self.shape(place) + product(&self.memory, row))
    }

    /// Where the mirror rests, its memory left out (um); 0 of usual films.
    pub(super) fn rest_um(&self) -> f64 {
        self.rest_um
    }

    /// The displacement that the shape gives at a place of the tables (um).
    pub(super) fn shape(&self, place_um: f64) -> f64 {
        let bends: [f64; BENDS] = bend_terms(place_um / self.top_um);
        place_um + self.top_um * product(&self.bends, &bends)
    }

    /// The displacements that memory is driven by.
    pub(super) fn displacements(&self, places_um: &[f64], memory: &MemoryTerms) -> Displacements {
        let shape_um: Vec<f64> = places_um.iter().map(|place| self.shape(*place)).collect();
        let behind_plays_um = shape_um
            .iter()
            .zip(&memory.0)
            .map(|(x, row)| x + product(&self.memory[..PLAYS], &row[..PLAYS]))
            .collect();
        Displacements {
            shape_um,
            behind_plays_um,
        }
    }

    /// The core's stage `memory`.
    pub(super) fn memory(&self, unknowns: &Unknowns) -> Memory {
        Memory {
            plays: std::array::from_fn(|k| Play {
                weight: self.memory[k] as f32,
                radius: Micrometre((unknowns.radii[k] * self.top_um) as f32),
            }),
            release: Second(unknowns.release_s as f32),
            creep: std::array::from_fn(|k| Lag {
                weight: self.memory[PLAYS + k] as f32,
                time: Second(unknowns.creep_s[k] as f32),
            }),
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::super::timeline::Displacement;
    use super::*;
    use control_core::calibration::Heat;

    const TOP_UM: f64 = 100.0;
    /// The highest.
    const DRIVE_V: f64 = 3.5;
    /// What enters nonlinearly, with play operators that let go in this time (s).
    fn unknowns(release_s: f64) -> Unknowns {
        Unknowns {
            release_s,
            ..Unknowns::starts(&Heat::INSTANT)[0]
        }
    }

    /// Slow enough that the play operators keep what they hold.
    fn keeping() -> Unknowns {
        unknowns(1e12)
    }

    /// Up, down and up again through the range, in steps of 1 um and 1 s.
    fn places() -> Vec<f64> {
        let up = (0..=100).map(f64::from);
        let down = (20..100).rev().map(f64::from);
        let again = (21..=80).map(f64::from);
        up.chain(down).chain(again).collect()
    }

    /// Time steps of a driven mirror with readings of these displacements.
    fn read(z_um: &[f64]) -> Vec<TimeStep> {
        let step = |&z_um| TimeStep {
            duration_s: 1.0,
            drive_v: DRIVE_V,
            displacement: Some(Displacement {
                z_um,
                standard_deviation_um: 0.001,
            }),
            ..TimeStep::default()
        };
        z_um.iter().map(step).collect()
    }

    /// The stages that fit what a mirror of known displacements `z_um` shows at places.
    fn fitted(z_um: &[f64]) -> LinearStages {
        let (places, steps) = (places(), read(z_um));
        let estimate = Displacements::without_memory(&places);
        let memory = MemoryTerms::new(&steps, (TOP_UM, DRIVE_V), &keeping(), &estimate);
        LinearStages::fit(&steps, TOP_UM, &places, &memory, Films::Usual).unwrap()
    }

    #[test]
    fn a_play_operator_follows_a_radius_behind() {
        let places = places();
        let steps = read(&places);
        let estimate = Displacements::without_memory(&places);
        let held_back = |release_s: f64| {
            let terms =
                MemoryTerms::new(&steps, (TOP_UM, DRIVE_V), &unknowns(release_s), &estimate);
            [100, 105, 106, 112, 180].map(|step| terms.0[step][1])
        };
        // Radius 3 um: behind it on the way up, it stays from 100 to 94 um, and is as far ahead of it on the way down.
        for (held, expected) in held_back(1e12).into_iter().zip([-3.0, 2.0, 3.0, 3.0, 3.0]) {
            assert!((held - expected).abs() < 1e-9, "{held} is not {expected}");
        }
        // What lets go at once holds nothing back.
        assert!(held_back(1e-3).iter().all(|held| held.abs() < 1e-12));
        // Without a drive it does not let go.
        let mut off = steps.clone();
        off.iter_mut().for_each(|step| step.drive_v = 0.0);
        let terms = MemoryTerms::new(&off, (TOP_UM, DRIVE_V), &unknowns(1e-3), &estimate);
        assert!((terms.0[112][1] - 3.0).abs() < 1e-9);
    }

    #[test]
    fn creep_follows_with_its_time_constant() {
        let places = vec![10.0; 8];
        let estimate = Displacements::without_memory(&places);
        let terms = MemoryTerms::new(&read(&places), (TOP_UM, DRIVE_V), &keeping(), &estimate);
        // After a ramp in the first second it goes on by the pole exp(-1 s / 7 s).
        let missing = |step: usize| 10.0 - terms.0[step][PLAYS + 2];
        for step in 1..8 {
            let pole = missing(step) / missing(step - 1);
            assert!((pole - f64::exp(-1.0 / 7.0)).abs() < 1e-12, "{pole}");
        }
    }

    #[test]
    fn a_bend_is_found_and_is_nothing_at_rest() {
        // 3 % of the range, in the middle: x + 0.12 x (1 - x).
        let bent = |place: f64| place + 0.12 * place * (1.0 - place / TOP_UM);
        let z_um: Vec<f64> = places().into_iter().map(bent).collect();
        let found = fitted(&z_um);
        for place in [0.0, 10.0, 50.0, 99.0] {
            assert!(
                (found.shape(place) - bent(place)).abs() < 1e-3,
                "{} at {place}",
                found.shape(place) - bent(place)
            );
        }
        assert_eq!(found.shape(0.0), 0.0);
        // The prior's pull, of one part in a million, is all that is left for memory.
        let memory = found.memory(&keeping());
        assert!(memory.plays.iter().all(|play| play.weight < 1e-5));
    }

    #[test]
    fn films_that_were_moved_rest_elsewhere() {
        let z_um: Vec<f64> = places().into_iter().map(|place| 1.6 + place).collect();
        let (places, steps) = (places(), read(&z_um));
        let estimate = Displacements::without_memory(&places);
        let memory = MemoryTerms::new(&steps, (TOP_UM, DRIVE_V), &keeping(), &estimate);
        let found = LinearStages::fit(&steps, TOP_UM, &places, &memory, Films::Unusual).unwrap();
        assert!((found.rest_um() - 1.6).abs() < 1e-3, "{}", found.rest_um());
        assert!((found.shape(50.0) - 50.0).abs() < 1e-3);
        let at_zero = LinearStages::fit(&steps, TOP_UM, &places, &memory, Films::Usual).unwrap();
        assert_eq!(at_zero.rest_um(), 0.0);
    }

    #[test]
    fn weights_of_plays_are_found_and_never_negative() {
        let mirror = |weight: f64| {
            let places = places();
            let estimate = Displacements::without_memory(&places);
            let memory = MemoryTerms::new(&read(&places), (TOP_UM, DRIVE_V), &keeping(), &estimate);
            let rows = places.iter().zip(&memory.0);
            rows.map(|(place, row)| place + weight * row[1])
                .collect::<Vec<_>>()
        };
        let with = fitted(&mirror(0.02)).memory(&keeping());
        // Ten times what the prior's pull leaves of memory above.
        assert!((with.plays[1].weight - 0.02).abs() < 1e-4, "{with:?}");
        assert!(with.plays[0].weight < 1e-4 && with.plays[2].weight < 1e-4);
        // A mirror that runs ahead where play would hold it back.
        let ahead = fitted(&mirror(-0.02)).memory(&keeping());
        assert!(ahead.plays.iter().all(|play| play.weight >= 0.0));
        assert_eq!(ahead.plays[1].weight, 0.0);
    }
}
