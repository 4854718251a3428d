//! The driver PCB, and the Nucleo-G474RE.
#![no_std]
#![no_main]

use embassy_executor::{Spawner, task};
use embassy_stm32::wdg::IndependentWatchdog;
use mirror_firmware::board::BoardFlash;
use mirror_firmware::board::stm32g474::link::{self, Device};
use mirror_firmware::board::stm32g474::{
    ConverterPins, Converters, bootloader, clocks, lower_time_driver, origin, raise_core_voltage,
    start_control,
};
use mirror_firmware::startup::{Memory, start};
use mirror_firmware::watchdog::guard;
use mirror_firmware::{mailbox, rpc};

/// A part of the firmware that has stopped is noticed by then. Putting a calibration into flash takes
/// some 25 ms a page.
const WATCHDOG_US: u32 = 500_000;

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    bootloader::enter_if_requested();
    raise_core_voltage();
    let p = embassy_stm32::init(clocks());
    lower_time_driver();
    let pins = ConverterPins {
        pwm1: p.PC0,
        pwm2: p.PC1,
        pwm3: p.PC2,
        pwm4: p.PC3,
        sense1: p.PA0,
        sense2: p.PA1,
        sense3: p.PB0,
        sense4: p.PB1,
        supply: p.PC5,
        sensor: p.PB2,
        over_voltage: p.PB12,
        load_switch: p.PC12,
        line: p.PB5,
        frame: p.PB7,
    };
    let converters = Converters::new(p.TIM1, (p.ADC1, p.ADC2), pins);
    let memory = Memory::of_the_image();
    let flash = BoardFlash::open(p.FLASH);
    let mailbox = mailbox::take();
    let (device, rx, tx) = link::open(p.USB, p.PA12, p.PA11, mailbox.0);
    let (session, control) = start::<Converters>(flash, memory, origin(), mailbox);
    let mut watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
    watchdog.unleash();

    start_control(converters, control);
    spawner.must_spawn(run_usb(device));
    let serve = rpc::serve(tx, rx, rpc::FRAME.take(), session);
    embassy_futures::join::join(serve, guard(|| watchdog.pet())).await;
}

#[task]
async fn run_usb(device: Device) {
    device.run().await;
}
