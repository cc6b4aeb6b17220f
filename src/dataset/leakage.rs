//! Leakage file `leakage.json`: videos that share sound, and those of them in different splits.

use super::shared_sound::SharedSound;
use super::split::Split;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Contents of `leakage.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Leakage {
    /// Shortest shared sound that counts, seconds; 0: sound was not compared.
    pub duplicate_secs: f64,
    /// Number of compared videos with samples.
    pub n_compared: usize,
    /// Pairs of videos that share sound.
    pub shared: Vec<SharedSound>,
    /// Pairs in different splits, where a test has seen training sound; caused only by splits named in the
    /// configuration.
    pub leaks: Vec<Leak>,
}

/// Two videos that share sound across splits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leak {
    pub a: String,
    pub a_split: Split,
    pub b: String,
    pub b_split: Split,
    pub secs: f64,
}

/// Result of comparing the sound of all videos.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SoundComparison {
    pub duplicate_secs: f64,
    pub shared: Vec<SharedSound>,
}

impl Leakage {
    /// Report on videos of these splits.
    pub fn new(compared: &SoundComparison, splits: &BTreeMap<String, Split>) -> Self {
        let leak = |shared: &SharedSound| {
            let (a_split, b_split) = (*splits.get(&shared.a)?, *splits.get(&shared.b)?);
            let SharedSound { a, b, secs, .. } = shared.clone();
            (a_split != b_split).then_some(Leak { a, a_split, b, b_split, secs })
        };
        Self {
            duplicate_secs: compared.duplicate_secs,
            n_compared: if compared.duplicate_secs > 0.0 { splits.len() } else { 0 },
            shared: compared.shared.clone(),
            leaks: compared.shared.iter().filter_map(leak).collect(),
        }
    }

    /// Comparison it was made from.
    pub fn compared(&self) -> SoundComparison {
        SoundComparison { duplicate_secs: self.duplicate_secs, shared: self.shared.clone() }
    }
}
