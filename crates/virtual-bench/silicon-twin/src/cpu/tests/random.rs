//! Random instructions.

use super::*;

/// Instructions with random operands, as Unicorn 2 (QEMU's Cortex-M4) executes them: the flags, r0 to r3 and s0 to s3
/// before, and flags, Q, FPSCR's flags and the same registers after.
const VECTORS: &str = include_str!("../vectors.txt");

fn words(text: &str) -> Vec<u32> {
    let word = |word| u32::from_str_radix(word, 16).expect("a hexadecimal number");
    text.split_whitespace().map(word).collect()
}

#[test]
fn random_instructions_do_what_another_model_says() {
    for line in VECTORS.lines() {
        let parts: Vec<Vec<u32>> = line.split('|').map(words).collect();
        let [code, before, after] = &*parts else {
            panic!("three parts: {line}");
        };
        let code: Vec<u16> = code.iter().map(|half| *half as u16).collect();
        let (mut cpu, mut ram) = at(&code);
        cpu.set_flags_from(before[0] << 28);
        cpu.r[..4].copy_from_slice(&before[1..5]);
        cpu.s[..4].copy_from_slice(&before[5..9]);
        run(&mut cpu, &mut ram, 1);
        let mut now = vec![nzcv(&cpu), cpu.q.into(), cpu.fpscr >> 28];
        now.extend(&cpu.r[..4]);
        now.extend(&cpu.s[..4]);
        assert_eq!(now, *after, "{line}");
    }
}
