//! Checkpoints of the GAN generator: the metadata that generation needs, and loading of the network.

use super::live::{LOOK_AHEAD_SECS, look_ahead};
use super::normalisation::Normalisation;
use super::representation::Representation;
use super::seq2seq::metadata::is_sequence_kind;
use super::trained;
use super::word_input::TrainedWords;
use anyhow::{Context, Result, bail, ensure};
use candle_core::Device;
use ndarray::ArrayView2;
use orator_base::audio::mel;
use orator_base::motion::bones;
use orator_base::stage::workdir::FolderLock;
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_formats::checkpoint;
use orator_nn::gan::generator::{Config, Generator};
use orator_nn::gan::speaker_layer::SPEAKER;
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Prefix of the generator's tensors in a checkpoint.
pub const GENERATOR: &str = "generator.";
/// Name and version of the checkpoint layout; any other is rejected.
const KIND: &str = "orator speaker 2";
/// That of a network with a limited look-ahead, which earlier versions of the program would run as a complete one.
const BOUNDED_KIND: &str = "orator speaker 3";
const SKELETON: &str = "49 joints, house order";
/// Largest accepted number of channels; the published network has 256.
const MAX_WIDTH: usize = 1024;
/// Largest accepted dimension of word embeddings.
const MAX_WORD: usize = 4096;

/// Everything that generation needs besides the tensors. Stored under `speaker` in the metadata of a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpeakerMetadata {
    pub kind: String,
    pub name: String,
    pub fps: FrameRate,
    pub skeleton: String,
    pub network: Config,
    pub audio: SpectrogramSettings,
    pub normalisation: Normalisation,
    pub representation: Representation,
    /// Hash of the training dataset.
    pub dataset: String,
    /// Training videos, including those of the models that this one was initialised from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub videos: Vec<TrainedVideo>,
    /// Vocabulary of a network with word input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub words: Option<TrainedWords>,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TrainedVideo {
    pub speaker: String,
    /// BLAKE3 hash of the file, as stored in the dataset.
    pub content: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectrogramSettings {
    pub rate: u32,
    pub window: usize,
    pub hop: usize,
    pub fft: usize,
    pub n_mels: usize,
    pub lowest_hz: f64,
    pub highest_hz: f64,
}

impl SpectrogramSettings {
    /// Parameters of [`mel::log_mel`].
    pub fn current() -> Self {
        Self {
            rate: SAMPLE_RATE,
            window: mel::WINDOW,
            hop: mel::HOP,
            fft: mel::FFT,
            n_mels: mel::N_MELS,
            lowest_hz: mel::LOWEST_HZ,
            highest_hz: mel::HIGHEST_HZ,
        }
    }
}

impl SpeakerMetadata {
    /// Metadata with the current skeleton and spectrogram settings. `name` and `fps` are those of the speaker,
    /// `dataset` is the hash of the dataset.
    pub fn new(
        name: &str,
        fps: FrameRate,
        dataset: &str,
        network: Config,
        normalisation: Normalisation,
        representation: Representation,
    ) -> Self {
        Self {
            kind: if network.look_ahead.is_some() { BOUNDED_KIND } else { KIND }.to_owned(),
            name: name.to_owned(),
            fps,
            skeleton: SKELETON.to_owned(),
            network,
            audio: SpectrogramSettings::current(),
            normalisation,
            representation,
            dataset: dataset.to_owned(),
            videos: Vec::new(),
            words: None,
        }
    }

    /// Adds training videos, without duplicates.
    pub fn add_videos(&mut self, videos: Vec<TrainedVideo>) {
        self.videos.extend(videos);
        self.videos.sort();
        self.videos.dedup();
    }

    /// Adds the words of a training and the sizes of its word embeddings, of dimension `dim`; none for `None`.
    pub fn with_words(mut self, words: Option<TrainedWords>, dim: usize) -> Self {
        let sizes = words.as_ref().map_or([0, 0], |words| [words.vocabulary.n_indices(), dim]);
        [self.network.vocabulary, self.network.word] = sizes;
        Self { words, ..self }
    }

    /// Converts network output [144 or more, T] to motion with the speaker's bone lengths in every frame.
    pub fn motion(&self, raw: ArrayView2<f32>) -> Motion {
        let mut motion = Motion::from_joints(self.fps, self.representation.joints(raw, &self.normalisation));
        bones::with_lengths(&mut motion, &self.normalisation.lengths());
        motion
    }
}

#[derive(Clone, Debug, Default)]
pub struct GenerationChoice {
    /// Name of the speaker; required for networks of several speakers.
    pub speaker: Option<String>,
    /// Seed of the variant (see `trained`); `None`: the complete network.
    pub seed: Option<u64>,
}

/// Loads a checkpoint of `orator train gan` as a network of one speaker on `device`. Errors name the file and the cause.
pub fn load(path: &Path, choice: &GenerationChoice, device: &Device) -> Result<(SpeakerMetadata, Generator)> {
    load_with_contents(path, choice, device).map(|(metadata, generator, _)| (metadata, generator))
}

/// Like `load`, with the tensors of the chosen speaker and variant.
pub fn load_with_contents(
    path: &Path,
    choice: &GenerationChoice,
    device: &Device,
) -> Result<(SpeakerMetadata, Generator, Contents)> {
    let mut contents = Contents::read(path)?;
    let context = || format!("{} is not a checkpoint of `orator train gan`", path.display());
    check(&contents.facts["speaker"]).with_context(context)?;
    select_speaker(&mut contents, choice.speaker.as_deref()).with_context(|| path.display().to_string())?;
    if let Some(seed) = choice.seed {
        trained::vary(&mut contents, GENERATOR, seed).with_context(|| format!("{} has no variants", path.display()))?;
    }
    let (metadata, generator) = build(&contents, device).with_context(context)?;
    Ok((metadata, generator, contents))
}

/// Speakers of a checkpoint of `orator train gan` in the order of their indices, from its metadata `facts`.
pub fn speakers(facts: &serde_json::Value) -> Result<Vec<SpeakerMetadata>> {
    check(&facts["speaker"])?;
    let first = [facts["speaker"].clone()];
    let others = facts["other_speakers"].as_array().cloned().unwrap_or_default();
    let all = first.into_iter().chain(others).map(serde_json::from_value);
    let all: Vec<SpeakerMetadata> = all.collect::<serde_json::Result<_>>().context("incomplete metadata")?;
    let n_speakers = all[0].network.n_speakers.max(1);
    ensure!(n_speakers == all.len(), "it has the metadata of {} of {n_speakers} speakers", all.len());
    Ok(all)
}

fn select_speaker(contents: &mut Contents, name: Option<&str>) -> Result<()> {
    let all = speakers(&contents.facts)?;
    let names = || all.iter().map(|speaker| speaker.name.as_str()).collect::<Vec<_>>().join(", ");
    let number = match name {
        None if all.len() == 1 => return Ok(()),
        None => bail!("the model has several speakers; choose one with --speaker: {}", names()),
        Some(name) => all.iter().position(|speaker| speaker.name == name),
    };
    let number =
        number.with_context(|| format!("unknown speaker {:?}: expected {}", name.unwrap_or_default(), names()))?;
    if all.len() > 1 {
        let mut chosen = all[number].clone();
        chosen.network.n_speakers = 1;
        contents.facts["speaker"] = serde_json::to_value(chosen)?;
        let prefix = format!("{GENERATOR}{SPEAKER}");
        for (name, table) in contents.tensors.iter_mut().filter(|(name, _)| name.starts_with(&prefix)) {
            *table = table.narrow(0, number, 1).with_context(|| format!("tensor {name}"))?;
        }
    }
    Ok(())
}

/// Fails unless the metadata of a speaker is of a checkpoint kind that this program reads.
fn check(facts: &serde_json::Value) -> Result<()> {
    let kind = &facts["kind"];
    ensure!(!is_sequence_kind(kind), "it is a checkpoint of `orator train seq2seq`; use it with `orator generate`");
    let expected = if facts["network"].get("look_ahead").is_some() { BOUNDED_KIND } else { KIND };
    ensure!(kind == expected, "unsupported kind {kind}: expected {expected:?}");
    Ok(())
}

/// Metadata and network of a checkpoint, on `device`.
pub fn build(contents: &Contents, device: &Device) -> Result<(SpeakerMetadata, Generator)> {
    check(&contents.facts["speaker"])?;
    let metadata: SpeakerMetadata =
        serde_json::from_value(contents.facts["speaker"].clone()).context("incomplete metadata")?;
    ensure!(metadata.skeleton == SKELETON, "unsupported skeleton {:?}: expected {SKELETON:?}", metadata.skeleton);
    ensure!(metadata.audio == SpectrogramSettings::current(), "unsupported spectrogram settings: {:?}", metadata.audio);
    let (n_out, n_features) = (metadata.network.n_out, metadata.normalisation.n_features());
    ensure!(n_out == n_features, "the network has {n_out} outputs per pose, expected {n_features}");
    let (network, fps) = (&metadata.network, metadata.fps);
    ensure!(network.n_mels == mel::N_MELS, "the network has {} mel bands, expected {}", network.n_mels, mel::N_MELS);
    ensure!(
        (4..=MAX_WIDTH).contains(&network.width),
        "the network width is {}, expected 4 to {MAX_WIDTH}",
        network.width
    );
    ensure!(network.n_speakers <= 1, "the network has {} speakers, expected 1", network.n_speakers);
    let n_indices = metadata.words.as_ref().map_or(0, |words| words.vocabulary.n_indices());
    ensure!(
        network.vocabulary == n_indices && (n_indices == 0 || (1..=MAX_WORD).contains(&network.word)),
        "the network has {} word vectors of {} dimensions, its vocabulary {n_indices} indices; expected as many, of 1 to \
         {MAX_WORD} dimensions",
        network.vocabulary,
        network.word
    );
    ensure!(metadata.words.iter().all(|words| words.vocabulary.is_sorted()), "the vocabulary is not sorted");
    contents.expect_numbers((network.width * network.width).max(network.vocabulary * network.word))?;
    ensure!(fps.is_plausible(), "the frame rate is {fps}, expected 1 to 1000 fps");
    if let Some(of) = network.look_ahead {
        let [low, high] = LOOK_AHEAD_SECS;
        ensure!(
            (low..=high).contains(&of.secs) && of == look_ahead(network.preset, of.secs, fps),
            "the look-ahead of the network is invalid: {of:?}; expected {low} to {high} s, and what follows from it"
        );
    }
    metadata.normalisation.check()?;
    metadata.representation.check()?;
    let mut params = Params::frozen().on(device);
    let generator = Generator::new(&mut params, &metadata.network)?;
    params.load(&contents.part(GENERATOR))?;
    Ok((metadata, generator))
}

/// File name of the checkpoint with the best validation score, which holds only the generator.
pub const BEST: &str = "best.safetensors";

/// Checkpoint file for a path: the file itself, or the best, else the newest checkpoint in the folder of a training.
///
/// # Errors
/// A path that does not exist, or a folder without checkpoints.
pub fn checkpoint_file(path: &Path) -> Result<PathBuf> {
    ensure!(
        path.exists(),
        "{} does not exist; create a checkpoint with `orator train gan` or `orator train seq2seq`",
        path.display()
    );
    let best = if path.is_dir() { path.join(BEST) } else { path.to_owned() };
    if best.is_file() {
        return Ok(best);
    }
    let newest = checkpoint::list(path)?.pop().map(|(_, file)| file);
    newest.with_context(|| {
        format!("no checkpoint in {} (expected best.safetensors or step-*.safetensors)", path.display())
    })
}

/// Shared lock on the model of a checkpoint (a file, or the folder of a training), so that `forget` does not remove it.
pub fn model_lock(checkpoint: &Path) -> Result<FolderLock> {
    FolderLock::shared(if checkpoint.is_dir() { checkpoint } else { checkpoint.parent().unwrap_or(checkpoint) })
}
