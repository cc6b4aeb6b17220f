//! Segments that begin with poses which the network made itself, as all but the first do in generation (scheduled sampling,
//! Bengio et al. 2015): from real poses alone a network learns to copy them and hears too little.

use super::segments::{SegmentBatch, SegmentLoader};
use anyhow::Result;
use candle_core::Tensor;
use orator_nn::Mode;
use orator_nn::seq2seq::config::Config;
use orator_nn::seq2seq::predict::GesturePredictor;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Gives a share of the segments `which` of a batch the last poses that the network makes of the segments before them,
/// which begin with real ones; those without a segment before keep theirs.
pub fn begin_with_own(
    batch: &mut SegmentBatch,
    which: &[usize],
    loader: &SegmentLoader,
    network: &dyn GesturePredictor,
    share: f64,
    rng: &mut ChaCha8Rng,
) -> Result<()> {
    let Config { previous, predicted, .. } = *network.config();
    let chosen: Vec<usize> = (0..which.len()).filter(|_| rng.random_bool(share)).collect();
    let chosen: Vec<usize> = chosen.into_iter().filter(|at| loader.has_segment_before(which[*at])).collect();
    if chosen.is_empty() || previous > predicted {
        return Ok(());
    }
    let before = loader.batch_before(&chosen.iter().map(|at| which[*at]).collect::<Vec<_>>())?;
    let made = network.forward(&before.segment, &mut Mode::Eval)?.detach();
    let made = made.narrow(1, predicted - previous, previous)?;
    let mut rows =
        (0..which.len()).map(|at| batch.segment.previous.get(at)).collect::<candle_core::Result<Vec<_>>>()?;
    for (n, at) in chosen.into_iter().enumerate() {
        rows[at] = made.get(n)?;
    }
    batch.segment.previous = Tensor::stack(&rows, 0)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::normalisation::Normalisation;
    use crate::generate::representation::Representation;
    use crate::generate::seq2seq::architecture::{Architecture, network_config};
    use crate::generate::seq2seq::metadata::SequenceMetadata;
    use crate::generate::seq2seq::poses::PoseNumbers;
    use crate::generate::seq2seq::vocabulary::Vocabulary;
    use crate::train::seq2seq::sequence::PoseSequence;
    use ndarray::Array2;
    use orator_base::types::time::FrameRate;
    use orator_nn::seq2seq::config::Segment;
    use rand::SeedableRng;

    /// Makes the number of the frame of the first predicted pose, counted from its previous poses, plus 1000.
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
    fn chosen_segments_go_on_from_the_networks_poses_at_their_own_frames() {
        let fps = FrameRate::new(15, 1);
        let network = Config { context: 3, audio: 26, ..network_config(fps, 1, 2, [4, 4]) };
        let nothing = Vec::new;
        let normalisation =
            Normalisation { mean: nothing(), std: nothing(), bone_lengths: nothing(), channels: Vec::new() };
        let metadata = SequenceMetadata {
            kind: SequenceMetadata::kind(),
            name: String::new(),
            fps,
            rate: 16_000,
            architecture: Architecture::Adversarial,
            network: network.clone(),
            poses: PoseNumbers::Joints { normalisation, representation: Representation::Positions },
            vocabulary: Vocabulary::default(),
            words_around_secs: 2.0,
            dataset: String::new(),
        };
        let frames = Array2::from_shape_fn((60, 1), |(t, _)| t as f32);
        let audio = Array2::zeros((62, 26));
        let sequence = PoseSequence::new(frames, Array2::from_elem((60, 1), true), audio, Vec::new());
        let loader = SegmentLoader::new(vec![sequence], &metadata, 1);
        let which = [0, 20, 3, 30];
        let mut batch = loader.batch(&which).unwrap();
        let rng = &mut ChaCha8Rng::seed_from_u64(1);
        begin_with_own(&mut batch, &which, &loader, &Counting(network.clone()), 1.0, rng).unwrap();
        let first =
            |at: usize| batch.segment.previous.get(at).unwrap().flatten_all().unwrap().to_vec1::<f32>().unwrap()[0];
        // Segments at frames 0 and 3 have none before them.
        assert_eq!([0, 1, 2, 3].map(first), [0.0, 1020.0, 3.0, 1030.0]);
        let real = loader.batch(&which).unwrap().segment.previous.to_vec3::<f32>().unwrap();
        let mut batch = loader.batch(&which).unwrap();
        begin_with_own(&mut batch, &which, &loader, &Counting(network), 0.0, rng).unwrap();
        assert_eq!(batch.segment.previous.to_vec3::<f32>().unwrap(), real);
    }
}
