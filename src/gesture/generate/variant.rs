//! Variants of the motion for one speech: random channels of the encoded audio are dropped for the complete sound, as
//! in training with `dropout` (Srivastava et al. 2014). Each variant is one sub-network of the dropout ensemble, so no
//! cross-fades are needed for any length of sound.

use anyhow::{Result, ensure};
use candle_core::{DType, Tensor};
use orator_nn::weights::Contents;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Drop probability as a multiple of the dropout in training. For a speaker of ten minutes trained with a dropout of
/// 0.3, variants correlate with the speech as well as the complete network up to 0.6 (wrist speeds 0.82 and 0.82,
/// wrists 12 mm apart), but not at 0.8 (0.74).
const DROP_FACTOR: f64 = 2.0;
/// Largest drop probability.
const MAX_DROP: f64 = 0.9;

/// Weights of the layer that reads the encoded audio, [out, channels, kernel].
const FIRST_LAYER: &str = "enter.0.conv.weight";

/// Drops random channels of the encoded audio from a checkpoint of `orator train gan`, each with twice the dropout
/// probability of its training; the seed determines which. `prefix` is the prefix of the generator's tensor names.
///
/// # Errors
/// A checkpoint that was trained without dropout, whose variants would only be worse.
pub fn vary(contents: &mut Contents, prefix: &str, seed: u64) -> Result<()> {
    let dropout = contents.facts["settings"]["dropout"].as_f64().unwrap_or(0.0);
    ensure!(
        dropout > 0.0 && dropout < 1.0,
        "it was trained without dropout: omit --seed and --variants, or train with gan.recipe = \"auto\" or a \
         gan.dropout above 0"
    );
    let name = format!("{prefix}{FIRST_LAYER}");
    let Some(weight) = contents.tensors.get_mut(&name) else { anyhow::bail!("tensor {name} is missing") };
    let (_, n_channels, _) = weight.dims3()?;
    let share = (DROP_FACTOR * dropout).min(MAX_DROP);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let factors = (0..n_channels).map(|_| if rng.random_bool(share) { 0.0 } else { 1.0 / (1.0 - share) });
    let factors = Tensor::from_iter(factors, weight.device())?.to_dtype(DType::F32)?.reshape((1, n_channels, 1))?;
    *weight = weight.broadcast_mul(&factors)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Device;
    use std::collections::BTreeMap;

    fn contents(dropout: f64) -> Contents {
        let weight = Tensor::ones((2, 64, 3), DType::F32, &Device::Cpu).unwrap();
        Contents {
            facts: serde_json::json!({ "settings": { "dropout": dropout } }),
            tensors: BTreeMap::from([(format!("generator.{FIRST_LAYER}"), weight)]),
        }
    }

    #[test]
    fn a_seed_drops_complete_channels() -> Result<()> {
        let varied = |seed| -> Result<Vec<f32>> {
            let mut contents = contents(0.25);
            vary(&mut contents, "generator.", seed)?;
            Ok(contents
                .tensors
                .into_values()
                .next()
                .unwrap_or(Tensor::new(0f32, &Device::Cpu)?)
                .flatten_all()?
                .to_vec1()?)
        };
        let first = varied(1)?;
        let n_dropped = first.iter().filter(|value| **value == 0.0).count();
        assert!(n_dropped.is_multiple_of(6) && (120..264).contains(&n_dropped), "{n_dropped}");
        assert!(first.iter().all(|value| *value == 0.0 || (value - 2.0).abs() < 1e-6));
        assert!(first == varied(1)? && first != varied(2)?);
        assert!(vary(&mut contents(0.0), "generator.", 1).is_err());
        Ok(())
    }
}
