//! What breaks, and when.

use std::fmt;

use emulated_board::PlantFault;
use hil::{DISTURBANCES, Disturbance};
use protection::Fault;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What the board is doing then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Situation {
    AtRest,
    Driving,
    Uploading,
}

const SITUATIONS: [Situation; 3] = [Situation::AtRest, Situation::Driving, Situation::Uploading];

/// What happens to it.
#[derive(Clone, Copy)]
pub(crate) enum Trouble {
    /// Something breaks.
    Breaks(PlantFault),
    /// The processor is reset so many control ticks later.
    ResetAfter(u32),
    /// A bit of the stored calibration falls over, and the processor is reset.
    StoredBit,
    /// The same, of the newer of two stored ones.
    StoredBitOfTwo,
    /// The link is disturbed, many times.
    Link(Disturbance),
    /// The mirror is in vacuum, and driven faster than its currents can be looked at one by one.
    FastDrive(Fast),
    /// The flash takes nothing more.
    WornFlash,
    /// A calibration is uploaded that would widen the board's limits: the number at this place, and its name.
    Calibration(usize, f32, &'static str),
}

/// Drives between 0 and 3.5 V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fast {
    /// So many ticks high, and one low.
    AllButOne(u16),
    /// A sine of so many hertz.
    Sine(u16),
}

pub(crate) struct Case {
    pub(crate) trouble: Trouble,
    pub(crate) situation: Situation,
    /// What the board may call it; nothing where it is to go on as if nothing had been.
    pub(crate) expected: &'static [Fault],
    /// Ticks of drive that it may take to come to zero.
    pub(crate) most_driven_ticks: u64,
    /// The hottest that it may make the mirror (K above ambient).
    pub(crate) hottest_k: f64,
}

/// The protection needs three ticks, and eight to tell that a sense is frozen.
pub(crate) const AT_ONCE: u64 = 10;
/// What the output filter of the driver board, two poles at 2 kHz, takes from 3.5 V to 0.3 V: x = t / T where
/// (1 + x) exp(-x) = 0.086 is 4.1, and T is 80 us.
pub(crate) const FILTER_TICKS: u64 = 4;
/// Half a second until its watchdog bites, by an oscillator that is good for 4 %.
const WATCHDOG_TICKS: u64 = 5200;
/// A frozen sense shows once the drive has moved by 20 mV, which the waveform takes up to 15 ms for at
/// its turning points.
const ONCE_IT_MOVES: u64 = AT_ONCE + 150;
/// What shows only near the top of the waveform, a cycle of 0.2 s.
const AT_ITS_TOP: u64 = AT_ONCE + 2000;
/// Heat takes its time to show; what it does to the mirror is the measure there.
const ONCE_IT_IS_HOT: u64 = u64::MAX;

/// Aluminium begins to yield and creep 225 K above a room's temperature, and nothing may heat it further.
const HOTTEST_K: f64 = 225.0;

/// Resets at instants that nobody chose, in each situation.
const RANDOM_RESETS: usize = 4;
const SEED: u64 = 20_261_121;

/// What a channel that does not follow its drive may be called.
const DOES_NOT_FOLLOW: &[Fault] = &[
    Fault::ImplausibleSense,
    Fault::OverCurrent,
    Fault::ShortCircuit,
    Fault::OutputOverVoltage,
];

/// All of them. A number of a calibration is counted from its first, the first actuator's cold resistance.
pub(crate) fn cases() -> Vec<Case> {
    let mut list = List(Vec::new());
    for channel in 0..4 {
        on_a_channel(&mut list, channel);
    }
    on_the_board(&mut list);
    in_the_processor(&mut list);
    from_the_host(&mut list);
    list.0
}

fn on_a_channel(list: &mut List, channel: usize) {
    use Fault as F;
    use PlantFault as P;
    list.breaks(P::OpenHeater(channel), &[F::OpenHeater], AT_ONCE);
    list.breaks(P::ShortCircuit(channel), &[F::ShortCircuit], AT_ONCE);
    list.breaks(P::Bridge(channel, 220), DOES_NOT_FOLLOW, AT_ONCE);
    list.breaks(P::Bridge(channel, 560), DOES_NOT_FOLLOW, AT_ITS_TOP);
    list.breaks(P::StuckOutput(channel), DOES_NOT_FOLLOW, AT_ONCE);
    list.breaks(P::StuckStage(channel, 5000), DOES_NOT_FOLLOW, AT_ONCE);
    list.breaks(P::StuckStage(channel, 4250), DOES_NOT_FOLLOW, AT_ONCE);
    // No more than a calibration may ask for.
    list.breaks(P::StuckStage(channel, 3500), DOES_NOT_FOLLOW, AT_ITS_TOP);
    let frozen = &[
        F::FrozenSense,
        F::OpenHeater,
        F::ImplausibleSense,
        F::OverTemperature,
    ];
    list.breaks(P::FrozenSense(channel), frozen, ONCE_IT_MOVES);
    list.breaks(P::StageGain(channel, 150), DOES_NOT_FOLLOW, AT_ITS_TOP);
    list.breaks(P::StageGain(channel, 0), &[F::OpenHeater], AT_ONCE);
    list.breaks(P::SenseGain(channel, 150), DOES_NOT_FOLLOW, AT_ITS_TOP);
    let reads_hot = &[F::OverTemperature, F::ImplausibleSense, F::OpenHeater];
    list.breaks(P::SenseGain(channel, 50), reads_hot, AT_ITS_TOP);
}

fn on_the_board(list: &mut List) {
    use Fault as F;
    use PlantFault as P;
    list.breaks(P::Vacuum, &[F::OverTemperature], ONCE_IT_IS_HOT);
    list.breaks(P::WeakSupply, &[F::SupplyOutOfRange], AT_ONCE);
    list.breaks(P::StrongSupply, &[F::SupplyOutOfRange], AT_ONCE);
    // Below 4.2 V after 8 ticks.
    list.breaks(P::BrownOut, &[F::SupplyOutOfRange], AT_ONCE + 8);
    let stopped = &[F::FrozenSense, F::OpenHeater, F::ImplausibleSense];
    list.breaks(P::StoppedConverters, stopped, ONCE_IT_MOVES);
    list.breaks(P::NoSensor, &[], u64::MAX);
    list.breaks(P::PatchySensor, &[], u64::MAX);
    list.breaks(P::ClippedSensor, &[], u64::MAX);
    list.breaks(P::LateSensor, &[], u64::MAX);
    list.breaks(P::MissedTicks, &[F::TickOverrun], AT_ONCE);
    list.breaks(P::SlowClock, &[F::TickOverrun], AT_ONCE);
    list.add(Case::of(Trouble::WornFlash, &[], u64::MAX));
}

fn in_the_processor(list: &mut List) {
    use Fault as F;
    use PlantFault as P;
    list.breaks(P::Panic, &[F::FirmwarePanic], AT_ONCE);
    list.breaks(P::HardFault, &[F::HardFault], AT_ONCE);
    list.breaks(P::Hang, &[F::WatchdogReset], AT_ONCE);
    list.breaks(P::Reset, &[], AT_ONCE);
    list.breaks(P::ResetLoop, &[], AT_ONCE);
    list.add(Case::of(Trouble::StoredBit, &[F::CalibrationBad], AT_ONCE));
    let outdated = &[F::CalibrationOutdated];
    list.add(Case::of(Trouble::StoredBitOfTwo, outdated, AT_ONCE));
    let mut instants = ChaCha8Rng::seed_from_u64(SEED);
    for _ in 0..RANDOM_RESETS {
        for situation in SITUATIONS {
            let trouble = Trouble::ResetAfter(instants.random_range(1..1500));
            list.0.push(Case {
                situation,
                ..Case::of(trouble, &[], AT_ONCE)
            });
        }
    }
}

fn from_the_host(list: &mut List) {
    for disturbance in DISTURBANCES {
        list.add(Case::of(Trouble::Link(disturbance), &[], 0));
    }
    for fast in [
        Fast::AllButOne(5),
        Fast::AllButOne(2),
        Fast::AllButOne(30),
        Fast::Sine(2500),
        Fast::Sine(900),
    ] {
        let too_hot = &[Fault::OverTemperature];
        list.add(Case::of(Trouble::FastDrive(fast), too_hot, ONCE_IT_IS_HOT));
    }
    for (place, number, name) in [
        (0, 720.0, "R0 720 ohm"),
        (1, 0.1, "TCR 0.1 /K"),
        (0, f32::NAN, "R0 NaN"),
    ] {
        list.add(Case::of(Trouble::Calibration(place, number, name), &[], 0));
    }
}

/// Cases so far.
struct List(Vec<Case>);

impl List {
    fn breaks(&mut self, fault: PlantFault, expected: &'static [Fault], most_driven_ticks: u64) {
        self.add(Case::of(
            Trouble::Breaks(fault),
            expected,
            most_driven_ticks,
        ));
    }

    /// In every situation.
    fn add(&mut self, case: Case) {
        self.0
            .extend(SITUATIONS.map(|situation| Case { situation, ..case }));
    }
}

impl Case {
    /// The same on the silicon twin: what is driven falls behind the output filter, and power that goes takes the memory of
    /// its fall with it.
    pub(crate) fn on_twin(mut self) -> Self {
        use PlantFault as P;
        let more_ticks = match self.trouble {
            Trouble::Breaks(P::Hang) => WATCHDOG_TICKS,
            // Two ticks of three do not take place.
            Trouble::Breaks(P::SlowClock) => 2 * AT_ONCE,
            Trouble::Breaks(P::BrownOut) => {
                self.expected = &[];
                0
            }
            _ => 0,
        };
        self.most_driven_ticks = self
            .most_driven_ticks
            .saturating_add(FILTER_TICKS + more_ticks);
        self
    }

    fn of(trouble: Trouble, expected: &'static [Fault], most_driven_ticks: u64) -> Self {
        Self {
            trouble,
            situation: Situation::AtRest,
            expected,
            most_driven_ticks,
            hottest_k: HOTTEST_K,
        }
    }
}

impl Trouble {
    /// Whether the processor is reset by it.
    pub(crate) fn restarts(self) -> bool {
        use PlantFault as P;
        match self {
            Self::Breaks(fault) => matches!(
                fault,
                P::Panic | P::HardFault | P::Hang | P::Reset | P::ResetLoop | P::BrownOut
            ),
            Self::ResetAfter(_) | Self::StoredBit | Self::StoredBitOfTwo => true,
            Self::Link(_) | Self::FastDrive(_) | Self::Calibration(..) | Self::WornFlash => false,
        }
    }

    /// How often the processor is reset by what restarts it, and within how many seconds.
    pub(crate) fn resets(self) -> (usize, f64) {
        match self {
            Self::Breaks(PlantFault::ResetLoop) => {
                (PlantFault::RESETS as usize, PlantFault::RESET_LOOP_S)
            }
            Self::ResetAfter(ticks) => (1, f64::from(ticks) * 1e-4),
            _ => (1, 0.0),
        }
    }

    /// Whether the board goes on as if nothing had been.
    pub(crate) fn is_borne(self) -> bool {
        matches!(
            self,
            Self::Link(_)
                | Self::Calibration(..)
                | Self::WornFlash
                | Self::Breaks(
                    PlantFault::NoSensor
                        | PlantFault::PatchySensor
                        | PlantFault::ClippedSensor
                        | PlantFault::LateSensor
                )
        )
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let situation = format!("{:?}", self.situation);
        write!(f, "{:<26} {situation:<10}", self.trouble)
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Breaks(fault) => f.pad(&format!("{fault:?}")),
            Self::ResetAfter(ticks) => f.pad(&format!("Reset after {ticks} ticks")),
            Self::StoredBit => f.pad("bit of stored data"),
            Self::StoredBitOfTwo => f.pad("bit of newer of two"),
            Self::Link(disturbance) => f.pad(disturbance.name),
            Self::FastDrive(fast) => f.pad(&format!("vacuum, {fast:?}")),
            Self::WornFlash => f.pad("WornFlash"),
            Self::Calibration(_, _, name) => f.pad(&format!("upload of {name}")),
        }
    }
}
