//! Prediction with sequence-to-sequence networks.

use candle_core::{Device, Result, Tensor};
use orator_nn::Mode;
use orator_nn::params::Params;
use orator_nn::seq2seq::config::{Config, Segment};
use orator_nn::seq2seq::networks::WordsSeq2Seq;
use orator_nn::seq2seq::predict::{GesturePredictor, StateAtSeams, generate};
use orator_test_support::gradcheck::pattern;

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
