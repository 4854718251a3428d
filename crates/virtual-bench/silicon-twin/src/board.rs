//! The driver board around the chip (`docs/board.md`): output filters and stages, current senses, supply, and the mirror.

use emulated_board::{
    Connected, Controls, Electronics, Load, PlantFault, Rail, Upset, is_over_voltage,
};
use virtual_mirror::ConfigError;

use crate::chip::Clock;
use crate::chip::Output;

/// The pins that drive the four channels.
pub(crate) const DRIVE_PINS: [&str; 4] = ["PC0", "PC1", "PC2", "PC3"];
/// The pin that the comparators pull low, and the one that enables the stages' load switch.
pub(crate) const COMPARATORS_PIN: &str = "PB12";
pub(crate) const LOAD_SWITCH_PIN: &str = "PC12";

/// Each of the two poles of an output filter: 2 kHz.
const FILTER_S: f64 = 1.0 / (std::f64::consts::TAU * 2e3);
/// Supply of the output stages (V).
const SUPPLY_V: f64 = 5.0;
/// From one step of the mirror to the next: short beside its heat's and its plate's times (s).
const STEP_S: f64 = 1e-4;
/// The resistance of a heater is what a volt drives through it (V).
const PROBE_V: f64 = 1.0;

/// What an analogue input of the chip is connected to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Connection {
    /// The current sense of a channel.
    Sense(usize),
    /// The supply of the output stages.
    Supply,
    /// The position sensor.
    Sensor,
}

impl Connection {
    fn index(self) -> usize {
        match self {
            Self::Sense(channel) => channel,
            Self::Supply => 4,
            Self::Sensor => 5,
        }
    }
}

/// What is connected to a pin, if it is an analogue signal.
pub(crate) fn connection(pin: &str) -> Option<Connection> {
    Some(match pin {
        "PA0" => Connection::Sense(0),
        "PA1" => Connection::Sense(1),
        "PB0" => Connection::Sense(2),
        "PB1" => Connection::Sense(3),
        "PC5" => Connection::Supply,
        "PB2" => Connection::Sensor,
        _ => return None,
    })
}

/// A filter of two equal poles; its state is the voltage behind each, as a part of the logic's supply.
#[derive(Clone, Copy, Debug, Default)]
struct Filter([f64; 2]);

impl Filter {
    /// Holds `input` for as long as it takes to decay to `decay`, `times` time constants: the exact solution.
    fn hold(&mut self, input: f64, decay: f64, times: f64) {
        let [first, second] = self.0.map(|state| state - input);
        self.0 = [
            input + first * decay,
            input + (second + first * times) * decay,
        ];
    }
}

/// What the chip's pins do to the board.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Driven {
    pub(crate) outputs: [Output; 4],
    pub(crate) is_load_switch_on: bool,
}

/// The board.
#[derive(Clone, Debug)]
pub struct Board {
    electronics: Electronics,
    load: Load,
    filters: [Filter; 4],
    rail: Rail,
    resistance_ohm: [f64; 4],
    /// What the position sensor reads (um), if it does.
    sensor_um: Option<f64>,
    /// The cycle up to which the filters have come.
    at: u64,
    /// Integral of the square of each stage's voltage since the mirror's last step (V^2 s), and how long that is.
    heat: [f64; 4],
    heated_s: f64,
    /// Integral of what each stage gives in that time (V s).
    given: [f64; 4],
    steps: u64,
    controls: Controls,
    /// Whether something else than the comparators pulls their line low.
    line_is_pulled: bool,
    /// What is broken, and for how many steps it has been.
    fault: Option<(PlantFault, u32)>,
    /// What each input read last.
    codes: [u16; 6],
}

/// What a step of the bench does to the processor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Disturbance {
    pub(crate) upset: Option<Upset>,
    /// Control ticks that it is to miss.
    pub(crate) missed_ticks: u16,
}

impl Board {
    /// A board with something connected, whose tolerances are drawn from the mirror's seed too.
    ///
    /// # Errors
    /// Where a number of a mirror is out of range.
    pub fn new(connected: &Connected) -> Result<Self, ConfigError> {
        let mut board = Self {
            electronics: Electronics::new(connected.seed()),
            load: Load::new(connected)?,
            filters: [Filter::default(); 4],
            rail: Rail::default(),
            resistance_ohm: [0.0; 4],
            sensor_um: None,
            at: 0,
            heat: [0.0; 4],
            heated_s: 0.0,
            given: [0.0; 4],
            steps: 0,
            controls: Controls::default(),
            line_is_pulled: false,
            fault: None,
            codes: [0; 6],
        };
        board.look_at_the_load();
        Ok(board)
    }

    /// What a person does at the bench; a clone of the board is on the same bench.
    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    /// From now on it is on this bench.
    pub fn move_to(&mut self, bench: Controls) {
        self.controls = bench;
    }

    /// Voltage that each stage is told.
    pub fn drive_v(&self) -> [f64; 4] {
        self.filters
            .map(|filter| self.electronics.stage_v(filter.0[1]))
    }

    /// Voltage at each actuator.
    pub fn heated_v(&self) -> [f64; 4] {
        // A pin that is stuck is so before the filter.
        self.rail
            .limit(self.broken(self.drive_v(), |fault, drive_v| {
                fault.at_the_heaters(drive_v, false)
            }))
    }

    /// Whether the line is low that the outputs are disabled by, which the comparators pull.
    pub(crate) fn is_over_voltage(&self) -> bool {
        self.line_is_pulled || is_over_voltage(self.heated_v())
    }

    pub(crate) fn pull_comparators_line(&mut self, is_pulled: bool) {
        self.line_is_pulled = is_pulled;
    }

    /// What is in front of the load switch (V).
    fn supply_v(&self) -> f64 {
        self.broken(SUPPLY_V, |fault, supply_v| {
            let age = self.fault.map_or(0, |(_, age)| age);
            fault.supply_v(supply_v, age)
        })
    }

    /// What a fault makes of what is sound.
    fn broken<T>(&self, sound: T, change: impl FnOnce(PlantFault, T) -> T) -> T {
        match self.fault {
            Some((fault, _)) => change(fault, sound),
            None => sound,
        }
    }

    /// What the position sensor reads (um).
    pub fn z_um(&mut self) -> f64 {
        self.load
            .read(self.heated_v(), &self.controls.surroundings())
            .1
    }

    /// When the mirror is to be stepped next, in seconds since power came.
    pub(crate) fn next_step_s(&self) -> f64 {
        (self.steps + 1) as f64 * STEP_S
    }

    /// Steps the mirror: what heats is the mean of the voltage's square.
    pub(crate) fn step(&mut self) -> Disturbance {
        self.steps += 1;
        let heated_s = self.heated_s.max(f64::MIN_POSITIVE);
        let effective_v = self.heat.map(|heat| (heat / heated_s).sqrt());
        let state = self.load.advance(effective_v, 1);
        // Its mean: the PWM leaves a ripple.
        self.controls
            .observe(self.given.map(|given| given / heated_s), &state);
        (self.heat, self.given, self.heated_s) = ([0.0; 4], [0.0; 4], 0.0);
        let (fault, age) = self.controls.fault_of_this_tick();
        self.fault = fault.map(|fault| (fault, age));
        if self.fault == Some((PlantFault::Vacuum, 0)) {
            self.load.leave_the_air();
        }
        self.look_at_the_load();
        fault.map_or_else(Disturbance::default, |fault| Disturbance {
            upset: fault.upset(age),
            missed_ticks: fault.missed_ticks(age),
        })
    }

    fn look_at_the_load(&mut self) {
        let around = self.controls.surroundings();
        let (current_a, z_um) = self.load.read([PROBE_V; 4], &around);
        self.sensor_um = match self.fault {
            Some((fault, age)) => fault.sensor_um(z_um, age),
            None => Some(z_um),
        };
        self.resistance_ohm = current_a.map(|current| PROBE_V / current);
    }

    /// Brings filters and supply to the cycle `to`, with these pins.
    pub(crate) fn advance(&mut self, to: u64, clock: &Clock, driven: &Driven) {
        while self.at < to {
            let edges = driven.outputs.iter().filter_map(|output| match output {
                Output::Until(_, edge) if *edge > self.at => Some(*edge),
                _ => None,
            });
            let end = edges.min().map_or(to, |edge| edge.min(to));
            self.hold(end, clock, driven);
        }
    }

    /// Holds the levels of now until `end`.
    fn hold(&mut self, end: u64, clock: &Clock, driven: &Driven) {
        let seconds = (end - self.at) as f64 / clock.hz();
        let times = seconds / FILTER_S;
        let decay = (-times).exp();
        let before_v = self.heated_v();
        let stuck = match self.fault {
            Some((PlantFault::StuckOutput(channel), _)) => Some(channel),
            _ => None,
        };
        for (channel, (filter, output)) in self.filters.iter_mut().zip(&driven.outputs).enumerate()
        {
            let is_high = match output {
                // The board's pull-downs.
                Output::Floating => false,
                Output::Level(level) => *level,
                Output::Until(..) if stuck == Some(channel) => true,
                Output::Until(first, edge) => *first == (self.at < *edge),
            };
            filter.hold(f64::from(u8::from(is_high)), decay, times);
        }
        let supply_v = self.supply_v();
        self.rail
            .advance(driven.is_load_switch_on, supply_v, seconds);
        let after_v = self.heated_v();
        for ((heat, before_v), after_v) in self.heat.iter_mut().zip(before_v).zip(after_v) {
            *heat += 0.5 * (before_v * before_v + after_v * after_v) * seconds;
        }
        let stage_v = self.rail.limit(self.drive_v());
        for (i, given) in self.given.iter_mut().enumerate() {
            *given += stage_v[i].max(after_v[i]) * seconds;
        }
        self.heated_s += seconds;
        self.at = end;
    }

    /// One conversion of what is there now: a code of 12 bits.
    pub(crate) fn convert(&mut self, connection: Connection) -> u16 {
        let input = connection.index();
        if self.is_frozen(connection) {
            return self.codes[input];
        }
        let pin_v = match connection {
            Connection::Sense(channel) => {
                let drive_v = self.rail.limit(self.drive_v());
                let heated_v = self.heated_v();
                let sound_a = std::array::from_fn(|i| heated_v[i] / self.resistance_ohm[i]);
                let current_a =
                    self.broken(sound_a, |fault, sound_a| fault.currents(drive_v, sound_a));
                self.electronics.sense_v(channel, current_a[channel])
            }
            Connection::Supply => {
                let supply_v = self.supply_v();
                self.electronics.supply_v(supply_v)
            }
            Connection::Sensor => self.electronics.sensor_v(self.sensor_um),
        };
        self.codes[input] = self.electronics.convert_once(pin_v);
        self.codes[input]
    }

    /// Whether an input repeats what it read last.
    fn is_frozen(&self, connection: Connection) -> bool {
        match self.fault {
            Some((PlantFault::StoppedConverters, _)) => true,
            Some((PlantFault::FrozenSense(channel), _)) => connection == Connection::Sense(channel),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Board {
        Board::new(&Connected::Resistors([499.0; 4])).expect("resistors")
    }

    fn driven(output: Output, is_load_switch_on: bool) -> Driven {
        Driven {
            outputs: [output; 4],
            is_load_switch_on,
        }
    }

    #[test]
    fn a_stage_gives_what_its_supply_lets_it_and_the_comparators_see_that() {
        let mut board = board();
        // A count is 1 us.
        let clock = Clock::new(1e6);
        let full = Output::Level(true);
        board.advance(5_000, &clock, &driven(full, false));
        assert_eq!(board.heated_v(), [0.0; 4], "no supply");
        assert!(!board.is_over_voltage());
        board.advance(7_000, &clock, &driven(full, true));
        // 3.3 V times 1.2879 are 4.25007 V.
        assert!(
            (board.heated_v()[1] - 4.25).abs() < 1e-4,
            "{:?}",
            board.heated_v()
        );
        assert!(board.is_over_voltage());
        // The discharge: four times 0.25 ms leave 2 % of 5 V.
        board.advance(8_000, &clock, &driven(full, false));
        assert!(board.heated_v()[1] < 0.1, "{:?}", board.heated_v());
    }

    #[test]
    fn a_filter_settles_at_the_duty_with_little_ripple() {
        let mut board = board();
        let clock = Clock::new(170e6);
        let period = 4250;
        for i in 0..80 {
            let edge = i * period + period / 2;
            board.advance(
                (i + 1) * period,
                &clock,
                &driven(Output::Until(true, edge), true),
            );
        }
        // Half of 4.25 V, and half of the 6.7 mV of ripple that docs/board.md has at half duty, doubled for both edges.
        let error_v = board.drive_v()[0] - 2.125;
        assert!(error_v.abs() < 0.0134, "{error_v}");
    }

    #[test]
    fn two_poles_answer_a_step_as_their_equation_says() {
        let mut board = board();
        let clock = Clock::new(1e9);
        let cycles = (FILTER_S * 1e9) as u64;
        board.advance(cycles, &clock, &driven(Output::Level(true), true));
        // 1 - (1 + t/T) exp(-t/T) after one time constant, of 4.25 V.
        let expected_v = 4.25 * (1.0 - 2.0 / std::f64::consts::E);
        assert!(
            (board.drive_v()[2] - expected_v).abs() < 1e-4,
            "{:?}",
            board.drive_v()
        );
    }
}
