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
    /// The link is disturbed, many times.
    Link(Disturbance),
}

pub(crate) struct Case {
    pub(crate) trouble: Trouble,
    pub(crate) situation: Situation,
    /// What the board may call it; nothing where it is to go on as if nothing had been.
    pub(crate) expected: &'static [Fault],
    /// Ticks of drive that it may take to come to zero.
    pub(crate) most_driven_ticks: u64,
}

/// The protection needs three ticks, and eight to tell that a sense is frozen.
pub(crate) const AT_ONCE: u64 = 10;
/// A frozen sense shows once the drive has moved by 20 mV, which the waveform takes up to 15 ms for at
/// its turning points.
const ONCE_IT_MOVES: u64 = AT_ONCE + 150;
/// What shows only near the top of the waveform, a cycle of 0.2 s.
const AT_ITS_TOP: u64 = AT_ONCE + 2000;
/// Heat takes its time to show; what it does to the mirror is the measure there.
const ONCE_IT_IS_HOT: u64 = u64::MAX;

/// Resets at instants that nobody chose, in each situation.
const RANDOM_RESETS: usize = 4;
const SEED: u64 = 20_261_121;

pub(crate) fn cases() -> Vec<Case> {
    use Fault as F;
    use PlantFault as P;
    let broken: [(P, &[F], u64); 12] = [
        (P::OpenHeater(1), &[F::OpenHeater], AT_ONCE),
        (P::ShortCircuit(2), &[F::ShortCircuit], AT_ONCE),
        (
            P::Bridge(0, 220),
            &[F::ImplausibleSense, F::OverCurrent, F::ShortCircuit],
            AT_ONCE,
        ),
        (P::Bridge(3, 560), &[F::OverCurrent], AT_ITS_TOP),
        (P::Vacuum, &[F::OverTemperature], ONCE_IT_IS_HOT),
        (
            P::FrozenSense(3),
            &[
                F::FrozenSense,
                F::OpenHeater,
                F::ImplausibleSense,
                F::OverTemperature,
            ],
            ONCE_IT_MOVES,
        ),
        (P::WeakSupply, &[F::SupplyOutOfRange], AT_ONCE),
        (P::MissedTicks, &[F::TickOverrun], AT_ONCE),
        (P::Panic, &[F::FirmwarePanic], AT_ONCE),
        (P::HardFault, &[F::HardFault], AT_ONCE),
        (P::Hang, &[F::WatchdogReset], AT_ONCE),
        (P::Reset, &[], AT_ONCE),
    ];
    let mut cases = Vec::new();
    let mut in_every_situation =
        |trouble: &mut dyn FnMut() -> Trouble, expected, most_driven_ticks| {
            cases.extend(SITUATIONS.map(|situation| Case {
                trouble: trouble(),
                situation,
                expected,
                most_driven_ticks,
            }));
        };
    for (fault, expected, ticks) in broken {
        in_every_situation(&mut || Trouble::Breaks(fault), expected, ticks);
    }
    in_every_situation(&mut || Trouble::StoredBit, &[F::CalibrationBad], AT_ONCE);
    let mut instants = ChaCha8Rng::seed_from_u64(SEED);
    for _ in 0..RANDOM_RESETS {
        let mut reset = || Trouble::ResetAfter(instants.random_range(1..1500));
        in_every_situation(&mut reset, &[], AT_ONCE);
    }
    for disturbance in DISTURBANCES {
        in_every_situation(&mut || Trouble::Link(disturbance), &[], 0);
    }
    cases
}

impl Trouble {
    /// Whether the processor is reset by it.
    pub(crate) fn restarts(self) -> bool {
        use PlantFault as P;
        match self {
            Self::Breaks(fault) => matches!(fault, P::Panic | P::HardFault | P::Hang | P::Reset),
            Self::ResetAfter(_) | Self::StoredBit => true,
            Self::Link(_) => false,
        }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Breaks(fault) => f.pad(&format!("{fault:?}")),
            Self::ResetAfter(ticks) => f.pad(&format!("Reset after {ticks} ticks")),
            Self::StoredBit => f.pad("bit of stored data"),
            Self::Link(disturbance) => f.pad(disturbance.name),
        }
    }
}
