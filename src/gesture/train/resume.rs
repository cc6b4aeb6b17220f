//! Shared parts of resumable trainings: the random numbers and windows of a step, merging of stored and requested
//! settings, the newest checkpoint, and checks of the losses.

use anyhow::{Context, Result, ensure};
use orator_base::stage::progress::Progress;
use orator_dataset::config::auto::AUTO;
use orator_formats::checkpoint;
use orator_nn::weights::Contents;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Absolute loss above which a training counts as diverged.
const LOSS_LIMIT: f64 = 1e4;

/// Random number generator of a step, which depends only on the seed and the step.
pub fn step_rng(seed: u64, step: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(step as u64 + 1);
    rng
}

/// Indices of the `n` windows of a step, drawn with replacement from `n_windows`.
pub fn sample_windows(seed: u64, step: usize, n: usize, n_windows: usize) -> Vec<usize> {
    let mut rng = step_rng(seed, step);
    (0..n).map(|_| rng.random_range(0..n_windows as u64) as usize).collect()
}

/// Settings of a resumed training: those of the checkpoint, except for the keys in `overridable`, which come from
/// `requested`. Also returns a message for each other difference, with its key `section.key`. A requested value of
/// `"auto"` never overrides the checkpoint's.
pub fn settings<T: Serialize + DeserializeOwned>(
    stored: &T,
    requested: &impl Serialize,
    section: &str,
    overridable: &[&str],
) -> Result<(T, Vec<String>)> {
    let (mut merged, requested) = (serde_json::to_value(stored)?, serde_json::to_value(requested)?);
    let mut differences = Vec::new();
    for (key, value) in requested.as_object().into_iter().flatten() {
        if value.as_str() == Some(AUTO) {
            continue;
        }
        if overridable.contains(&key.as_str()) {
            merged[key].clone_from(value);
        } else if merged[key] != *value {
            differences
                .push(format!("{section}.{key} is {value}, but {} in the checkpoint, which is used", merged[key]));
        }
    }
    Ok((serde_json::from_value(merged)?, differences))
}

/// Newest checkpoint of a folder with the state that `read` parses from it, or `None` if the folder has no checkpoint.
/// Reports the checkpoint and the differences returned by `read` to `progress`. Errors name the checkpoint.
pub fn newest<T>(
    folder: &Path,
    progress: &dyn Progress,
    read: impl FnOnce(&Contents) -> Result<(T, Vec<String>)>,
) -> Result<Option<(T, Contents)>> {
    let Some((step, newest)) = checkpoint::list(folder)?.pop() else { return Ok(None) };
    let contents = Contents::read(&newest)?;
    let (stored, differences) = read(&contents).with_context(|| format!("cannot resume from {}", newest.display()))?;
    progress.say(&format!("resuming from {} (step {step})", newest.display()));
    differences.iter().for_each(|line| progress.say(line));
    Ok(Some((stored, contents)))
}

/// Fails, listing all losses, if a loss is not finite or exceeds `LOSS_LIMIT`, or if the gradient norm is not finite.
pub fn ensure_not_diverged(step: usize, losses: &[(&str, f64)], gradient_norm: f64) -> Result<()> {
    let is_bounded = losses.iter().all(|(_, loss)| loss.is_finite() && loss.abs() < LOSS_LIMIT);
    let listed: Vec<String> = losses.iter().map(|(name, loss)| format!("{name} {loss:.3e}")).collect();
    ensure!(
        is_bounded && gradient_norm.is_finite(),
        "the training diverged at step {step}: {}, gradient norm {gradient_norm:.3e}",
        listed.join(", ")
    );
    Ok(())
}

/// Error context of a diverged training: the newest checkpoint and advice.
pub fn last_checkpoint(folder: &Path, section: &str) -> String {
    let advice = format!("try a smaller {section}.learning_rate");
    match checkpoint::list(folder).ok().and_then(|mut all| all.pop()) {
        Some((step, path)) => {
            format!("training stopped; the last checkpoint is {} (step {step}); {advice}", path.display())
        }
        None => format!("training stopped before the first checkpoint; {advice}"),
    }
}
