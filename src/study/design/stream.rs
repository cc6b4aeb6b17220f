//! Random numbers of a design: one stream for each purpose, so that a change of one leaves the others as they are.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Random numbers of one purpose.
pub fn stream(seed: u64, purpose: &str) -> ChaCha8Rng {
    ChaCha8Rng::from_seed(*blake3::hash(format!("{seed} {purpose}").as_bytes()).as_bytes())
}
