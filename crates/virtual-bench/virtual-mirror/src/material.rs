//! What the films are made of.

use serde::{Deserialize, Serialize};

/// Properties of one film material, taken constant with temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Thermal conductivity (W/(m K)).
    pub conductivity_w_m_k: f64,
    /// Heat capacity by volume (MJ/(m3 K)).
    pub heat_mj_m3_k: f64,
    /// Linear expansion (1e-6/K).
    pub expansion_ppm_k: f64,
    /// Young's modulus (GPa).
    pub modulus_gpa: f64,
    /// Strain by which deposition left the film too short (1e-6). Only the films' proportions count: they curl the beam until it stands at its
    /// rest height. Without it the film's expansion, as if the beam had been released warm and cooled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_ppm: Option<f64>,
}

/// The materials of the beam's films and of the plate.
///
/// Defaults are handbook values for thin films where they differ from the bulk:
/// - Al: 200 W/(m K) (bulk 237, less for a sputtered micrometre), 900 J/(kg K) x 2700 kg/m3, 23e-6/K (the paper's
///   Table 1), 70 GPa.
/// - SiO2, PECVD: 1.3 W/(m K), 740 J/(kg K) x 2200 kg/m3, 0.7e-6/K (Table 1), 70 GPa.
/// - Pt, 0.2 um sputtered: 45 W/(m K) (bulk 71.6, scaled with the film's higher electrical resistivity by the
///   Wiedemann-Franz law), 133 J/(kg K) x 21450 kg/m3, 8.8e-6/K, 168 GPa.
/// - Si: 148 W/(m K), 712 J/(kg K) x 2330 kg/m3, 2.6e-6/K, 160 GPa.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Materials {
    /// Aluminium, the layer that expands.
    pub al: Material,
    /// Silicon dioxide, the layer that does not.
    pub sio2: Material,
    /// Platinum, the heater.
    pub pt: Material,
    /// Silicon, the plate.
    pub si: Material,
}

impl Default for Materials {
    fn default() -> Self {
        let material = |conductivity_w_m_k, heat_mj_m3_k, expansion_ppm_k, modulus_gpa| Material {
            conductivity_w_m_k,
            heat_mj_m3_k,
            expansion_ppm_k,
            modulus_gpa,
            residual_ppm: None,
        };
        Self {
            al: material(200.0, 2.43, 23.0, 70.0),
            sio2: material(1.3, 1.63, 0.7, 70.0),
            pt: material(45.0, 2.85, 8.8, 168.0),
            si: material(148.0, 1.66, 2.6, 160.0),
        }
    }
}

/// The name of a film's material in a mirror file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Film {
    /// Aluminium.
    Al,
    /// Silicon dioxide.
    Sio2,
    /// Platinum.
    Pt,
}

impl Materials {
    pub(crate) fn film(&self, film: Film) -> Material {
        match film {
            Film::Al => self.al,
            Film::Sio2 => self.sio2,
            Film::Pt => self.pt,
        }
    }
}

/// One film of a stack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// What it is made of.
    pub film: Film,
    /// Its thickness (um).
    pub um: f64,
}

/// What a stack of films does as one beam, per metre of width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Laminate {
    /// Conductance times length, per width: sum of k t (W/K).
    pub(crate) conductance_w_k: f64,
    /// Heat capacity per area (J/(m2 K)).
    pub(crate) heat_j_m2_k: f64,
    /// Curvature per kelvin of uniform heating (1/(m K)), positive towards the bottom film.
    pub(crate) curvature_per_m_k: f64,
    /// Curvature by residual strains, with the sign that they would have as expansions (1/m).
    pub(crate) residual_per_m: f64,
    /// Bending stiffness per width about the stack's own neutral axis (N m).
    pub(crate) stiffness_n_m: f64,
}

impl Laminate {
    /// Composite-beam theory over the films from the bottom up: axial force and moment both vanish on a free beam.
    pub(crate) fn new(layers: &[Layer], materials: &Materials) -> Self {
        let (mut conductance, mut heat) = (0.0, 0.0);
        let (mut area, mut first, mut second) = (0.0, 0.0, 0.0);
        // Of the expansions, and of the residual strains.
        let (mut force, mut moment) = ([0.0; 2], [0.0; 2]);
        let mut bottom = 0.0;
        for layer in layers {
            let (t, m) = (layer.um * 1e-6, materials.film(layer.film));
            let (centre, modulus) = (bottom + 0.5 * t, m.modulus_gpa * 1e9);
            let residual = m.residual_ppm.unwrap_or(m.expansion_ppm_k);
            conductance += m.conductivity_w_m_k * t;
            heat += m.heat_mj_m3_k * 1e6 * t;
            area += modulus * t;
            first += modulus * t * centre;
            second += modulus * t * (centre * centre + t * t / 12.0);
            for (index, ppm) in [m.expansion_ppm_k, residual].into_iter().enumerate() {
                let strain = ppm * 1e-6;
                force[index] += modulus * t * strain;
                moment[index] += modulus * t * strain * centre;
            }
            bottom += t;
        }
        let stiffness = second - first * first / area;
        let curvature = |index: usize| (moment[index] - first * force[index] / area) / stiffness;
        Self {
            conductance_w_k: conductance,
            heat_j_m2_k: heat,
            curvature_per_m_k: curvature(0),
            residual_per_m: curvature(1),
            stiffness_n_m: stiffness,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(film: Film, um: f64) -> Layer {
        Layer { film, um }
    }

    #[test]
    fn equal_bilayer_bends_as_timoshenko_says() {
        let layers = [layer(Film::Sio2, 1.2), layer(Film::Al, 1.2)];
        let got = Laminate::new(&layers, &Materials::default()).curvature_per_m_k;
        approx::assert_relative_eq!(got, 1.5 * 22.3e-6 / 2.4e-6, max_relative = 1e-9);
    }

    #[test]
    fn residual_strain_bends_as_the_expansion_of_a_kelvin_would() {
        let layers = [layer(Film::Sio2, 1.2), layer(Film::Al, 1.2)];
        let mut materials = Materials::default();
        let released_warm = Laminate::new(&layers, &materials);
        assert_eq!(
            released_warm.residual_per_m,
            released_warm.curvature_per_m_k
        );
        materials.sio2.residual_ppm = Some(-10.0);
        let got = Laminate::new(&layers, &materials);
        assert_eq!(got.curvature_per_m_k, released_warm.curvature_per_m_k);
        approx::assert_relative_eq!(
            got.residual_per_m,
            1.5 * 33e-6 / 2.4e-6,
            max_relative = 1e-9
        );
    }

    #[test]
    fn turning_the_stack_over_turns_the_curvature() {
        let mut layers = vec![
            layer(Film::Sio2, 1.0),
            layer(Film::Pt, 0.2),
            layer(Film::Al, 1.1),
        ];
        let up = Laminate::new(&layers, &Materials::default());
        layers.reverse();
        let down = Laminate::new(&layers, &Materials::default());
        approx::assert_relative_eq!(
            up.curvature_per_m_k,
            -down.curvature_per_m_k,
            max_relative = 1e-9
        );
        approx::assert_relative_eq!(up.stiffness_n_m, down.stiffness_n_m, max_relative = 1e-9);
    }
}
