//! `leakage.json`: which videos share sound, and whether any of them stand in different splits.

use super::shared_sound::SharedSound;
use super::split::Split;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is compared, and found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Leakage {
    /// Seconds of equal sound that count; 0: sound was not compared.
    pub duplicate_secs: f64,
    /// Videos with samples whose sound was compared.
    pub n_compared: usize,
    /// Every two videos that share sound.
    pub shared: Vec<SharedSound>,
    /// Those of them that stand in different splits: a test on one has seen the other. Only names in the configuration
    /// bring this about.
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

/// What was found out by comparing the sound of all videos.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SoundComparison {
    pub duplicate_secs: f64,
    pub shared: Vec<SharedSound>,
}

impl Leakage {
    /// The report on videos of these splits.
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

    /// What it was made from, beside the splits.
    pub fn compared(&self) -> SoundComparison {
        SoundComparison { duplicate_secs: self.duplicate_secs, shared: self.shared.clone() }
    }
}
