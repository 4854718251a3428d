//! Small programs against what the architecture manual says of them. The encodings are LLVM's (`llvm-mc
//! --triple=thumbv7em-none-eabihf --mcpu=cortex-m4 --show-encoding`); each stands behind its assembly.

use super::decode::decode;
use super::instruction::{Decoded, is_wide};
use super::*;

mod exceptions;
mod random;

/// Memory from address 0 on, the code in it.
struct Ram(Vec<u8>);

const CODE: u32 = 0x100;
const HANDLER: u32 = 0x200;
const STACK: u32 = 0x800;

impl Ram {
    fn with(code: &[u16]) -> Self {
        let mut ram = Self(vec![0; 0x1000]);
        let vectors = [STACK, CODE | 1];
        for (address, word) in (0..).step_by(4).zip(vectors) {
            ram.write::<4>(address, word).expect("room");
        }
        for exception in 2..64 {
            ram.write::<4>(4 * exception, HANDLER | 1).expect("room");
        }
        for (address, half) in (CODE..).step_by(2).zip(code) {
            ram.write::<2>(address, (*half).into()).expect("room");
        }
        ram
    }
}

impl Bus for Ram {
    fn read<const BYTES: u32>(&mut self, address: u32) -> Result<u32, Abort> {
        let at = address as usize;
        let bytes = self.0.get(at..at + BYTES as usize).ok_or(Abort::Fault)?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |word, byte| word << 8 | u32::from(*byte)))
    }

    fn write<const BYTES: u32>(&mut self, address: u32, value: u32) -> Result<(), Abort> {
        let at = address as usize;
        let slot = self
            .0
            .get_mut(at..at + BYTES as usize)
            .ok_or(Abort::Fault)?;
        slot.copy_from_slice(&value.to_le_bytes()[..BYTES as usize]);
        Ok(())
    }

    fn fetch(&mut self, address: u32) -> Result<Decoded, Abort> {
        let first = self.read::<2>(address)? as u16;
        let second = match is_wide(first) {
            true => self.read::<2>(address + 2)? as u16,
            false => 0,
        };
        Ok(decode(first, second))
    }

    fn request_reset(&mut self) {}

    fn cycles(&self) -> u64 {
        0
    }
}

/// A processor at `code`, its floating-point unit on.
fn at(code: &[u16]) -> (Cpu, Ram) {
    let mut ram = Ram::with(code);
    let mut cpu = Cpu::new(&mut ram, 0).expect("vectors");
    cpu.write_system(&mut ram, 0xe000_ed88, 4, 0xf << 20)
        .expect("CPACR");
    (cpu, ram)
}

fn run(cpu: &mut Cpu, ram: &mut Ram, steps: usize) {
    for _ in 0..steps {
        cpu.step(ram).expect("it goes on");
    }
}

fn nzcv(cpu: &Cpu) -> u32 {
    cpu.xpsr() >> 28
}

/// What one instruction makes of r0 to r3 and, with the carry set before, of the flags.
#[track_caller]
fn check(assembly: &str, code: &[u16], before: [u32; 4], r0: u32, flags: u32) {
    let (mut cpu, mut ram) = at(code);
    cpu.r[..4].copy_from_slice(&before);
    cpu.c = true;
    run(&mut cpu, &mut ram, 1);
    assert_eq!(
        (cpu.r[0], nzcv(&cpu)),
        (r0, flags),
        "{assembly}: r0 {:#x}",
        cpu.r[0]
    );
}

const C: u32 = 0b0010;

#[test]
fn shifts_and_constants() {
    check("movs r0, #0", &[0x2000], [9, 0, 0, 0], 0, 0b0110);
    check("lsls r0, r1, #31", &[0x07c8], [0, 3, 0, 0], 1 << 31, 0b1010);
    check(
        "asrs r0, r1, #32",
        &[0x1008],
        [0, 1 << 31, 0, 0],
        u32::MAX,
        0b1010,
    );
    check(
        "mov.w r0, #0xff00ff",
        &[0xf04f, 0x10ff],
        [0; 4],
        0x00ff_00ff,
        C,
    );
    check(
        "movs.w r0, #0x80000000",
        &[0xf05f, 0x4000],
        [0; 4],
        1 << 31,
        0b1010,
    );
    check(
        "mvn.w r0, r1, ror #4",
        &[0xea6f, 0x1031],
        [0, 0xf, 0, 0],
        0x0fff_ffff,
        C,
    );
    check(
        "movt r0, #0x1234",
        &[0xf2c1, 0x2034],
        [0xaaaa_5555, 0, 0, 0],
        0x1234_5555,
        C,
    );
}

#[test]
fn additions_carry_and_overflow() {
    let top = i32::MAX as u32;
    check(
        "adds r0, r1, r2",
        &[0x1888],
        [0, top, 1, 0],
        1 << 31,
        0b1001,
    );
    check("subs r0, r1, r2", &[0x1a88], [0, 1, 2, 0], u32::MAX, 0b1000);
    check(
        "adcs.w r0, r1, r2",
        &[0xeb51, 0x0002],
        [0, u32::MAX, 0, 0],
        0,
        0b0110,
    );
    check(
        "sbcs.w r0, r1, r2",
        &[0xeb71, 0x0002],
        [0, 5, 5, 0],
        0,
        0b0110,
    );
    check(
        "rsbs r0, r1, #0",
        &[0x4248],
        [0, 1 << 31, 0, 0],
        1 << 31,
        0b1001,
    );
}

#[test]
fn bit_fields_and_reversals() {
    check(
        "bfi r0, r1, #4, #8",
        &[0xf361, 0x100b],
        [u32::MAX, 0x12, 0, 0],
        0xffff_f12f,
        C,
    );
    check(
        "ubfx r0, r1, #4, #8",
        &[0xf3c1, 0x1007],
        [0, 0xab_cdef, 0, 0],
        0xde,
        C,
    );
    check(
        "sbfx r0, r1, #4, #8",
        &[0xf341, 0x1007],
        [0, 0xab_cdef, 0, 0],
        0xffff_ffde,
        C,
    );
    check("clz r0, r1", &[0xfab1, 0xf081], [0, 0x10, 0, 0], 27, C);
    check("rbit r0, r1", &[0xfa91, 0xf0a1], [0, 1, 0, 0], 1 << 31, C);
    check("revsh r0, r1", &[0xbac8], [0, 0x80, 0, 0], 0xffff_8000, C);
    check(
        "uxtab r0, r1, r2, ror #8",
        &[0xfa51, 0xf092],
        [0, 1, 0xab00, 0],
        0xac,
        C,
    );
    let packed = [0, 0x1111_2222, 0x3333_4444, 0];
    check(
        "pkhtb r0, r1, r2, asr #16",
        &[0xeac1, 0x4022],
        packed,
        0x1111_3333,
        C,
    );
}

#[test]
fn products_and_quotients() {
    let minus = |value: u32| value.wrapping_neg();
    check("udiv r0, r1, r2", &[0xfbb1, 0xf0f2], [0, 7, 2, 0], 3, C);
    check(
        "sdiv r0, r1, r2",
        &[0xfb91, 0xf0f2],
        [0, minus(7), 2, 0],
        minus(3),
        C,
    );
    check(
        "sdiv r0, r1, r2",
        &[0xfb91, 0xf0f2],
        [0, 1 << 31, u32::MAX, 0],
        1 << 31,
        C,
    );
    check("udiv r0, r1, r2", &[0xfbb1, 0xf0f2], [5, 7, 0, 0], 0, C);
    check(
        "umull r0, r3, r1, r2",
        &[0xfba1, 0x0302],
        [0, u32::MAX, 2, 0],
        u32::MAX - 1,
        C,
    );
    check(
        "smlal r0, r3, r1, r2",
        &[0xfbc1, 0x0302],
        [1, u32::MAX, 2, 0],
        u32::MAX,
        C,
    );
    check(
        "smulbt r0, r1, r2",
        &[0xfb11, 0xf012],
        [0, 0xffff, 3 << 16, 0],
        minus(3),
        C,
    );
    check("mls r0, r1, r2, r3", &[0xfb01, 0x3012], [0, 2, 3, 10], 4, C);
    check(
        "smmulr r0, r1, r2",
        &[0xfb51, 0xf012],
        [0, 1 << 30, 2, 0],
        1,
        C,
    );
}

#[test]
fn saturation() {
    check(
        "ssat r0, #8, r1",
        &[0xf301, 0x0007],
        [0, 1000, 0, 0],
        127,
        C,
    );
    check(
        "usat r0, #8, r1",
        &[0xf381, 0x0008],
        [0, u32::MAX, 0, 0],
        0,
        C,
    );
    let lanes = [0, 0x80ff_0102, 0x80ff_0304, 0];
    check(
        "uqadd8 r0, r1, r2",
        &[0xfa81, 0xf052],
        lanes,
        0xffff_0406,
        C,
    );
}

#[test]
fn an_if_then_block_executes_the_side_that_is_met() {
    // ite eq; moveq r0, #1; movne r0, #2
    for (z, expected) in [(true, 1), (false, 2)] {
        let (mut cpu, mut ram) = at(&[0xbf0c, 0x2001, 0x2002]);
        cpu.z = z;
        run(&mut cpu, &mut ram, 3);
        assert_eq!((cpu.r[0], cpu.it), (expected, 0));
        assert_eq!(cpu.z, z, "the flags stay within a block");
    }
}

#[test]
fn loads_and_stores_move_their_base() {
    // ldr r0, [r1, #4]!
    let (mut cpu, mut ram) = at(&[0xf851, 0x0f04]);
    ram.write::<4>(0x404, 77).expect("room");
    cpu.r[1] = 0x400;
    run(&mut cpu, &mut ram, 1);
    assert_eq!((cpu.r[0], cpu.r[1]), (77, 0x404));
    // stmdb r1!, {r0, r2}; ldrd r0, r2, [r1, #8]
    let (mut cpu, mut ram) = at(&[0xe921, 0x0005, 0xe9d1, 0x0202]);
    (cpu.r[0], cpu.r[1], cpu.r[2]) = (5, 0x408, 6);
    ram.write::<4>(0x408, 1).expect("room");
    ram.write::<4>(0x40c, 2).expect("room");
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.r[1], 0x400);
    assert_eq!((ram.read::<4>(0x400), ram.read::<4>(0x404)), (Ok(5), Ok(6)));
    run(&mut cpu, &mut ram, 1);
    assert_eq!((cpu.r[0], cpu.r[2]), (1, 2));
}

#[test]
fn branches_reach_what_they_say() {
    for (assembly, code, offset) in [
        ("bl . - 4", &[0xf7ff, 0xfffe][..], 0),
        ("b.w . - 1024", &[0xf7ff, 0xbe00], -1020),
        ("beq.w . + 256", &[0xf000, 0x8080], 260),
        ("cbz r0, . + 8", &[0xb120], 12),
    ] {
        let (mut cpu, mut ram) = at(code);
        cpu.z = true;
        run(&mut cpu, &mut ram, 1);
        assert_eq!(cpu.next(), CODE.wrapping_add_signed(offset), "{assembly}");
    }
    // tbb [r1, r2]
    let (mut cpu, mut ram) = at(&[0xe8d1, 0xf002]);
    ram.write::<1>(0x402, 9).expect("room");
    (cpu.r[1], cpu.r[2]) = (0x400, 2);
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.next(), CODE + 4 + 18);
}

#[test]
fn floating_point() {
    // vadd.f32 s0, s1, s2; vfma.f32 s0, s1, s2; vcmp.f32 s0, s1; vmrs APSR_nzcv, fpscr; vcvt.s32.f32 s0, s1
    let code = [
        0xee30, 0x0a81, 0xeea0, 0x0a81, 0xeeb4, 0x0a60, 0xeef1, 0xfa10, 0xeebd, 0x0ae0,
    ];
    let (mut cpu, mut ram) = at(&code);
    (cpu.s[1], cpu.s[2]) = (2.5_f32.to_bits(), 4.0_f32.to_bits());
    run(&mut cpu, &mut ram, 2);
    assert_eq!(f32::from_bits(cpu.s[0]), 6.5 + 10.0);
    run(&mut cpu, &mut ram, 2);
    assert_eq!(nzcv(&cpu), 0b0010, "greater");
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.s[0], 2);
    // vmov.f32 s0, #1.5; vpush {s16-s19}; vldr s0, [r1, #4]; vldr d1, [r1, #8]
    let code = [
        0xeeb7, 0x0a08, 0xed2d, 0x8a04, 0xed91, 0x0a01, 0xed91, 0x1b02,
    ];
    let (mut cpu, mut ram) = at(&code);
    cpu.r[1] = 0x400;
    (cpu.s[16], cpu.s[19]) = (16, 19);
    ram.write::<4>(0x404, 1).expect("room");
    ram.write::<4>(0x408, 2).expect("room");
    ram.write::<4>(0x40c, 3).expect("room");
    run(&mut cpu, &mut ram, 1);
    assert_eq!(f32::from_bits(cpu.s[0]), 1.5);
    run(&mut cpu, &mut ram, 3);
    assert_eq!((cpu.s[0], cpu.s[2], cpu.s[3]), (1, 2, 3));
    assert_eq!(cpu.r[SP], STACK - 16);
    assert_eq!(
        (ram.read::<4>(STACK - 16), ram.read::<4>(STACK - 4)),
        (Ok(16), Ok(19))
    );
}

const NOP: u16 = 0xbf00;
const BX_LR: u16 = 0x4770;
