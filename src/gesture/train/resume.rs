//! What trainings that go on from a checkpoint share: windows of a step, settings that count, advice when one breaks.

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

/// Loss beyond which a training has exploded.
const LOSS_LIMIT: f64 = 1e4;

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
/// behind the name of the section. What is requested as `"auto"` is what the checkpoint has.
pub fn settings<T: Serialize + DeserializeOwned>(
    stored: &T,
    requested: &impl Serialize,
    section: &str,
    free: &[&str],
) -> Result<(T, Vec<String>)> {
    let (mut kept, requested) = (serde_json::to_value(stored)?, serde_json::to_value(requested)?);
    let mut differences = Vec::new();
    for (key, value) in requested.as_object().into_iter().flatten() {
        if value.as_str() == Some(AUTO) {
            continue;
        }
        if free.contains(&key.as_str()) {
            kept[key].clone_from(value);
        } else if kept[key] != *value {
            differences.push(format!("{section}.{key} is {value} now, {} in the checkpoint, which counts", kept[key]));
        }
    }
    Ok((serde_json::from_value(kept)?, differences))
}

/// The newest checkpoint of a folder, and what `read` makes of it; said, with a line for each difference that `read` finds.
/// `None`: there is none. Errors name the checkpoint.
pub fn newest<T>(
    folder: &Path,
    progress: &dyn Progress,
    read: impl FnOnce(&Contents) -> Result<(T, Vec<String>)>,
) -> Result<Option<(T, Contents)>> {
    let Some((step, newest)) = checkpoint::list(folder)?.pop() else { return Ok(None) };
    let contents = Contents::read(&newest)?;
    let (stored, differences) = read(&contents).with_context(|| format!("cannot go on from {}", newest.display()))?;
    progress.say(&format!("going on from {} (step {step})", newest.display()));
    differences.iter().for_each(|line| progress.say(line));
    Ok(Some((stored, contents)))
}

/// Errors, stating all of them, when a loss is not finite or has exploded.
pub fn ensure_sound(step: usize, losses: &[(&str, f64)], gradient_norm: f64) -> Result<()> {
    let is_sound = losses.iter().all(|(_, loss)| loss.is_finite() && loss.abs() < LOSS_LIMIT);
    let listed: Vec<String> = losses.iter().map(|(name, loss)| format!("{name} {loss}")).collect();
    ensure!(
        is_sound && gradient_norm.is_finite(),
        "the training broke at step {step}: {}, norm of the gradient {gradient_norm}",
        listed.join(", ")
    );
    Ok(())
}

/// Which checkpoint is kept when a training breaks, and what may help.
pub fn kept(folder: &Path, section: &str) -> String {
    let advice = format!("a smaller {section}.learning_rate may help");
    match checkpoint::list(folder).ok().and_then(|mut all| all.pop()) {
        Some((step, path)) => format!("the checkpoint of step {step} is kept: {}; {advice}", path.display()),
        None => format!("there is no checkpoint yet; {advice}"),
    }
}
