//! The square root of the floating-point unit.
//!
//! `core` has no square root on stable, software ones cost tens of instructions, and micromath's
//! is off by up to 6 %. The Cortex-M4F computes it correctly rounded in one instruction.
#![no_std]

#[cfg(not(target_arch = "arm"))]
extern crate std;

/// Correctly rounded square root; NaN below zero.
#[cfg(target_arch = "arm")]
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    let root: f32;
    // SAFETY: VSQRT.F32 reads one register and writes another (ARMv7-M Architecture Reference
    // Manual, A7.7.255); it touches no memory and raises no trap on the M4F.
    #[allow(unsafe_code)]
    unsafe {
        core::arch::asm!(
            "vsqrt.f32 {root}, {x}",
            root = lateout(sreg) root,
            x = in(sreg) x,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    root
}

/// Correctly rounded square root; NaN below zero.
#[cfg(not(target_arch = "arm"))]
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    x.sqrt()
}

#[cfg(test)]
mod tests {
    #[test]
    fn is_the_square_root() {
        assert_eq!(super::sqrt(2.0), core::f32::consts::SQRT_2);
        assert!(super::sqrt(-1.0).is_nan());
    }
}
