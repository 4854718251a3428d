use super::*;

fn pwm() -> Timer {
    let mut timer = Timer::tim1();
    for (at, value) in [
        (offset::ARR, 999),
        (offset::RCR, 3),
        (offset::CCMR1, 0x6868),
        (offset::CCER, 0x11),
        (offset::CCR1, 250),
        (offset::EGR, 1),
        (offset::SR, 0),
        (offset::CR1, CEN | ARPE),
    ] {
        timer.write(at, value, 0).expect("a register");
    }
    timer
}

#[test]
fn an_update_comes_every_fourth_period_and_takes_the_compare_value_over() {
    let mut timer = pwm();
    timer.write(offset::CCR1, 700, 100).expect("CCR1");
    let updates: Vec<bool> = (1..=4)
        .map(|period| {
            assert_eq!(timer.overflow(), 1000 * period);
            timer.overflows(1000 * period)
        })
        .collect();
    assert_eq!(updates, [false, false, false, true]);
    assert_eq!(timer.compares().0[0], 700);
    assert_eq!(timer.read(offset::SR, 4000).expect("SR") & UIF, UIF);
}

#[test]
fn outputs_follow_enable_idle_state_and_compare_value() {
    let mut timer = pwm();
    assert_eq!(timer.output(0), Output::Floating, "MOE and OSSI are off");
    timer.write(offset::BDTR, OSSI, 0).expect("BDTR");
    assert_eq!(timer.output(0), Output::Level(false));
    timer.write(offset::CR2, 1 << 8, 0).expect("OIS1");
    assert_eq!(timer.output(0), Output::Level(true));
    timer.write(offset::BDTR, OSSI | MOE, 0).expect("BDTR");
    assert_eq!(timer.output(0), Output::Until(true, 250));
    assert_eq!(timer.output(2), Output::Floating, "CC3E is off");
}

#[test]
fn a_break_disables_the_outputs_until_software_enables_them_once_it_is_over() {
    let mut timer = pwm();
    let set_up = OSSI | BKE | MOE;
    timer.write(offset::BDTR, set_up, 0).expect("BDTR");
    assert!(!timer.set_break_input(true), "active low");
    assert!(timer.set_break_input(false));
    assert_eq!(timer.output(0), Output::Level(false));
    let flag = |timer: &Timer| timer.read(offset::SR, 0).expect("SR") & BIF != 0;
    timer.write(offset::SR, !BIF, 0).expect("SR");
    timer.write(offset::BDTR, set_up, 0).expect("BDTR");
    assert!(flag(&timer) && !timer.compares().1, "it lasts");
    timer.set_break_input(true);
    assert!(
        flag(&timer) && !timer.compares().1,
        "software has not acted"
    );
    timer.write(offset::SR, !BIF, 0).expect("SR");
    timer.write(offset::BDTR, set_up, 0).expect("BDTR");
    assert!(!flag(&timer) && timer.compares().1);
}

#[test]
fn outputs_that_are_enabled_automatically_come_back_with_the_next_update() {
    let mut timer = pwm();
    timer.write(offset::RCR, 0, 0).expect("RCR");
    timer.write(offset::BDTR, AOE | BKE | MOE, 0).expect("BDTR");
    timer.set_break_input(false);
    timer.overflows(1000);
    timer.overflows(2000);
    timer.overflows(3000);
    timer.overflows(4000);
    assert!(!timer.compares().1, "the break lasts");
    timer.set_break_input(true);
    timer.overflows(5000);
    assert!(timer.compares().1);
}

#[test]
fn a_compare_flag_is_set_when_the_count_is_reached() {
    let mut timer = pwm();
    timer.write(offset::DIER, 2, 0).expect("CC1IE");
    assert_eq!(timer.next_event(), 250);
    timer.advance(249);
    assert_eq!(timer.interrupts(), (false, false));
    timer.advance(250);
    assert_eq!(timer.interrupts(), (false, true));
    timer.write(offset::SR, !2, 260).expect("SR");
    assert_eq!(timer.interrupts(), (false, false));
    assert_eq!(timer.next_event(), 1000);
}
