//! Replaces the previous poses of some training segments by poses that the network predicts, as in generation for all
//! segments but the first (scheduled sampling, Bengio et al. 2015). Trained on real previous poses only, a network
//! learns to copy them and depends too little on the audio.

use super::segments::{SegmentBatch, SegmentLoader};
use anyhow::Result;
use candle_core::Tensor;
use orator_nn::Mode;
use orator_nn::seq2seq::config::Config;
use orator_nn::seq2seq::predict::GesturePredictor;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Replaces the previous poses of a random `share` (0..1) of the segments `which` of a batch by the last poses that the
/// network predicts for the preceding segment from its real previous poses. Segments without a complete preceding
/// segment are left unchanged, and so are all if `previous > predicted`.
pub fn roll_out_previous(
    batch: &mut SegmentBatch,
    which: &[usize],
    loader: &SegmentLoader,
    network: &dyn GesturePredictor,
    share: f64,
    rng: &mut ChaCha8Rng,
) -> Result<()> {
    let Config { previous, predicted, .. } = *network.config();
    let chosen: Vec<usize> = (0..which.len()).filter(|_| rng.random_bool(share)).collect();
    let chosen: Vec<usize> = chosen.into_iter().filter(|row| loader.has_segment_before(which[*row])).collect();
    if chosen.is_empty() || previous > predicted {
        return Ok(());
    }
    let preceding = loader.batch_before(&chosen.iter().map(|row| which[*row]).collect::<Vec<_>>())?;
    let predicted_poses = network.forward(&preceding.segment, &mut Mode::Eval)?.detach();
    let predicted_poses = predicted_poses.narrow(1, predicted - previous, previous)?;
    let mut rows =
        (0..which.len()).map(|row| batch.segment.previous.get(row)).collect::<candle_core::Result<Vec<_>>>()?;
    for (n, row) in chosen.into_iter().enumerate() {
        rows[row] = predicted_poses.get(n)?;
    }
    batch.segment.previous = Tensor::stack(&rows, 0)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::normalisation::Normalisation;
    use crate::generate::representation::Representation;
    use crate::generate::seq2seq::architecture::{Architecture, Vocabulary, network_config};
    use crate::generate::seq2seq::metadata::SequenceMetadata;
    use crate::generate::seq2seq::poses::PoseFormat;
    use crate::train::seq2seq::segments::PoseSequence;
    use ndarray::Array2;
    use orator_base::types::time::FrameRate;
    use orator_nn::seq2seq::config::Segment;
    use rand::SeedableRng;

    /// Predicts the frame numbers of the poses, counted on from the last previous pose, plus 1000.
    struct Counting(Config);

    impl GesturePredictor for Counting {
        fn config(&self) -> &Config {
            &self.0
        }

        fn forward(&self, segment: &Segment, _: &mut Mode) -> candle_core::Result<Tensor> {
            let n = self.0.predicted;
            let last = segment.previous.narrow(1, self.0.previous - 1, 1)?.repeat((1, n, 1))?;
            let steps = Tensor::arange(1f32, (n + 1) as f32, last.device())?.reshape((1, n, 1))?;
            last.broadcast_add(&steps)? + 1000.0
        }
    }

    #[test]
    fn chosen_segments_get_the_predicted_poses_of_their_own_frames() {
        let fps = FrameRate::new(15, 1);
        let network = Config { context: 3, audio: 26, ..network_config(fps, 1, 2, [4, 4]) };
        let empty = Vec::new;
        let normalisation = Normalisation { mean: empty(), std: empty(), bone_lengths: empty(), channels: Vec::new() };
        let metadata = SequenceMetadata {
            kind: SequenceMetadata::kind(),
            name: String::new(),
            fps,
            rate: 16_000,
            architecture: Architecture::Adversarial,
            network: network.clone(),
            poses: PoseFormat::Joints { normalisation, representation: Representation::Positions },
            vocabulary: Vocabulary::default(),
            words_around_secs: 2.0,
            carries_state: false,
            has_word_vectors: true,
            dataset: String::new(),
        };
        let frames = Array2::from_shape_fn((60, 1), |(t, _)| t as f32);
        let audio = Array2::zeros((62, 26));
        let sequence = PoseSequence::new(frames, Array2::from_elem((60, 1), true), audio, Vec::new());
        let loader = SegmentLoader::new(vec![sequence], &metadata, 1);
        let which = [0, 20, 3, 30];
        let mut batch = loader.batch(&which).unwrap();
        let rng = &mut ChaCha8Rng::seed_from_u64(1);
        roll_out_previous(&mut batch, &which, &loader, &Counting(network.clone()), 1.0, rng).unwrap();
        let first =
            |row: usize| batch.segment.previous.get(row).unwrap().flatten_all().unwrap().to_vec1::<f32>().unwrap()[0];
        // No complete segment precedes those at frames 0 and 3.
        assert_eq!([0, 1, 2, 3].map(first), [0.0, 1020.0, 3.0, 1030.0]);
        let real = loader.batch(&which).unwrap().segment.previous.to_vec3::<f32>().unwrap();
        let mut batch = loader.batch(&which).unwrap();
        roll_out_previous(&mut batch, &which, &loader, &Counting(network), 0.0, rng).unwrap();
        assert_eq!(batch.segment.previous.to_vec3::<f32>().unwrap(), real);
    }
}
