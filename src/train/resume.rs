//! What trainings that go on from a checkpoint share: windows of a step, settings that count, advice when one breaks.

use crate::formats::checkpoint;
use anyhow::Result;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Random numbers of a step, which depend on the seed and the step alone.
pub fn stream(seed: u64, step: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(step as u64 + 1);
    rng
}

/// Windows of a step, `n` of `n_windows`, drawn with replacement.
pub fn sample_windows(seed: u64, step: usize, n: usize, n_windows: usize) -> Vec<usize> {
    let mut rng = stream(seed, step);
    (0..n).map(|_| rng.random_range(0..n_windows as u64) as usize).collect()
}

/// Settings to go on with: the checkpoint's, but for those named in `free`; and a line for each difference, its key
/// behind the name of the section.
pub fn settings<T: Serialize + DeserializeOwned>(
    stored: &T,
    requested: &T,
    section: &str,
    free: &[&str],
) -> Result<(T, Vec<String>)> {
    let (mut kept, requested) = (serde_json::to_value(stored)?, serde_json::to_value(requested)?);
    let mut differences = Vec::new();
    for (key, value) in requested.as_object().into_iter().flatten() {
        if free.contains(&key.as_str()) {
            kept[key] = value.clone();
        } else if kept[key] != *value {
            differences.push(format!("{section}.{key} is {value} now, {} in the checkpoint, which counts", kept[key]));
        }
    }
    Ok((serde_json::from_value(kept)?, differences))
}

/// Which checkpoint is kept when a training breaks, and what may help.
pub fn kept(folder: &Path, section: &str) -> String {
    let advice = format!("a smaller {section}.learning_rate may help");
    match checkpoint::list(folder).ok().and_then(|mut all| all.pop()) {
        Some((step, path)) => format!("the checkpoint of step {step} is kept: {}; {advice}", path.display()),
        None => format!("there is no checkpoint yet; {advice}"),
    }
}
