//! The firmware's log goes nowhere.

#![expect(unsafe_code, reason = "the trait of a logger")]

#[defmt::global_logger]
struct Nowhere;

// SAFETY: nothing is shared, since nothing is kept.
unsafe impl defmt::Logger for Nowhere {
    fn acquire() {}
    unsafe fn flush() {}
    unsafe fn release() {}
    unsafe fn write(_bytes: &[u8]) {}
}

defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());

#[defmt::panic_handler]
fn panic() -> ! {
    core::panic!("the firmware panicked")
}
