use super::*;

const SECOND_BANK: usize = BANK_BYTES;

fn unlocked() -> (Flash, Memory, Clock) {
    let mut flash = Flash::new();
    let clock = Clock::new(100e6);
    for key in KEYS {
        flash.write(offset::KEYR, key, &clock).expect("a key");
    }
    (flash, Memory::new(&[], [0; 12]), clock)
}

#[test]
fn a_double_word_is_programmed_after_its_time_and_stalls_its_bank_only() {
    let (mut flash, mut memory, clock) = unlocked();
    flash.write(offset::CR, PG, &clock).expect("CR");
    flash.program(SECOND_BANK, 4, 0x0302_0100, &memory, &clock);
    flash.program(SECOND_BANK + 4, 4, 0x0706_0504, &memory, &clock);
    assert_eq!(flash.next_event(), 8170);
    assert_eq!(flash.stall(SECOND_BANK + 100), Some(8170));
    assert_eq!(flash.stall(0), None);
    flash.finish(&mut memory);
    let written = &memory.flash_bytes()[SECOND_BANK..SECOND_BANK + 9];
    assert_eq!(written, [0, 1, 2, 3, 4, 5, 6, 7, 0xff]);
}

#[test]
fn wrong_programming_is_told_by_its_flag() {
    let (mut flash, memory, clock) = unlocked();
    flash.program(0, 4, 0, &memory, &clock);
    assert_eq!(flash.read(offset::SR), Ok(PGSERR), "PG is off");
    flash.write(offset::SR, PGSERR, &clock).expect("SR");
    flash.write(offset::CR, PG, &clock).expect("CR");
    flash.program(4, 4, 0, &memory, &clock);
    assert_eq!(flash.read(offset::SR), Ok(PGAERR), "not aligned");
    flash.write(offset::SR, PGAERR, &clock).expect("SR");
    flash.program(0, 1, 0, &memory, &clock);
    assert_eq!(flash.read(offset::SR), Ok(SIZERR));
}

#[test]
fn power_that_goes_leaves_a_double_word_that_raises_the_nmi_until_it_is_erased() {
    let (mut flash, mut memory, clock) = unlocked();
    flash.write(offset::CR, PG, &clock).expect("CR");
    flash.program(SECOND_BANK + 8, 4, 0, &memory, &clock);
    flash.program(SECOND_BANK + 12, 4, 0, &memory, &clock);
    flash.cut(&mut memory);
    assert!(flash.meets_torn(SECOND_BANK + 12));
    assert_eq!(flash.read(offset::ECCR), Ok(ECCD | BK_ECC | 1));
    assert!(
        !flash.meets_torn(SECOND_BANK + 12),
        "until it is acknowledged"
    );
    assert!(flash.raises_nmi());
    flash.write(offset::ECCR, ECCD, &clock).expect("ECCR");
    assert!(!flash.raises_nmi());
    flash.write(offset::CR, PER | BKER, &clock).expect("CR");
    flash
        .write(offset::CR, PER | BKER | STRT, &clock)
        .expect("CR");
    flash.finish(&mut memory);
    assert!(!flash.meets_torn(SECOND_BANK + 12));
}
