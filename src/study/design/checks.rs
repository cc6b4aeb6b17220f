//! Attention checks: where they stand, and the numbers that their films show.

use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Numbered films of one check clip: a participant who tells another the number tells it to few.
pub const N_VARIANTS: usize = 4;

/// Before which main trials of a session checks come, ascending: spread over the session, none before the third trial, no
/// two beside each other.
pub fn places(n_main: usize, n_checks: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let n_checks = n_checks.min(n_main.saturating_sub(2));
    let border = |at: usize| 2 + (n_main - 2) * at / n_checks;
    (0..n_checks).map(|at| rng.random_range(border(at)..border(at + 1))).collect()
}

/// Different numbers of two digits, equally likely.
pub fn numbers(rng: &mut ChaCha8Rng) -> Vec<u16> {
    let mut all: Vec<u16> = (10..=99).collect();
    all.shuffle(rng);
    all.truncate(N_VARIANTS);
    all
}
