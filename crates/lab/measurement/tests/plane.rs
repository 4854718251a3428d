//! Planes by principal components.

use measurement::Plane;
use proptest::prelude::*;

/// A scan of 5 by 5 points over 100 um.
fn scan(z_um: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
    let place = |i: usize| -50.0 + 25.0 * i as f64;
    (0..25)
        .map(|i| (place(i % 5), place(i / 5)))
        .map(|(x, y)| [x, y, z_um(x, y)])
        .collect()
}

#[test]
fn points_that_span_no_plane_give_none() {
    assert_eq!(Plane::through(&scan(|_, _| 0.0)[..2]), None);
    let line: Vec<[f64; 3]> = (0..9)
        .map(|i| [f64::from(i), f64::from(2 * i), 1.0])
        .collect();
    assert_eq!(Plane::through(&line), None);
}

proptest! {
    #[test]
    fn a_tilted_plate_has_its_two_angles_and_its_scatter(
        x_deg in -5.0_f64..5.0, y_deg in -5.0_f64..5.0, z_um in -100.0_f64..100.0,
        scatter in 0.0_f64..0.1,
    ) {
        let slopes = (-y_deg.to_radians().tan(), x_deg.to_radians().tan());
        let points = scan(|x, y| {
            // It sums to nothing along every line of the scan.
            let bump = scatter * ((x / 25.0).powi(2) - 2.0) * ((y / 25.0).powi(2) - 2.0);
            z_um + slopes.0 * x + slopes.1 * y + bump
        });
        let plane = Plane::through(&points).expect("a plane");
        prop_assert!((plane.tilt_x_deg - x_deg).abs() < 1e-3, "{plane:?}");
        prop_assert!((plane.tilt_y_deg - y_deg).abs() < 1e-3, "{plane:?}");
        prop_assert!((plane.z_um - z_um).abs() < 1e-9);
        // The mean square of the bump is 2.8 squared; distances count at right angles to the plane.
        let across = 2.8 * scatter / (1.0 + slopes.0.powi(2) + slopes.1.powi(2)).sqrt();
        prop_assert!((plane.rms_um - across).abs() < 0.02 * scatter + 1e-6, "{plane:?}");
    }
}
