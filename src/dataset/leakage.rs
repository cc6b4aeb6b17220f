//! Leakage file `leakage.json`: pairs of videos that share sound, and those whose shared sound is in different splits.

use super::shared_sound::SharedSound;
use super::split::{Split, TimeBlock, blocks};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Contents of `leakage.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Leakage {
    /// Minimum length of shared sound that counts, seconds; 0: sound was not compared.
    pub duplicate_secs: f64,
    /// Number of compared videos.
    pub n_compared: usize,
    /// Pairs of videos that share sound.
    pub shared: Vec<SharedSound>,
    /// Pairs whose shared sound is in different splits, so that evaluation data may occur in the training data; only
    /// splits named in the configuration cause them.
    pub leaks: Vec<Leak>,
}

/// Two videos that share sound across splits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leak {
    pub a: String,
    pub a_split: Split,
    pub b: String,
    pub b_split: Split,
    /// Seconds of the shared sound that are in different splits.
    pub secs: f64,
}

/// Result of comparing the sound of all videos.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SoundComparison {
    pub duplicate_secs: f64,
    pub shared: Vec<SharedSound>,
}

impl Leakage {
    /// Leakage of the compared videos; `splits` are their time blocks by name.
    pub fn new(compared: &SoundComparison, splits: &BTreeMap<String, Vec<TimeBlock>>) -> Self {
        let leak = |shared: &SharedSound| {
            let SharedSound { a, b, a_secs, b_secs, secs } = shared.clone();
            let span = (a_secs, a_secs + secs);
            let conflicts = blocks::conflicts(splits.get(&a)?, span, splits.get(&b)?, b_secs - a_secs);
            let (_, a_split, b_split) = *conflicts.first()?;
            let apart: f64 = conflicts.iter().map(|((start, end), ..)| end - start).sum();
            // The exact length is kept where all shared sound is in conflict; a sum of parts has rounding errors.
            let secs = if conflicts.len() == 1 && conflicts[0].0 == span { secs } else { apart };
            Some(Leak { a, a_split, b, b_split, secs })
        };
        Self {
            duplicate_secs: compared.duplicate_secs,
            n_compared: if compared.duplicate_secs > 0.0 { splits.len() } else { 0 },
            shared: compared.shared.clone(),
            leaks: compared.shared.iter().filter_map(leak).collect(),
        }
    }

    /// Comparison that the file was made from.
    pub fn compared(&self) -> SoundComparison {
        SoundComparison { duplicate_secs: self.duplicate_secs, shared: self.shared.clone() }
    }
}
