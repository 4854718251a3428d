//! Output stages that do not do what they are told, in front of the same independent mirror as in [`crate::hottest`].

use protection::Fault;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::bench::{Board, FACTORY};
use crate::plant::Surroundings;

/// Ticks that the board is told `told_v` while stages that work follow, and after that one that stays at `stuck_v`; the
/// fault, and the ticks from then on.
fn stuck(told_v: f64, stuck_v: f64, seed: u64) -> Option<(Fault, u32)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut board = Board::of_the_line(Surroundings::AIR, &mut rng);
    // Beyond the checks at start.
    for _ in 0..4000 {
        board.tick_without_clearing(told_v);
    }
    assert_eq!(board.protection.first_cause(), None, "sound at {told_v} V");
    board.stuck_v[1] = Some(stuck_v);
    (0..30_000).find_map(|tick| {
        board.tick_without_clearing(told_v);
        board.protection.first_cause().map(|fault| (fault, tick))
    })
}

#[test]
fn a_stage_that_is_stuck_is_noticed_in_air() {
    // Above 3.0 V a stage at 4.25 V is within what a mirror of the line may differ by.
    for (stuck_v, most_told_v) in [(4.25, 3.0), (5.0, FACTORY.drive_v)] {
        for step in 0..=14 {
            let told_v = 0.25 * f64::from(step);
            if told_v > most_told_v {
                continue;
            }
            for seed in 0..4 {
                let (fault, ticks) = stuck(told_v, stuck_v, seed)
                    .unwrap_or_else(|| panic!("told {told_v} V, at {stuck_v} V: not noticed"));
                println!(
                    "told {told_v} V, stuck at {stuck_v} V: {} after {ticks} ticks",
                    fault.name()
                );
                assert!(
                    matches!(
                        fault,
                        Fault::ImplausibleSense | Fault::OverCurrent | Fault::ShortCircuit
                    ),
                    "{fault:?}"
                );
            }
        }
    }
}

#[test]
fn a_stage_that_follows_is_not_taken_for_a_stuck_one() {
    for step in 0..=14 {
        let told_v = 0.25 * f64::from(step);
        for seed in 0..4 {
            assert_eq!(stuck(told_v, told_v, seed), None, "{told_v} V");
        }
    }
}
