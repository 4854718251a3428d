//! What the test runner must notice: `cargo xtask test` expects exactly these outcomes.
#![no_std]
#![no_main]
#![expect(unsafe_code, reason = "one test faults on purpose")]

use mirror_firmware as _;

#[embedded_test::tests]
mod tests {
    #[test]
    fn passes() {
        defmt::println!("this one is well");
    }

    #[test]
    fn panics() {
        panic!("on purpose");
    }

    #[test]
    #[timeout(2)]
    fn hangs() {
        loop {
            cortex_m::asm::nop();
        }
    }

    #[test]
    fn faults() {
        // SAFETY: nothing is there; the access is meant to fault.
        unsafe { (0xf000_0000 as *const u32).read_volatile() };
    }

    #[test]
    #[should_panic]
    fn panics_as_it_should() {
        panic!("on purpose");
    }
}
