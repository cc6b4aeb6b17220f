//! Metadata in the checkpoint of a sequence-to-sequence network, and loading of the network it describes.

use super::architecture::{self, AROUND_SEGMENT_SECS, Architecture, NumberedWord, RATES, Vocabulary, network_config};
use super::poses::PoseFormat;
use crate::generate::model::checkpoint_file;
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use orator_base::types::time::FrameRate;
use orator_nn::params::Params;
use orator_nn::seq2seq::config::{CPU_ONLY, Config, SCORE_BLOCKS};
use orator_nn::seq2seq::encoders::table_name;
use orator_nn::seq2seq::predict::GesturePredictor;
use orator_nn::weights::Contents;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Prefix of the network's tensors in a checkpoint.
pub const NETWORK: &str = "network.";
/// Name and version of the checkpoint layout; any other is rejected.
pub const KIND: &str = "orator sequence 1";
/// Largest accepted dimension of hidden states and word embeddings.
const MAX_WIDTH: usize = 4096;

/// Everything that generation needs besides the tensors. Stored under `speaker` in the metadata of a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceMetadata {
    pub kind: String,
    /// Name of the speaker, or of the folder of captures.
    pub name: String,
    pub fps: FrameRate,
    /// Sample rate of the input audio, Hz.
    pub rate: u32,
    pub architecture: Architecture,
    pub network: Config,
    pub poses: PoseFormat,
    pub vocabulary: Vocabulary,
    /// Word context of the network `words` on either side of a segment, seconds.
    #[serde(default = "around_segment_secs")]
    pub words_around_secs: f64,
    /// Whether the decoder's state is carried over segment seams without being requested.
    #[serde(default)]
    pub carries_state: bool,
    /// Whether a table of word vectors initialised the word embeddings.
    #[serde(default)]
    pub has_word_vectors: bool,
    /// Hash of the training data.
    pub dataset: String,
}

impl SequenceMetadata {
    /// Name of the current checkpoint layout.
    pub fn kind() -> String {
        KIND.to_owned()
    }

    /// Word indices for a segment whose first predicted pose is `first`; `spoken_words` are sorted by start time.
    pub fn words_of_segment(&self, spoken_words: &[NumberedWord], first: usize) -> Vec<Vec<u32>> {
        architecture::words(
            self.architecture,
            spoken_words,
            [first, self.network.predicted],
            self.fps,
            self.words_around_secs,
        )
    }

    /// Builds the network with the tensors `params` of its checkpoint and the word vectors `added` [n, word] after those
    /// of the vocabulary. Fails if the network does not read words, or if its word vectors have another dimension.
    pub fn with_word_vectors(&self, params: &Params, added: &Tensor) -> Result<Box<dyn GesturePredictor>> {
        let encoder = architecture::word_encoder(self.architecture).context("the network does not read words")?;
        let mut tensors: BTreeMap<String, Tensor> =
            params.all().map(|(name, var)| (name.to_owned(), var.as_detached_tensor())).collect();
        let table = tensors.get_mut(&table_name(encoder)).context("the network has no word embedding")?;
        *table = Tensor::cat(&[&*table, &added.to_device(params.device())?], 0)?;
        let config = Config { vocabulary: table.dim(0)?, ..self.network.clone() };
        let mut extended = Params::frozen().on(params.device());
        let network = architecture::network(self.architecture, &mut extended, &config)?;
        extended.load(&tensors)?;
        Ok(network)
    }

    /// Fails unless the metadata is consistent and supported by this program.
    pub fn check(&self) -> Result<()> {
        let (fps, network) = (self.fps, &self.network);
        ensure!(fps.is_plausible(), "the frame rate is {fps}, expected 1 to 1000 fps");
        ensure!(RATES.contains(&self.rate), "the sample rate is {} Hz, expected one of {RATES:?}", self.rate);
        ensure!(
            (1..=MAX_WIDTH).contains(&network.hidden) && (1..=MAX_WIDTH).contains(&network.word),
            "the hidden size is {} and the size of word vectors {}, expected 1 to {MAX_WIDTH}",
            network.hidden,
            network.word
        );
        let around = self.words_around_secs;
        ensure!((0.0..=60.0).contains(&around), "the word context is {around} s, expected 0 to 60 s");
        self.poses.check(fps)?;
        ensure!(self.vocabulary.is_sorted(), "the vocabulary is not sorted");
        let n_blocks = network.score_blocks;
        ensure!(SCORE_BLOCKS.contains(&n_blocks), "the discriminator has {n_blocks} blocks, expected {SCORE_BLOCKS:?}");
        let (pose, words) = (self.poses.n_features(), self.vocabulary.n_indices());
        let sizes = network_config(fps, pose, words, [network.hidden, network.word]);
        let expected = Config { audio_context: network.audio_context, score_blocks: n_blocks, ..sizes };
        ensure!(*network == expected, "unsupported network sizes: {network:?}");
        Ok(())
    }
}

const fn around_segment_secs() -> f64 {
    AROUND_SEGMENT_SECS
}

/// Whether a file is a checkpoint of a sequence-to-sequence network or of a GAN with word input. Fails if it cannot be
/// read or is not a checkpoint.
pub fn reads_transcript(path: &Path) -> Result<bool> {
    let speaker = &orator_formats::checkpoint::facts(path)?["speaker"];
    Ok(is_sequence_kind(&speaker["kind"]) || speaker["words"].is_object())
}

/// Whether a kind denotes checkpoints of sequence-to-sequence networks of any version.
pub fn is_sequence_kind(kind: &serde_json::Value) -> bool {
    kind.as_str().is_some_and(|kind| kind.starts_with("orator sequence"))
}

/// Why the networks of checkpoints, or of folders of trainings, run on the CPU only; `None` if no network does.
pub fn cpu_only<'p>(paths: impl IntoIterator<Item = &'p Path>) -> Option<&'static str> {
    let facts = |path| checkpoint_file(path).and_then(|file| orator_formats::checkpoint::facts(&file));
    let is_sequence = |path| facts(path).is_ok_and(|facts| is_sequence_kind(&facts["speaker"]["kind"]));
    CPU_ONLY.filter(|_| paths.into_iter().any(is_sequence))
}

/// Loads a checkpoint of `orator train seq2seq` on `device`: the network, and its tensors. Errors name the file and the
/// cause.
pub fn load(path: &Path, device: &Device) -> Result<(SequenceMetadata, Params, Box<dyn GesturePredictor>)> {
    let contents = Contents::read(path)?;
    build(&contents, device)
        .with_context(|| format!("{} is not a checkpoint of `orator train seq2seq`", path.display()))
}

fn build(contents: &Contents, device: &Device) -> Result<(SequenceMetadata, Params, Box<dyn GesturePredictor>)> {
    let kind = &contents.facts["speaker"]["kind"];
    ensure!(kind == KIND, "unsupported kind {kind}: expected {KIND:?}");
    let metadata: SequenceMetadata =
        serde_json::from_value(contents.facts["speaker"].clone()).context("incomplete metadata")?;
    metadata.check()?;
    contents.expect_numbers(metadata.network.hidden * metadata.network.hidden)?;
    let mut params = Params::frozen().on(device);
    let network = architecture::network(metadata.architecture, &mut params, &metadata.network)?;
    params.load(&contents.part(NETWORK))?;
    Ok((metadata, params, network))
}
