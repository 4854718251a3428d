//! The four PWM channels of TIM1, what turns them off, and the conversions that its update triggers: four current-sense
//! channels on ADC1, the supply and a position sensor on ADC2.
//!
//! The PWM runs at 40 kHz; every fourth period ends in an update, which takes over new compare
//! values and starts the conversions: 10 kHz control ticks, in step with the PWM. The conversions' end
//! leaves the codes and asks for a second interrupt, below it and above USB's, which is the control loop: a
//! tick that takes too long is noticed by the first.

#![expect(unsafe_code, reason = "interrupts are enabled and entered")]

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use control_core::design::{PWM_PERIOD_COUNTS, PWM_PERIODS_PER_TICK};
use control_core::{AdcCode, CHANNELS, PwmCode, SensorCode, SupplyCode};
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, Exten, InjectedAdc, SampleTime};
use embassy_stm32::gpio::{AfType, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::timer::vals::{Mms2, Ossi};
use embassy_stm32::peripherals::{
    ADC1, ADC2, PA0, PA1, PB0, PB1, PB2, PB5, PB7, PB12, PC0, PC1, PC2, PC3, PC5, PC12, TIM1,
};
use embassy_stm32::timer::low_level::{
    BreakInputPolarity, CountingMode, FilterValue, OutputCompareMode, Timer,
};
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::timer::{BkIn1, BreakInputPin, Ch1, Ch2, Ch3, Ch4, Channel};
use embassy_stm32::{Peri, pac, triggers};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use static_cell::StaticCell;

use crate::board::{Board, Sensed};
use crate::control::Control;
use mirror_protocol::{OptionBytes, Trigger};
use protection::Punctuality;

/// 16-fold oversampling without shift, so that 12 bits become 16 (RM0440, ADC_CFGR2).
const OVERSAMPLING_RATIO_16: u8 = 0b011;

/// How long an input is sampled: 0.29 us. The amplifiers and the supply's divider, with its capacitor, are settled by then
/// (docs/board.md), and what the control loop does with four inputs, 16 times each, has the rest of the tick.
const SAMPLE_TIME: SampleTime = SampleTime::CYCLES12_5;

const OUTPUTS: [Channel; CHANNELS] = [Channel::Ch1, Channel::Ch2, Channel::Ch3, Channel::Ch4];

type Shared<T> = Mutex<CriticalSectionRawMutex, Cell<Option<T>>>;

/// The conversions of the tick that just ended.
static CONVERTED: Shared<Sensed> = Mutex::new(Cell::new(None));

/// Which ticks the processor was kept from.
static PUNCTUALITY: Mutex<CriticalSectionRawMutex, Cell<Punctuality>> =
    Mutex::new(Cell::new(Punctuality::new()));

/// The control loop, for the interrupt that it runs in.
static LOOP: Shared<&'static mut Loop> = Mutex::new(Cell::new(None));

struct Loop {
    converters: Converters,
    control: Control,
}

/// The pins of the four channels. The drives and the load switch lie on pins that the bootloader in the ROM leaves alone
/// (AN2606, STM32G47xxx/48xxx: it uses PA2 to PA7, PA8 to PA12, PB12 to PB15, PC4, PC6 to PC11), so that
/// the pull-downs hold the outputs and the stages' supply off during an update, too.
#[expect(missing_docs, reason = "named by channel")]
pub struct ConverterPins {
    pub pwm1: Peri<'static, PC0>,
    pub pwm2: Peri<'static, PC1>,
    pub pwm3: Peri<'static, PC2>,
    pub pwm4: Peri<'static, PC3>,
    pub sense1: Peri<'static, PA0>,
    pub sense2: Peri<'static, PA1>,
    pub sense3: Peri<'static, PB0>,
    pub sense4: Peri<'static, PB1>,
    pub supply: Peri<'static, PC5>,
    pub sensor: Peri<'static, PB2>,
    /// Low where a comparator finds too much at an output.
    pub over_voltage: Peri<'static, PB12>,
    /// High: the stages have their supply.
    pub load_switch: Peri<'static, PC12>,
    /// High in the tick in which a waveform's line begins.
    pub line: Peri<'static, PB5>,
    /// High in the tick in which a waveform's frame begins.
    pub frame: Peri<'static, PB7>,
}

/// PWM and current sense.
pub struct Converters {
    timer: Timer<'static, TIM1>,
    load_switch: Output<'static>,
    are_disabled: bool,
    _over_voltage: Flex<'static>,
    _triggers: [Output<'static>; 2],
    _outputs: Outputs,
    _currents: InjectedAdc<'static, ADC1, CHANNELS>,
    _supply_and_sensor: InjectedAdc<'static, ADC2, 2>,
}

type Pwm<C> = PwmPin<'static, TIM1, C>;
type Outputs = (Pwm<Ch1>, Pwm<Ch2>, Pwm<Ch3>, Pwm<Ch4>);

impl Converters {
    /// Sets up PWM and conversions with all channels off. Neither runs before [`start_control`].
    pub fn new(
        timer: Peri<'static, TIM1>,
        (adc1, adc2): (Peri<'static, ADC1>, Peri<'static, ADC2>),
        pins: ConverterPins,
    ) -> Self {
        let outputs = (
            PwmPin::new(pins.pwm1, OutputType::PushPull),
            PwmPin::new(pins.pwm2, OutputType::PushPull),
            PwmPin::new(pins.pwm3, OutputType::PushPull),
            PwmPin::new(pins.pwm4, OutputType::PushPull),
        );
        let sense = [
            (pins.sense1.degrade_adc(), SAMPLE_TIME),
            (pins.sense2.degrade_adc(), SAMPLE_TIME),
            (pins.sense3.degrade_adc(), SAMPLE_TIME),
            (pins.sense4.degrade_adc(), SAMPLE_TIME),
        ];
        let supply_and_sensor = [
            (pins.supply.degrade_adc(), SAMPLE_TIME),
            (pins.sensor.degrade_adc(), SAMPLE_TIME),
        ];
        let adc1 = Adc::new(adc1, AdcConfig::default());
        let adc2 = Adc::new(adc2, AdcConfig::default());
        for adc in [pac::ADC1, pac::ADC2] {
            adc.cfgr2().modify(|w| {
                w.set_ovsr(OVERSAMPLING_RATIO_16);
                w.set_jovse(true);
            });
        }
        let edge = Exten::RISING_EDGE;
        // These two conversions end before the four that tell of their end.
        let supply_and_sensor =
            adc2.setup_injected_conversions(supply_and_sensor, triggers::TIM1_TRGO2, edge, false);
        let currents = adc1.setup_injected_conversions(sense, triggers::TIM1_TRGO2, edge, true);
        Self {
            _over_voltage: break_input(pins.over_voltage),
            _triggers: [
                Output::new(pins.line, Level::Low, Speed::Low),
                Output::new(pins.frame, Level::Low, Speed::Low),
            ],
            timer: configure_pwm(timer),
            load_switch: Output::new(pins.load_switch, Level::Low, Speed::Low),
            are_disabled: true,
            _outputs: outputs,
            _currents: currents,
            _supply_and_sensor: supply_and_sensor,
        }
    }
}

/// Gives TIM1 the comparators' line, which they pull low.
fn break_input(pin: Peri<'static, impl BreakInputPin<TIM1, BkIn1>>) -> Flex<'static> {
    let function = pin.af_num();
    let mut pin = Flex::new(pin);
    pin.set_as_af_unchecked(function, AfType::input(Pull::Up));
    pin
}

fn configure_pwm(timer: Peri<'static, TIM1>) -> Timer<'static, TIM1> {
    let timer = Timer::new(timer);
    timer.set_counting_mode(CountingMode::EdgeAlignedUp);
    timer.set_max_compare_value(PWM_PERIOD_COUNTS - 1);
    timer.set_autoreload_preload(true);
    // It counts what comes after the first.
    timer.set_repetition_counter(PWM_PERIODS_PER_TICK - 1);
    timer.set_mms2_selection(Mms2::UPDATE);
    for channel in OUTPUTS {
        timer.set_output_compare_mode(channel, OutputCompareMode::PwmMode1);
        timer.set_output_compare_preload(channel, true);
        timer.set_compare_value(channel, 0);
        timer.enable_channel(channel, true);
    }
    // When the outputs are disabled they are held low instead of floating.
    timer.set_ossi(Ossi::IDLE_LEVEL);
    // The comparators disable them, and software alone enables them again. What is shorter than 8 samples of 170 MHz / 32,
    // 1.5 us, is a glitch (RM0440, TIMx_BDTR).
    timer.set_break_polarity(BreakInputPolarity::ACTIVE_LOW);
    timer.set_break_filter(FilterValue::FDTS_DIV32_N8);
    timer.set_break_enable(true);
    // A debugger that halts the processor stops the timer, and that disables the outputs, too (RM0440, debug mode of
    // the advanced-control timers).
    // The watchdog stops with it, or every breakpoint would end in a reset.
    pac::DBGMCU.apb2fzr().modify(|w| w.set_tim1(true));
    pac::DBGMCU.apb1lfzr().modify(|w| w.set_iwdg(true));
    timer.generate_update_event();
    timer
}

/// What the next tick writes to GPIOB's set and reset register (RM0440, GPIOx_BSRR), for the trigger pins.
static TRIGGER_PINS: AtomicU32 = AtomicU32::new(0);

/// Sets the trigger pins of what begins with the next tick, and resets the others.
fn tell_next_tick(trigger: Trigger) {
    const LINE: u32 = 1 << 5;
    const FRAME: u32 = 1 << 7;
    // Of a pin that is both set and reset, setting counts.
    let pin = |begins: Trigger, pin: u32| if trigger.has(begins) { pin } else { 0 };
    let set = pin(Trigger::LINE, LINE) | pin(Trigger::FRAME, FRAME);
    TRIGGER_PINS.store((LINE | FRAME) << 16 | set, Ordering::Relaxed);
}

/// Turns the outputs off in the registers themselves, whoever has them: first what acts on all four at once (RM0440,
/// TIMx_BDTR: MOE), then the stages' supply (`ConverterPins::load_switch`).
pub(super) fn turn_outputs_off() {
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    pac::GPIOC.bsrr().write(|w| w.set_br(12, true));
}

impl Board for Converters {
    const NAME: &'static str = "STM32G474RE driver board";
    const IS_EMULATED: bool = false;
    const BOOTLOADER: Option<fn() -> !> = Some(|| super::bootloader::enter(turn_outputs_off));

    fn option_bytes() -> Option<OptionBytes> {
        let options = pac::FLASH.optr().read();
        Some(OptionBytes {
            brown_out_level: options.bor_lev(),
            boots_by_pin: options.n_swboot0(),
            is_dual_bank: options.dbank(),
        })
    }

    fn drive(&mut self, codes: [PwmCode; CHANNELS], trigger: Trigger) -> bool {
        for (channel, code) in OUTPUTS.into_iter().zip(codes) {
            self.timer.set_compare_value(channel, code.0);
        }
        // The next update takes the new values over, all or, in the midst of them, some.
        let is_in_time = !has_next_tick_begun();
        tell_next_tick(trigger);
        // Only after `disable`: what the comparators disabled is not undone here.
        if core::mem::take(&mut self.are_disabled) {
            self.load_switch.set_high();
            pac::TIM1.sr().write(|w| {
                w.0 = !0;
                w.set_bif(0, false);
            });
            self.timer.enable_outputs();
        }
        is_in_time
    }

    fn disable(&mut self) {
        turn_outputs_off();
        self.are_disabled = true;
        tell_next_tick(Trigger::NONE);
        for channel in OUTPUTS {
            self.timer.set_compare_value(channel, 0);
        }
    }
}

#[embassy_stm32::interrupt]
fn ADC1_2() {
    // First, so that the pins move at the same time in every tick.
    pac::GPIOB
        .bsrr()
        .write(|w| w.0 = TRIGGER_PINS.load(Ordering::Relaxed));
    let currents = core::array::from_fn(|rank| AdcCode(pac::ADC1.jdr(rank).read().jdata()));
    let supply = SupplyCode(pac::ADC2.jdr(0).read().jdata());
    let sensor = SensorCode(pac::ADC2.jdr(1).read().jdata());
    let is_over_voltage = pac::TIM1.sr().read().bif(0);
    // The update that began this tick; writing a flag as 0 clears it, and as 1 leaves it (RM0440, TIMx_SR).
    pac::TIM1.sr().write(|w| {
        w.0 = !0;
        w.set_uif(false);
    });
    // Writing the flag clears it; the other flags keep what is written as 0.
    pac::ADC1.isr().write(|w| w.set_jeos(true));
    let kept_from = ticks_missed();
    // What the control loop did not take in time is a tick that it missed.
    CONVERTED.lock(|slot| {
        let not_taken = slot
            .take()
            .map_or(0, |missed| missed.missed_ticks.saturating_add(1));
        let missed_ticks = not_taken.saturating_add(kept_from);
        slot.set(Some(Sensed {
            currents,
            supply,
            missed_ticks,
            is_over_voltage,
            sensor_z: sensor.position(),
        }));
    });
    interrupt::UART5.pend();
}

/// Whether the tick after the control loop's has begun: its update is flagged, or its conversions have ended, whose interrupt
/// clears the flag.
fn has_next_tick_begun() -> bool {
    pac::TIM1.sr().read().uif() || CONVERTED.lock(|slot| slot.get().is_some())
}

/// Ticks before this one whose conversions nobody looked at: while the processor is kept from its interrupts, several ends of
/// conversions become one. TIM15 counts microseconds for embassy's time, by the oscillator that TIM1 counts by.
fn ticks_missed() -> u16 {
    let now_us = pac::TIM15.cnt().read().cnt();
    PUNCTUALITY.lock(|cell| {
        let mut punctuality = cell.get();
        let missed = punctuality.missed_before(now_us);
        cell.set(punctuality);
        missed
    })
}

/// Starts the control loop, once, in an interrupt that no peripheral of this board uses, and then the timer that
/// makes its ticks: whatever was loaded before took its time, and no tick is missed by it.
pub fn start_control(converters: Converters, control: Control) {
    static STORAGE: StaticCell<Loop> = StaticCell::new();
    interrupt::ADC1_2.set_priority(Priority::P0);
    interrupt::UART5.set_priority(Priority::P1);
    let started = STORAGE.init(Loop {
        converters,
        control,
    });
    started.converters.timer.start();
    LOOP.lock(|slot| slot.set(Some(started)));
    // SAFETY: the handlers read registers, and take what is shared from behind locks.
    unsafe {
        interrupt::UART5.enable();
        interrupt::ADC1_2.enable();
    }
}

#[embassy_stm32::interrupt]
fn UART5() {
    let (Some(sensed), Some(running)) = (CONVERTED.lock(Cell::take), LOOP.lock(Cell::take)) else {
        return;
    };
    running.control.tick_on(&mut running.converters, sensed);
    LOOP.lock(|slot| slot.set(Some(running)));
}
