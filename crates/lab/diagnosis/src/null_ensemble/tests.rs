use super::*;

/// The probe with these readings and this noise of the displacement.
fn session(reading: f64, noise_um: f64) -> Dataset {
    let mut data = probe();
    for observation in &mut data.observations {
        match observation.channel {
            Channel::Displacement => {
                (observation.value, observation.noise) = (10.0 * reading, noise_um);
            }
            Channel::Current(_) => observation.value = 1e-3 * reading,
        }
    }
    data
}

#[test]
fn an_ensemble_is_the_same_whatever_is_in_the_cache() {
    let folder = tempfile::tempdir().unwrap();
    let [before, session] = [session(1.0, 0.01), session(3.0, 0.02)];
    let fresh = NullEnsemble::new(&session, &Device::default(), None).unwrap();
    NullEnsemble::new(&before, &Device::default(), Some(folder.path())).unwrap();
    let after_another =
        NullEnsemble::new(&session, &Device::default(), Some(folder.path())).unwrap();
    assert_eq!(fresh.residuals, after_another.residuals);
    // They are of one kind, and share the file.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn residuals_are_standardised_as_the_session_is() {
    let (one, other) = (session(1.0, 0.02), session(30.0, 0.02));
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [&one, &other].map(|data| {
        let ensemble = NullEnsemble::new(data, &Device::default(), Some(folder.path())).unwrap();
        let current = ensemble.residuals[(3, 7)];
        current * standard_deviation(&data.observations[3])
    });
    assert_ne!(
        standard_deviation(&one.observations[3]),
        standard_deviation(&other.observations[3])
    );
    // Rounding of a division and a product.
    assert!((a - b).abs() <= 1e-12 * a.abs(), "{a} {b}");
}

#[test]
fn members_lack_little_that_a_base_could_be() {
    // A mirror that the base could not follow would differ from it by micrometres: hundreds of standard deviations.
    let ensemble = NullEnsemble::new(&session(1.0, 0.02), &Device::default(), None).unwrap();
    let mut sizes: Vec<f64> = ensemble
        .residuals
        .column_iter()
        .map(|column| (column.norm_squared() / column.len() as f64).sqrt())
        .collect();
    sizes.sort_by(f64::total_cmp);
    assert!(sizes[MEMBERS / 2] < 30.0, "{}", sizes[MEMBERS / 2]);
    assert!(sizes.iter().all(|size| size.is_finite() && *size > 0.0));
}
