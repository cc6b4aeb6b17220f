//! Tests of `orator_gesture::train::seq2seq::segments`.

use candle_core::Tensor;
use ndarray::{Array2, array, aview1};
use orator_base::types::time::FrameRate;
use orator_gesture::generate::normalisation::Normalisation;
use orator_gesture::generate::representation::Representation;
use orator_gesture::generate::seq2seq::architecture::{Architecture, Vocabulary, network_config};
use orator_gesture::generate::seq2seq::metadata::SequenceMetadata;
use orator_gesture::generate::seq2seq::poses::PoseFormat;
use orator_gesture::train::seq2seq::segments::{PoseSequence, SegmentLoader, interpolate, roll_out_previous};
use orator_nn::Mode;
use orator_nn::seq2seq::config::{Config, Segment};
use orator_nn::seq2seq::predict::GesturePredictor;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

#[test]
fn unknown_values_are_interpolated() {
    let mut values = array![9.0f32, 1.0, 9.0, 9.0, 4.0, f32::NAN];
    interpolate(values.view_mut(), aview1(&[false, true, false, false, true, false]));
    assert_eq!(values, array![1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
    interpolate(values.view_mut(), aview1(&[false; 6]));
    assert_eq!(values, ndarray::Array1::<f32>::zeros(6));
}

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
