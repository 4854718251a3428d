//! Instructions of one four-channel control tick.
//!
//! Under `-icount shift=6` QEMU lets 64 ns pass with every instruction, and SysTick counts 25 MHz:
//! 1.6 counts an instruction, the same in every run. (On a real M4F, cycles are another matter.)
#![no_std]
#![no_main]

use core::hint::black_box;

use control_core::calibration::{
    Heat, Lag, Memory, Parts, Path, Plate, Play, Resonance, SENSED_RISES, SensedRises,
};
use control_core::{
    ActuatorCalibration, AdcCode, Ampere, CHANNELS, Calibration, Controller, CurrentSense, Hertz,
    Kelvin, Micrometre, Pose, PwmCode, Radian, Second, SecondPerKelvin, SenseCalibration, Setpoint,
    SupplyCode, TICK, Volt,
};
use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use mirror_firmware::board::Sensed;
use mirror_firmware::control::Control;
use mirror_firmware::factory;
use mirror_firmware::mailbox::{self, Order};
use mirror_firmware::retained::Keep;
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

    let mut other = everything_on(factory::calibration());
    let mut calibration = everything_on(factory::calibration());
    let actuator = calibration.actuators()[0];
    let ohm = resistance(&actuator, actuator.shape.temperature_rise(HELD));
    let mut controller = Controller::new(&mut calibration);
    let (applied, currents) = (
        black_box([Volt(2.742); CHANNELS]),
        black_box([Ampere(2.742 / ohm); CHANNELS]),
    );
    // From one end to the other for ever, so that it is always on its way.
    let mut way = (0_u32..).map(|tick| [20.0, 120.0][(tick / 64) as usize % 2]);
    report("control core: one step on the way, everything on", || {
        let z = Setpoint::position(Micrometre(way.next().unwrap_or_default()));
        black_box(controller.step(black_box(z), black_box(applied), black_box(currents)));
    });
    let z = Setpoint::position(HELD);
    report(
        "control core: one step at a position, everything on",
        || {
            black_box(controller.step(black_box(z), black_box(applied), black_box(currents)));
        },
    );
    // Two actuators are at rest, and the other two warped to where the plate is level still: the dearest of poses.
    let pose = Setpoint::Track(Pose {
        z: Micrometre(20.0),
        tilt_x: Radian(0.06),
        tilt_y: Radian(0.0),
    });
    report(
        "control core: one step along poses that need a warp, everything on",
        || {
            black_box(controller.step(black_box(pose), black_box(applied), black_box(currents)));
        },
    );
    let drive = Setpoint::Drive([Volt(2.742); CHANNELS]);
    report("control core: one step at given voltages", || {
        black_box(controller.step(black_box(drive), black_box(applied), black_box(currents)));
    });

    controller.begin_exchange(&mut other);
    let mut longest = 0;
    while controller.is_exchanging() {
        let stage = counts(1, || {
            black_box(controller.exchange_on());
        });
        longest = longest.max(stage);
    }
    tell("control core: the longest stage of an exchange", longest, 1);

    static CALIBRATION: StaticCell<Calibration> = StaticCell::new();
    let calibration = CALIBRATION.init(everything_on(factory::calibration()));
    let mut protection = Protection::new(calibration);
    let (link, control_side) = mailbox::take();
    static RETAINED: Keep = Keep::empty();
    let mut control = Control::new(
        Controller::new(calibration),
        &SenseCalibration::DESIGNED,
        control_side,
        &RETAINED,
    );
    link.post(Order::Drive(z, Lease::FOREVER));
    let mut heaters = Heaters::COLD;
    let mut sensed = heaters.sense([PwmCode(0); CHANNELS], &actuator);
    for _ in 0..TICKS_TO_SETTLE {
        sensed = heaters.sense(control.tick(sensed), &actuator);
    }
    report("whole tick: mailbox, protection, step, telemetry", || {
        black_box(control.tick(black_box(sensed)));
    });
    if link.latest().states != [ChannelState::Driving; CHANNELS] {
        defmt::error!(
            "what was counted is no drive: {}",
            defmt::Debug2Format(&link.latest().states)
        );
        ExitCode::FAILURE.exit_process()
    }

    let reading = Reading {
        codes: sensed.currents,
        currents: CurrentSense::new(&SenseCalibration::DESIGNED).currents(sensed.currents),
        supply: sensed.supply,
        missed_ticks: 0,
        is_over_voltage: false,
    };
    let _ = protection.command(Lease::FOREVER);
    report("protection alone", || {
        black_box(protection.tick(
            black_box(z),
            black_box([Volt(2.742); CHANNELS]),
            black_box(&reading),
        ));
    });

    ExitCode::SUCCESS.exit_process()
}

/// The position that is held.
const HELD: Micrometre = Micrometre(120.0);
/// Up to where resistances tell temperatures.
const TOP: Kelvin = Kelvin(120.0);

/// The factory's calibration with a mirror's dynamics: every stage has something to do.
fn everything_on(factory: Calibration) -> Calibration {
    let lag = |weight, time| Lag {
        weight,
        time: Second(time),
    };
    let play = |radius| Play {
        weight: 0.005,
        radius: Micrometre(radius),
    };
    let mut parts = Parts {
        heat: Heat {
            fast: [lag(0.5, 1e-3), lag(0.3, 35e-3), lag(0.1, 0.2)],
            slow: [lag(0.06, 4.0), lag(0.04, 20.0)],
            shared: [0.0, 0.9, 0.9, 0.9, 0.9],
            beam_lag: Second(5e-4),
            time_growth: SecondPerKelvin(2e-6),
        },
        memory: Memory {
            plays: [play(3.0), play(6.0), play(12.0), play(24.0)],
            release: Second(0.5),
            creep: [
                lag(4e-3, 0.5),
                lag(3e-3, 2.0),
                lag(2e-3, 8.0),
                lag(2e-3, 25.0),
            ],
        },
        plate: Plate::cross(Micrometre(480.0)),
        path: Path {
            move_time: Second(6e-3),
            resonance: Resonance {
                frequency: Hertz(700.0),
                quality: 30.0,
            },
        },
        ambient_ratio: 1.02,
        sensed_crosstalk: -0.03,
        ..*factory.parts()
    };
    for (actuator, slower_s) in parts.actuators.iter_mut().zip([5e-5, -5e-5, 1e-4, -1e-4]) {
        actuator.slower_by = Second(slower_s);
        actuator.sensed_rises = SensedRises {
            top: TOP,
            knots: core::array::from_fn(|knot| TOP.0 * knot as f32 / (SENSED_RISES - 1) as f32),
        };
    }
    match Calibration::new(parts) {
        Ok(calibration) => calibration,
        Err(_) => ExitCode::FAILURE.exit_process(),
    }
}

/// Parts of the way to what its power holds that a heater comes in a tick, by halves: with the first two time constants of the calibration.
const QUICK: f32 = TICK.0 / 1e-3;
const SLOW: f32 = TICK.0 / 35e-3;

/// The halves of a heater's rise (K).
#[derive(Clone, Copy)]
struct Heater {
    quick: f32,
    slow: f32,
}

/// Heaters on their way to where their power holds them.
struct Heaters {
    heaters: [Heater; CHANNELS],
    noise: u16,
}

impl Heaters {
    const COLD: Self = Self {
        heaters: [Heater {
            quick: 0.0,
            slow: 0.0,
        }; CHANNELS],
        noise: 0,
    };

    /// What they make of these codes.
    fn sense(&mut self, codes: [PwmCode; CHANNELS], actuator: &ActuatorCalibration) -> Sensed {
        let mut currents = [AdcCode(0); CHANNELS];
        // A reading that never changes is a sense that is frozen.
        self.noise = 1 - self.noise;
        for ((current, heater), code) in currents.iter_mut().zip(&mut self.heaters).zip(codes) {
            let drive = code.drive();
            let rise = 0.5 * (heater.quick + heater.slow);
            let ohm = resistance(actuator, Kelvin(rise));
            *current = AdcCode(AdcCode::nearest(Ampere(drive.0 / ohm)).0 + self.noise);
            let heating = actuator.thermal_resistance.0 * drive.0 * drive.0 / ohm;
            let held = heating / (1.0 + actuator.loss_growth.0 * rise);
            heater.quick += QUICK * (held - heater.quick);
            heater.slow += SLOW * (held - heater.slow);
        }
        Sensed {
            currents,
            supply: SupplyCode::from_millivolt(5000),
            ..Sensed::default()
        }
    }
}

/// Of a heater that is so much warmer than the surroundings (ohm).
fn resistance(actuator: &ActuatorCalibration, rise: Kelvin) -> f32 {
    actuator.cold_resistance.0 * (1.0 + actuator.tcr.0 * rise.0)
}

fn report(name: &str, mut tick: impl FnMut()) {
    tick();
    let empty = counts(REPETITIONS, || {
        black_box(());
    });
    let counted = counts(REPETITIONS, &mut tick) - empty;
    tell(name, counted, REPETITIONS);
}

fn tell(name: &str, counted: u32, repetitions: u32) {
    let instructions = counted * 5 / COUNTS_PER_5_INSTRUCTIONS / repetitions;
    defmt::println!("{=str}: {=u32} instructions", name, instructions);
}

/// SysTick's counts while `tick` runs again and again. It counts down.
fn counts(repetitions: u32, mut tick: impl FnMut()) -> u32 {
    let start = SYST::get_current();
    for _ in 0..repetitions {
        tick();
    }
    start.wrapping_sub(SYST::get_current()) & SYSTICK_TOP
}
