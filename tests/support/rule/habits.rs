//! Parameters in which rule-based speakers differ: which vowel moves which hand to which target, and with which delay.

use crate::drawn::figure::N_ARM;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Wrist position out, down, away (metres), then roll, raise, curl, index, spread; see `ArmControls`.
pub type ArmTarget = [f64; N_ARM];
/// Rest pose: hands in the lap.
pub const REST: ArmTarget = [0.16, 0.36, -0.2, 0.9, 0.3, 0.45, 0.0, 0.05];
pub const WIDE: ArmTarget = [0.42, 0.16, -0.24, -0.4, 0.6, 0.1, 0.0, 0.16];
pub const HIGH: ArmTarget = [0.26, -0.06, -0.26, 0.2, 1.0, 0.15, -0.1, 0.12];
pub const POINT: ArmTarget = [0.04, 0.1, -0.38, 0.6, 0.5, 0.8, -0.8, 0.02];
pub const CENTRE: ArmTarget = [0.1, 0.14, -0.36, -0.2, 0.8, 0.3, 0.0, 0.1];
/// Stroke targets of the left and right hand, by vowel of `speech`.
const TARGETS: [[Option<ArmTarget>; 2]; 5] = [
    [Some(WIDE), Some(WIDE)],
    [None, Some(HIGH)],
    [None, Some(POINT)],
    [Some(HIGH), None],
    [Some(CENTRE), Some(CENTRE)],
];

/// Delay from an onset to its stroke in seconds: left hand, right hand.
const DELAYS: [f64; 2] = [0.4, 0.2];
/// Range of the delays of other speakers, seconds.
const OTHER_DELAYS: std::ops::Range<f64> = 0.2..0.5;

/// Habits of a speaker.
#[derive(Clone, Debug, PartialEq)]
pub struct Habits {
    /// Stroke targets of the left and right hand, by vowel of `speech`.
    pub targets: [[Option<ArmTarget>; 2]; 5],
    /// Delay from an onset to its stroke in seconds: left hand, right hand.
    pub delays: [f64; 2],
}

impl Default for Habits {
    fn default() -> Self {
        Self { targets: TARGETS, delays: DELAYS }
    }
}

impl Habits {
    /// Habits with this number; 0 are the default ones. Others assign the targets to other vowels and have other
    /// delays; odd numbers also swap the hands.
    pub fn numbered(number: u64) -> Self {
        if number == 0 {
            return Self::default();
        }
        let rng = &mut ChaCha8Rng::seed_from_u64(number);
        let mut habits = Self::default();
        habits.targets.shuffle(rng);
        habits.delays = [rng.random_range(OTHER_DELAYS), rng.random_range(OTHER_DELAYS)];
        if number % 2 == 1 {
            habits.targets.iter_mut().for_each(|hands| hands.swap(0, 1));
        }
        habits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn habits_are_determined_by_their_number_and_distinct() {
        let all: Vec<Habits> = (0..8).map(Habits::numbered).collect();
        assert_eq!(all[0], Habits::default());
        assert!((1..all.len()).all(|n| all[n] == Habits::numbered(n as u64) && !all[..n].contains(&all[n])));
        for habits in &all {
            let n_targets = habits.targets.iter().flatten().flatten().count();
            assert!(n_targets == 7 && habits.delays.iter().all(|delay| (0.2..=0.5).contains(delay)), "{habits:?}");
        }
    }
}
