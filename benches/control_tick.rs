//! Instructions of one four-channel control tick.
//!
//! Under `-icount shift=6` QEMU lets 64 ns pass with every instruction, and SysTick counts 25 MHz:
//! 1.6 counts an instruction, the same in every run. (On a real M4F, cycles are another matter.)
#![no_std]
#![no_main]

use core::hint::black_box;

use control_core::{
    AdcCode, Ampere, Calibration, Controller, LANES, Micrometre, PwmCode, Setpoint, SupplyCode,
    Volt,
};
use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use mirror_firmware::board::Sensed;
use mirror_firmware::control::Control;
use mirror_firmware::factory;
use mirror_firmware::mailbox::{MAILBOX, Order};
use mirror_protocol::ChannelState;
use protection::{Lease, Protection, Reading};
use semihosting::process::ExitCode;
use static_cell::StaticCell;

const REPETITIONS: u32 = 1000;
/// The heaters are checked and the mirror stands after so many ticks.
const TICKS_TO_SETTLE: u32 = 50_000;
/// Counts of SysTick in 5 instructions.
const COUNTS_PER_5_INSTRUCTIONS: u32 = 8;
const SYSTICK_TOP: u32 = 0x00ff_ffff;

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(peripherals) = Peripherals::take() else {
        ExitCode::FAILURE.exit_process()
    };
    let mut clock = peripherals.SYST;
    clock.set_clock_source(SystClkSource::Core);
    clock.set_reload(SYSTICK_TOP);
    clock.clear_current();
    clock.enable_counter();

    let z = Setpoint::Position(Micrometre(120.0));
    let mut calibration = factory::calibration();
    let mut controller = Controller::new(&mut calibration);
    report("control core: one step at a position", || {
        black_box(controller.step(
            black_box(z),
            black_box([Volt(2.742); LANES]),
            black_box([Ampere(5.7e-3); LANES]),
        ));
    });

    let mut calibration = factory::calibration();
    let mut controller = Controller::new(&mut calibration);
    report("codes in, codes out: step with conversions", || {
        let currents = black_box([AdcCode(29_884); LANES]).map(AdcCode::current);
        let applied = black_box([PwmCode(2742); LANES]).map(PwmCode::drive);
        black_box(
            controller
                .step(black_box(z), applied, currents)
                .drives
                .map(PwmCode::nearest),
        );
    });

    static CALIBRATION: StaticCell<Calibration> = StaticCell::new();
    let calibration = CALIBRATION.init(factory::calibration());
    let mut protection = Protection::new(calibration.lanes());
    let mut control = Control::new(Controller::new(calibration), &MAILBOX);
    MAILBOX.post(Order::Drive(z, Lease::FOREVER));
    let mut sensed = Sensed::default();
    for _ in 0..TICKS_TO_SETTLE {
        sensed = heaters(control.tick(sensed));
    }
    report("whole tick: mailbox, protection, step, telemetry", || {
        black_box(control.tick(black_box(sensed)));
    });
    if MAILBOX.latest().states != [ChannelState::Driving; LANES] {
        defmt::error!("what was counted is no drive");
        ExitCode::FAILURE.exit_process()
    }

    let reading = Reading {
        codes: sensed.currents,
        currents: sensed.currents.map(AdcCode::current),
        supply: sensed.supply,
        missed_ticks: 0,
    };
    let _ = protection.command(Lease::FOREVER);
    report("protection alone", || {
        black_box(protection.tick(
            black_box(z),
            black_box([Volt(2.742); LANES]),
            black_box(&reading),
        ));
    });

    ExitCode::SUCCESS.exit_process()
}

/// What heaters of 481 ohm make of these codes.
fn heaters(codes: [PwmCode; LANES]) -> Sensed {
    Sensed {
        currents: codes.map(|code| AdcCode((code.drive().0 / 481.0 / 12.5e-3 * 65536.0) as u16)),
        supply: SupplyCode::from_millivolt(5000),
        ..Sensed::default()
    }
}

fn report(name: &str, mut tick: impl FnMut()) {
    tick();
    let empty = counts(|| {
        black_box(());
    });
    let counted = counts(&mut tick) - empty;
    let instructions = counted * 5 / COUNTS_PER_5_INSTRUCTIONS / REPETITIONS;
    defmt::println!("{=str}: {=u32} instructions", name, instructions);
}

/// SysTick's counts while `tick` runs again and again. It counts down.
fn counts(mut tick: impl FnMut()) -> u32 {
    let start = SYST::get_current();
    for _ in 0..REPETITIONS {
        tick();
    }
    start.wrapping_sub(SYST::get_current()) & SYSTICK_TOP
}
