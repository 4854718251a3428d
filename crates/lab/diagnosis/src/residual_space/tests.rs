use super::*;

fn space(members: &DMatrix<f64>, noise: f64, jacobian: &DMatrix<f64>) -> ResidualSpace<Session> {
    let noise = DVector::repeat(jacobian.nrows(), noise);
    let discrepancy = Arc::new(ModelDiscrepancy::new(members, &noise));
    let all = (0..members.ncols()).collect();
    ResidualSpace::new(jacobian, &discrepancy, all)
}

#[test]
fn a_base_is_free_a_discrepancy_costs_its_prior_and_the_rest_its_noise() {
    // J = e1, U = e2, noise 1: V = diag(1, 1 + s^2, 1), and e1 is free.
    let jacobian = DMatrix::from_column_slice(3, 1, &[1.0, 0.0, 0.0]);
    let members = DMatrix::from_column_slice(3, 1, &[0.0, 1.0, 0.0]);
    let space = space(&members, 1.0, &jacobian);
    let residual = space.vector(&DVector::from_vec(vec![7.0, 2.0, 3.0]));
    let by_hand = 4.0 / (1.0 + DISCREPANCY_SCALE * DISCREPANCY_SCALE) + 9.0;
    // The ridge leaves 1e-9 of the base's 49.
    assert!((residual.norm_squared() - by_hand).abs() < 1e-7);
    let other = space.vector(&DVector::from_vec(vec![-5.0, 1.0, 1.0]));
    let by_hand = 2.0 / (1.0 + DISCREPANCY_SCALE * DISCREPANCY_SCALE) + 3.0;
    assert!((residual.dot(&other) - by_hand).abs() < 1e-7);
}

#[test]
fn the_product_is_that_of_generalised_least_squares() {
    // Three readings, two parameters, one member: the matrix of the module's head, formed.
    let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 3.0]);
    let member = DVector::from_vec(vec![0.5, -1.0, 2.0]);
    let noise = 0.5;
    let space = space(
        &DMatrix::from_columns(std::slice::from_ref(&member)),
        noise,
        &jacobian,
    );
    let residual = DVector::from_vec(vec![1.0, -2.0, 0.7]);
    let covariance = DMatrix::identity(3, 3) * noise * noise
        + &member * member.transpose() * DISCREPANCY_SCALE * DISCREPANCY_SCALE;
    let precision = covariance.try_inverse().unwrap();
    let weighed = &precision * &jacobian;
    let of_base = (jacobian.transpose() * &weighed).try_inverse().unwrap();
    let projector = &precision - &weighed * of_base * weighed.transpose();
    let formed = (residual.transpose() * projector * &residual)[(0, 0)];
    let product = space.vector(&residual).norm_squared();
    // The ridge is 1e-9 of the normal matrix.
    assert!(
        (product - formed).abs() < 1e-6 * formed,
        "{product} {formed}"
    );
}

#[test]
fn a_remainder_is_what_base_and_discrepancy_leave() {
    let jacobian = DMatrix::from_column_slice(3, 1, &[1.0, 0.0, 0.0]);
    let members = DMatrix::from_column_slice(3, 1, &[0.0, 1.0, 0.0]);
    let space = space(&members, 1.0, &jacobian);
    let residual = DVector::from_vec(vec![7.0, 2.0, 3.0]);
    let vector = space.vector(&residual);
    let left = space.remainder(&vector);
    // Of the member's direction the posterior mean takes s^2 / (1 + s^2).
    let variance = DISCREPANCY_SCALE * DISCREPANCY_SCALE;
    let by_hand = DVector::from_vec(vec![0.0, 2.0 / (1.0 + variance), 3.0]);
    assert!((left - by_hand).norm() < 1e-7);
    assert!((space.standardised(&vector) - residual).norm() < 1e-12);
}

#[test]
fn arithmetic_is_that_of_the_residuals() {
    let jacobian = DMatrix::from_column_slice(3, 1, &[1.0, 2.0, 0.0]);
    let members = DMatrix::from_column_slice(3, 1, &[0.0, 1.0, 1.0]);
    let space = space(&members, 0.3, &jacobian);
    let (a, b) = (
        DVector::from_vec(vec![1.0, 2.0, -1.0]),
        DVector::from_vec(vec![0.5, 0.0, 4.0]),
    );
    let combined = &space.vector(&a) - &(&space.vector(&b) * 3.0);
    let at_once = space.vector(&(&a - &b * 3.0));
    let off = &combined - &at_once;
    // Rounding of numbers of some hundreds.
    assert!(off.norm_squared().abs() < 1e-20 * combined.norm_squared());
    let around: ResidualSpace<AroundRefit> = space.around(&jacobian);
    let imported = around.import(&combined);
    assert!((imported.norm_squared() / combined.norm_squared() - 1.0).abs() < 1e-12);
}

#[test]
fn one_mirror_that_is_fitted_badly_explains_little() {
    // Three members along e1 to e3, the last of size `last`. What is like it is explained as far as twice the median reaches.
    let misfit = |last: f64| {
        let members = DMatrix::from_diagonal(&DVector::from_vec(vec![5.0, 5.0, last, 0.0]));
        let members = members.columns(0, 3).into_owned();
        let jacobian = DMatrix::from_column_slice(4, 1, &[0.0, 0.0, 0.0, 1.0]);
        let space = space(&members, 1.0, &jacobian);
        let like_the_last = space.vector(&DVector::from_vec(vec![0.0, 0.0, 20.0, 0.0]));
        like_the_last.norm_squared()
    };
    let by_hand = |size: f64| 400.0 / (1.0 + DISCREPANCY_SCALE.powi(2) / 3.0 * size * size);
    assert!((misfit(5.0) / by_hand(5.0) - 1.0).abs() < 1e-9);
    assert!((misfit(5000.0) / by_hand(2.0 * 5.0) - 1.0).abs() < 1e-9);
}

#[test]
fn what_a_form_may_be_off_by_costs_its_prior() {
    // J = e1, a form that may be off by 3 e2, noise 1: V = diag(1, 1 + 9, 1), and e1 is free.
    let jacobian = DMatrix::from_column_slice(3, 1, &[1.0, 0.0, 0.0]);
    let form = DMatrix::from_column_slice(3, 1, &[0.0, 3.0, 0.0]);
    let none = ModelDiscrepancy::new(&DMatrix::zeros(3, 0), &DVector::repeat(3, 1.0));
    let discrepancy = Arc::new(none.with_forms(&form));
    let space: ResidualSpace<Session> = ResidualSpace::new(&jacobian, &discrepancy, Vec::new());
    let residual = space.vector(&DVector::from_vec(vec![7.0, 5.0, 2.0]));
    // The ridge leaves 1e-9 of the base's 49.
    assert!((residual.norm_squared() - (25.0 / 10.0 + 4.0)).abs() < 1e-7);
    // Around another fit it is the same.
    let around: ResidualSpace<AroundRefit> =
        space.around(&DMatrix::from_column_slice(3, 1, &[0.0, 0.0, 1.0]));
    let moved = around.import(&residual);
    assert!((moved.norm_squared() - (49.0 + 25.0 / 10.0)).abs() < 1e-7);
}
