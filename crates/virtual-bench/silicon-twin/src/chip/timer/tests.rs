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
