//! Error bounds of what the firmware computes approximately, on the target itself.
#![no_std]
#![no_main]

use mirror_firmware as _;

#[embedded_test::tests]
mod tests {
    use fpu::sqrt;

    /// Floats spread evenly over the exponents that voltages, powers and temperatures take.
    fn floats() -> impl Iterator<Item = f32> {
        let (low, high) = (1e-9_f32.to_bits(), 1e6_f32.to_bits());
        (low..high).step_by(20_011).map(f32::from_bits)
    }

    /// The halves of the gaps around a correctly rounded root enclose the exact one; their squares
    /// are exact in f64.
    #[test]
    fn hardware_square_root_is_correctly_rounded() {
        for x in floats() {
            let root = sqrt(x);
            let half_gap = |neighbour: f32| (f64::from(root) + f64::from(neighbour)) / 2.0;
            let low = half_gap(f32::from_bits(root.to_bits() - 1));
            let high = half_gap(f32::from_bits(root.to_bits() + 1));
            let exact = f64::from(x);
            assert!(
                low * low <= exact && exact <= high * high,
                "sqrt({x}) is not {root}"
            );
        }
    }

    #[test]
    fn hardware_square_root_answers_every_input() {
        assert!(sqrt(-1.0).is_nan());
        assert!(sqrt(f32::NAN).is_nan());
        assert_eq!(sqrt(0.0), 0.0);
        assert_eq!(sqrt(f32::INFINITY), f32::INFINITY);
    }

    /// Why the core does not use it: at 3.5 V six percent would be 15 um. The bound holds for
    /// whoever uses it where percents do not matter.
    #[test]
    fn micromath_square_root_is_within_seven_percent_and_no_better_than_five() {
        let worst = floats()
            .map(|x| {
                let approximate = micromath::F32(x).sqrt().0;
                (approximate / sqrt(x) - 1.0).abs()
            })
            .fold(0.0, f32::max);
        defmt::println!(
            "micromath's square root is off by up to {=f32} %",
            worst * 100.0
        );
        assert!((0.05..0.07).contains(&worst), "{worst}");
    }
}
