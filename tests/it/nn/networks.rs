//! Sequence-to-sequence networks.

use candle_core::{DType, Device, Result, Tensor};
use orator_nn::Mode;
use orator_nn::params::Params;
use orator_nn::seq2seq::autoencoder::AudioBaseline;
use orator_nn::seq2seq::config::{Config, Segment};
use orator_nn::seq2seq::networks::{ContextSeq2Seq, WordsSeq2Seq};
use orator_nn::seq2seq::predict::{GesturePredictor, TruePoses};
use orator_test_support::gradcheck::pattern;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn small() -> Config {
    let sizes = Config { pose: 2, audio: 3, context: 5, previous: 3, predicted: 4, ..Config::default() };
    Config { hidden: 6, vocabulary: 4, word: 3, word_hidden: 3, ..sizes }
}

fn values(shape: [usize; 2], phase: f64) -> Result<Tensor> {
    pattern(&[2, shape[0], shape[1]], phase)?.to_dtype(DType::F32)
}

fn segment(words: Option<Tensor>) -> Result<Segment> {
    Ok(Segment { audio: values([8, 3], 0.0)?, previous: values([3, 2], 1.0)?, words })
}

#[test]
fn training_is_unchanged_unless_true_poses_are_taken() -> Result<()> {
    let mut params = [Params::new(3), Params::new(4), Params::new(5)];
    let networks: [Box<dyn GesturePredictor>; 3] = [
        Box::new(WordsSeq2Seq::new(&mut params[0], &small())?),
        Box::new(WordsSeq2Seq::audio_only(&mut params[1], &small())?),
        Box::new(ContextSeq2Seq::new(&mut params[2], &small())?),
    ];
    let of_segments = Tensor::new(&[[2u32, 0, 3], [1, 2, 2]], &Device::Cpu)?;
    let of_poses = Tensor::ones((2, 4, 3), DType::U32, &Device::Cpu)?;
    let poses = values([4, 2], 2.0)?;
    for ((network, params), words) in networks.iter().zip(&params).zip([Some(of_segments), None, Some(of_poses)]) {
        let segment = segment(words)?;
        // Poses, then gradients.
        let train = |taken: Option<&[bool]>| -> Result<Vec<Vec<f32>>> {
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let mut mode = Mode::Train(&mut rng);
            let predicted = match taken {
                None => network.forward(&segment, &mut mode)?,
                Some(taken) => network.forward_with_truth(&segment, &TruePoses { poses: &poses, taken }, &mut mode)?,
            };
            let gradients = predicted.sqr()?.sum_all()?.backward()?;
            let of_params = params.trainables().filter_map(|(_, var)| gradients.get(var));
            std::iter::once(&predicted).chain(of_params).map(|v| v.flatten_all()?.to_vec1()).collect()
        };
        let without = train(None)?;
        assert_eq!(without.len(), 1 + params.trainables().count());
        assert_eq!(without, train(Some(&[false; 8]))?);
        // Only the inputs of the second sample's last two steps are true poses.
        let with = train(Some(&[true, false, false, false, true, false, true, true]))?;
        assert_eq!(without[0][..12], with[0][..12]);
        assert!((12..16).all(|i| without[0][i] != with[0][i]), "{without:?} {with:?}");
        assert!(train(Some(&[false; 7])).is_err());
    }
    Ok(())
}

#[test]
fn networks_without_a_decoder_read_no_true_poses() -> Result<()> {
    let network = AudioBaseline::new(&mut Params::new(1), &small())?;
    let truth = TruePoses { poses: &values([4, 2], 2.0)?, taken: &[true; 8] };
    assert!(network.forward(&segment(None)?, &mut Mode::Eval).is_ok());
    let result = network.forward_with_truth(&segment(None)?, &truth, &mut Mode::Eval);
    assert!(result.is_err_and(|error| error.to_string().contains("no decoder")));
    Ok(())
}

#[test]
fn the_network_without_words_has_two_encoder_layers_and_one_attention() -> Result<()> {
    let config = Config { dropout_between: 0.0, dropout: 0.0, ..small() };
    type Build = fn(&mut Params, &Config) -> Result<WordsSeq2Seq>;
    let names = |build: Build| -> Result<Vec<String>> {
        let mut params = Params::new(1);
        build(&mut params, &config)?;
        Ok(params.trainables().map(|(name, _)| name.to_owned()).collect())
    };
    let without = |names: Vec<String>, part: &str| -> Vec<String> {
        names.into_iter().filter(|name| !name.contains(part)).collect()
    };
    let audio_only = names(WordsSeq2Seq::audio_only)?;
    assert_eq!(audio_only, without(names(WordsSeq2Seq::new)?, "word_"));
    assert_eq!(audio_only.iter().filter(|name| name.starts_with("encoder.gru.weight_hh_l1")).count(), 2);
    assert_eq!(names(WordsSeq2Seq::without_words)?, without(audio_only, "_l1"));

    let mut params = Params::new(1);
    let network = WordsSeq2Seq::audio_only(&mut params, &config)?;
    assert_eq!(params.tensors()?["decoder.output.weight"].dims(), [2, 12]);
    let predicted = network.forward(&segment(None)?, &mut Mode::Eval)?;
    assert_eq!(predicted.dims(), [2, 4, 2]);
    // The default dropout before the output belongs to the network with words.
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let trained = network.forward(&segment(None)?, &mut Mode::Train(&mut rng))?;
    assert_eq!(trained.to_vec3::<f32>()?, predicted.to_vec3::<f32>()?);
    let words = Tensor::new(&[[2u32], [1]], &Device::Cpu)?;
    assert!(network.forward(&segment(Some(words))?, &mut Mode::Eval).is_err());
    Ok(())
}
