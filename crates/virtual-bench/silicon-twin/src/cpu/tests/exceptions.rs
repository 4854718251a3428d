//! Interrupts, faults, and what waits for them.

use super::*;

/// A processor whose interrupts `lines` are enabled, all at priority 0x20.
fn interruptible(code: &[u16], lines: u128) -> (Cpu, Ram) {
    let (mut cpu, mut ram) = at(code);
    ram.write::<2>(HANDLER, BX_LR.into()).expect("room");
    cpu.write_system(&mut ram, 0xe000_e100, 4, lines as u32)
        .expect("ISER");
    for address in (0xe000_e400..0xe000_e420).step_by(4) {
        cpu.write_system(&mut ram, address, 4, 0x2020_2020)
            .expect("IPR");
    }
    (cpu, ram)
}

#[test]
fn an_interrupt_keeps_and_restores_what_it_preempts() {
    let (mut cpu, mut ram) = interruptible(&[NOP, NOP], 1 << 3);
    (cpu.r[0], cpu.r[12], cpu.c) = (7, 8, true);
    cpu.system.set_lines(1 << 3);
    run(&mut cpu, &mut ram, 1);
    assert_eq!((cpu.next(), cpu.exception()), (HANDLER, 16 + 3));
    assert_eq!(cpu.r[LR], 0xffff_fff9);
    (cpu.r[0], cpu.r[12], cpu.c) = (0, 0, false);
    cpu.system.set_lines(0);
    run(&mut cpu, &mut ram, 1);
    assert_eq!((cpu.next(), cpu.exception()), (CODE, 0));
    assert_eq!((cpu.r[0], cpu.r[12], cpu.c, cpu.r[SP]), (7, 8, true, STACK));
}

#[test]
fn a_line_that_stays_high_interrupts_again_and_one_that_is_masked_does_not() {
    let (mut cpu, mut ram) = interruptible(&[NOP, NOP], 1);
    cpu.primask = true;
    cpu.system.set_lines(1);
    run(&mut cpu, &mut ram, 1);
    assert_eq!((cpu.next(), cpu.exception()), (CODE + 2, 0));
    cpu.primask = false;
    cpu.system.attention = true;
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.exception(), 16);
    run(&mut cpu, &mut ram, 2);
    assert_eq!(cpu.exception(), 16, "again");
}

#[test]
fn the_more_urgent_interrupt_goes_first_and_preempts() {
    let (mut cpu, mut ram) = interruptible(&[NOP], 0b11);
    cpu.write_system(&mut ram, 0xe000_e401, 1, 0x10)
        .expect("IPR");
    cpu.system.set_lines(0b01);
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.exception(), 16);
    cpu.system.set_lines(0b11);
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.exception(), 17, "0x10 goes before 0x20");
    cpu.system.set_lines(0b01);
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.exception(), 16);
}

#[test]
fn floating_point_registers_are_kept_where_a_handler_uses_them() {
    // vmov.f32 s0, #1.5, in the program and in the handler
    let (mut cpu, mut ram) = interruptible(&[0xeeb7, 0x0a08, NOP], 1);
    for (address, half) in (HANDLER..).step_by(2).zip([0xeeb0, 0x0a00, BX_LR]) {
        ram.write::<2>(address, half.into()).expect("room");
    }
    run(&mut cpu, &mut ram, 1);
    cpu.s[15] = 15;
    cpu.system.set_lines(1);
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.r[LR], 0xffff_ffe9, "an extended frame");
    assert_eq!(cpu.r[SP], STACK - 0x68);
    run(&mut cpu, &mut ram, 1);
    assert_eq!(f32::from_bits(cpu.s[0]), 2.0, "the handler's");
    cpu.s[15] = 0;
    cpu.system.set_lines(0);
    run(&mut cpu, &mut ram, 1);
    assert_eq!(
        (f32::from_bits(cpu.s[0]), cpu.s[15], cpu.r[SP]),
        (1.5, 15, STACK)
    );
}

#[test]
fn what_waits_for_an_event_is_woken_by_one() {
    // wfe; wfe
    let (mut cpu, mut ram) = interruptible(&[0xbf20, 0xbf20], 1);
    cpu.has_event = true;
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.sleep(), Sleep::Awake, "there was one");
    run(&mut cpu, &mut ram, 1);
    assert_eq!(cpu.sleep(), Sleep::ForEvent);
    assert_eq!(cpu.step(&mut ram), Ok(0));
    cpu.system.set_lines(1);
    run(&mut cpu, &mut ram, 1);
    assert_eq!((cpu.sleep(), cpu.exception()), (Sleep::Awake, 16));
}

#[test]
fn faults_are_told_or_handled() {
    // udf #0
    let (mut cpu, mut ram) = at(&[0xde00]);
    let Err(Halt::Fault(fault)) = cpu.step(&mut ram) else {
        panic!("it stops");
    };
    assert_eq!(fault.to_string(), "undefined instruction");
    assert_eq!(cpu.next(), CODE);
    let (mut cpu, mut ram) = at(&[0xde00]);
    cpu.stops_at_faults = false;
    run(&mut cpu, &mut ram, 1);
    assert_eq!((cpu.next(), cpu.exception()), (HANDLER, 3), "HardFault");
    ram.write::<2>(HANDLER, 0xde00).expect("room");
    assert!(matches!(cpu.step(&mut ram), Err(Halt::Lockup(_))));
}
