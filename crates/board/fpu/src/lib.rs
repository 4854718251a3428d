//! The square root of the floating-point unit.
//!
//! `core` has no square root on stable, software ones cost tens of instructions, and micromath's
//! is off by up to 6 %. The Cortex-M4F computes it correctly rounded in one instruction.
#![no_std]

#[cfg(not(target_abi = "eabihf"))]
extern crate std;

/// Correctly rounded square root; NaN below zero.
// By way of a core register, because inline assembly takes no floating-point registers on targets with single precision only.
// SAFETY: VSQRT.F32 touches no memory and raises no trap on the M4F (ARMv7-M Architecture Reference Manual, A7.7.255), and the
// one register that is used beside the operand is named.
#[cfg(target_abi = "eabihf")]
#[allow(unsafe_code)]
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    let mut bits = x.to_bits();
    unsafe {
        core::arch::asm!(
            "vmov s15, {bits}",
            "vsqrt.f32 s15, s15",
            "vmov {bits}, s15",
            bits = inout(reg) bits,
            out("s15") _,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    f32::from_bits(bits)
}

/// Correctly rounded square root; NaN below zero.
#[cfg(not(target_abi = "eabihf"))]
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
