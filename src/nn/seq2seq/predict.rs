//! Common interface of the sequence-to-sequence networks: prediction of a segment of poses, and of a sound by segments.

use super::autoencoder::AudioBaseline;
use super::config::{Config, Segment};
use crate::Mode;
pub use crate::ops::recurrent::decoder::TruePoses;
use candle_core::{Result, Tensor};
use serde::Serialize;

/// A network that predicts poses from previous poses and the speech that accompanies the predicted ones.
pub trait GesturePredictor: Send + Sync {
    fn config(&self) -> &Config;

    /// Predicts the poses [B, predicted, pose] of a batch of segments.
    fn forward(&self, segment: &Segment, mode: &mut Mode) -> Result<Tensor>;

    /// Predicts poses as `forward` does, with `truth` as input of the decoder steps for which it is taken. If it is
    /// taken for none, poses and gradients are bitwise those of `forward`.
    ///
    /// # Errors
    /// The sizes do not fit, or the network has no decoder (the default).
    fn forward_with_truth(&self, _segment: &Segment, _truth: &TruePoses, _mode: &mut Mode) -> Result<Tensor> {
        candle_core::bail!("this network has no decoder that reads true poses: train it without scheduled sampling")
    }

    /// The network itself if it is an [`AudioBaseline`], whose pose codes are trained before the speech encoder.
    fn audio_baseline(&self) -> Option<&AudioBaseline> {
        None
    }

    /// Predicts the poses of segments without dropout, from the decoder's `state` after the previous segments if given,
    /// and returns that after these. The default is for networks without a state, which ignore and return none.
    fn continue_from(&self, segment: &Segment, _state: Option<&Tensor>) -> Result<(Tensor, Option<Tensor>)> {
        Ok((self.forward(segment, &mut Mode::Eval)?, None))
    }
}

/// Decoder state at the start of every segment except the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StateAtSeams {
    /// From the encoder, as before the first segment, and updated with the previous poses: as in the authors' code.
    #[default]
    Renewed,
    /// State after the previous segment, as in the paper.
    Carried,
}

/// Generates poses [1, n predicted, pose] for a sound of n segments; each segment starts from the last poses of the
/// one before. Inputs: `audio` [1, n predicted + context - 1, audio] and `start` [1, previous, pose]; `words` returns
/// the words of a segment by its index.
///
/// # Errors
/// The sound is shorter than one segment.
pub fn generate(
    network: &dyn GesturePredictor,
    audio: &Tensor,
    start: &Tensor,
    seams: StateAtSeams,
    mut words: impl FnMut(usize) -> Result<Option<Tensor>>,
) -> Result<Tensor> {
    let config = network.config();
    let n = (audio.dim(1)? + 1).saturating_sub(config.context) / config.predicted;
    let (mut previous, mut state) = (start.clone(), None);
    let mut poses = Vec::with_capacity(n);
    for i in 0..n {
        let audio = audio.narrow(1, i * config.predicted, config.audio_frames())?;
        let segment = Segment { audio, previous: previous.clone(), words: words(i)? };
        let predicted = match seams {
            StateAtSeams::Renewed => network.forward(&segment, &mut Mode::Eval)?,
            StateAtSeams::Carried => {
                let (predicted, state_after) = network.continue_from(&segment, state.as_ref())?;
                state = state_after;
                predicted
            }
        };
        let both = Tensor::cat(&[&previous, &predicted], 1)?;
        previous = both.narrow(1, both.dim(1)? - config.previous, config.previous)?.contiguous()?;
        poses.push(predicted);
    }
    if poses.is_empty() {
        candle_core::bail!("the audio ({} frames) is shorter than one segment", audio.dim(1)?);
    }
    Tensor::cat(&poses, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::gradcheck::pattern;
    use crate::params::Params;
    use crate::seq2seq::networks::WordsSeq2Seq;
    use candle_core::Device;

    /// Adds 1, or 100 if the segment's word is 1, to the last pose at every step, and counts segments in its state.
    struct Counting(Config);

    impl GesturePredictor for Counting {
        fn config(&self) -> &Config {
            &self.0
        }

        fn forward(&self, segment: &Segment, _: &mut Mode) -> Result<Tensor> {
            self.0.check(segment)?;
            let last = segment.previous.narrow(1, self.0.previous - 1, 1)?.flatten_all()?.to_vec1::<f32>()?[0];
            let words = segment.words.as_ref().map(|words| words.to_vec1::<u32>()).transpose()?;
            let step = if words.is_some_and(|words| words[0] == 1) { 100.0 } else { 1.0 };
            let poses: Vec<f32> = (1..=self.0.predicted).map(|t| last + step * t as f32).collect();
            Tensor::from_vec(poses, (1, self.0.predicted, 1), &Device::Cpu)
        }

        fn continue_from(&self, segment: &Segment, state: Option<&Tensor>) -> Result<(Tensor, Option<Tensor>)> {
            let state = state.map_or(0.0, |state| state.to_scalar::<f32>().unwrap_or(f32::NAN)) + 1.0;
            let poses = (self.forward(segment, &mut Mode::Eval)? + f64::from(1000.0 * state))?;
            Ok((poses, Some(Tensor::new(state, &Device::Cpu)?)))
        }
    }

    fn counted(n_frames: usize, previous: usize, seams: StateAtSeams) -> Result<Vec<f32>> {
        let config = Config { pose: 1, audio: 1, context: 3, previous, predicted: 3, ..Config::default() };
        let audio = pattern(&[1, n_frames + 2, 1], 0.0)?;
        let start = Tensor::full(5f32, (1, previous, 1), &Device::Cpu)?;
        let words = |i: usize| Tensor::new(&[i as u32], &Device::Cpu).map(Some);
        generate(&Counting(config), &audio, &start, seams, words)?.flatten_all()?.to_vec1()
    }

    #[test]
    fn segments_continue_from_the_last_poses_with_their_words() -> Result<()> {
        let expected = [6.0, 7.0, 8.0, 108.0, 208.0, 308.0, 309.0, 310.0, 311.0];
        for previous in [1, 2, 3, 7] {
            assert_eq!(counted(9, previous, StateAtSeams::Renewed)?, expected);
        }
        // Two remaining frames do not give another segment.
        assert_eq!(counted(8, 2, StateAtSeams::Renewed)?, expected[..6]);
        assert!(counted(2, 2, StateAtSeams::Renewed).is_err() && counted(0, 2, StateAtSeams::Carried).is_err());
        let carried = counted(6, 2, StateAtSeams::Carried)?;
        assert_eq!(carried, [1006.0, 1007.0, 1008.0, 3108.0, 3208.0, 3308.0]);
        Ok(())
    }

    #[test]
    fn state_at_seams_does_not_affect_the_first_segment() -> Result<()> {
        let sizes = Config { pose: 2, audio: 3, context: 5, previous: 3, predicted: 4, ..Config::default() };
        let config = Config { hidden: 6, vocabulary: 4, word: 3, word_hidden: 3, ..sizes };
        let network = WordsSeq2Seq::new(&mut Params::new(3), &config)?;
        let audio = pattern(&[1, 12 + 4, 3], 0.0)?.to_dtype(candle_core::DType::F32)?;
        let start = Tensor::zeros((1, 3, 2), candle_core::DType::F32, &Device::Cpu)?;
        let generated = |seams| {
            let words = |_| Tensor::new(&[[2u32, 0]], &Device::Cpu).map(Some);
            generate(&network, &audio, &start, seams, words)?.flatten_all()?.to_vec1::<f32>()
        };
        let (renewed, carried) = (generated(StateAtSeams::Renewed)?, generated(StateAtSeams::Carried)?);
        assert_eq!((renewed.len(), &renewed[..8]), (24, &carried[..8]));
        assert!(renewed[8..16] != carried[8..16] && carried.iter().all(|v| v.is_finite()));
        Ok(())
    }
}
