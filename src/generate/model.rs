//! What a checkpoint of the generator means: the metadata that generation needs, and the network itself.

use super::normalisation::Normalisation;
use super::representation::Representation;
use super::seq2seq::metadata::is_sequence_kind;
use super::variant;
use crate::audio::mel;
use crate::formats::checkpoint::Contents;
use crate::motion::bones;
use crate::nn::gan::generator::{Config, Generator};
use crate::nn::params::Params;
use crate::types::pose3d::Motion;
use crate::types::sound::SAMPLE_RATE;
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use ndarray::ArrayView2;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Tensors of the generator in a checkpoint begin with this.
pub const GENERATOR: &str = "generator.";
/// Name and version of the layout; another is refused.
const KIND: &str = "orator speaker 2";
const SKELETON: &str = "49 joints, house order";
/// Most channels of a network that is believed; the published one has 256.
const MOST_WIDTH: usize = 1024;

/// Everything beside the tensors that generation needs. Stored under `speaker` in a checkpoint's metadata.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpeakerMetadata {
    pub kind: String,
    /// The speaker's name.
    pub name: String,
    pub fps: FrameRate,
    pub skeleton: String,
    pub network: Config,
    pub audio: SpectrogramSettings,
    pub normalisation: Normalisation,
    pub representation: Representation,
    /// Hash of the dataset it learnt from.
    pub dataset: String,
    /// Videos it learnt from, those of the models that it began from among them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub videos: Vec<TrainedVideo>,
}

/// A video that a model learnt from.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TrainedVideo {
    pub speaker: String,
    /// BLAKE3 of the file, as the dataset has it.
    pub content: String,
}

/// Parameters of the spectrogram.
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
    /// Metadata with the current skeleton and spectrogram; `name` and `fps` of the speaker, `dataset` as its hash.
    pub fn new(
        name: &str,
        fps: FrameRate,
        dataset: &str,
        network: Config,
        normalisation: Normalisation,
        representation: Representation,
    ) -> Self {
        Self {
            kind: KIND.to_owned(),
            name: name.to_owned(),
            fps,
            skeleton: SKELETON.to_owned(),
            network,
            audio: SpectrogramSettings::current(),
            normalisation,
            representation,
            dataset: dataset.to_owned(),
            videos: Vec::new(),
        }
    }

    /// The generator's numbers [144 or more, T] as motion whose bones have the speaker's lengths in every frame.
    pub fn motion(&self, raw: ArrayView2<f32>) -> Motion {
        let mut motion = Motion::from_joints(self.fps, self.representation.joints(raw, &self.normalisation));
        let lengths = &self.normalisation.bone_lengths;
        bones::with_lengths(&mut motion, &std::array::from_fn(|bone| lengths.get(bone).copied().unwrap_or(0.0)));
        motion
    }
}

/// Reads a checkpoint of `orator train gan`. Errors name the file and what is wrong with it.
pub fn load(path: &Path) -> Result<(SpeakerMetadata, Generator)> {
    let contents = Contents::read(path)?;
    build(&contents).with_context(|| format!("{} is no checkpoint of `orator train gan`", path.display()))
}

/// As [`load`], the take of a speech that `seed` stands for (`variant`).
pub fn load_variant(path: &Path, seed: u64) -> Result<(SpeakerMetadata, Generator)> {
    let mut contents = Contents::read(path)?;
    // First, so that a file of another kind is named as such.
    build(&contents).with_context(|| format!("{} is no checkpoint of `orator train gan`", path.display()))?;
    variant::vary(&mut contents, GENERATOR, seed).with_context(|| format!("{} has no takes", path.display()))?;
    build(&contents)
}

fn build(contents: &Contents) -> Result<(SpeakerMetadata, Generator)> {
    let kind = &contents.facts["speaker"]["kind"];
    ensure!(!is_sequence_kind(kind), "it is one of `orator train seq2seq`, with which `orator generate` speaks");
    ensure!(kind == KIND, "its kind is {kind}, this program reads {KIND:?}");
    let metadata: SpeakerMetadata =
        serde_json::from_value(contents.facts["speaker"].clone()).context("its facts are incomplete")?;
    ensure!(metadata.skeleton == SKELETON, "its skeleton is {:?}, expected {SKELETON:?}", metadata.skeleton);
    ensure!(
        metadata.audio == SpectrogramSettings::current(),
        "its audio settings are others than this program's: {:?}",
        metadata.audio
    );
    let (n_out, n_numbers) = (metadata.network.n_out, metadata.normalisation.n_numbers());
    ensure!(n_out == n_numbers, "it makes {n_out} numbers a pose, not {n_numbers}");
    let (network, fps) = (&metadata.network, metadata.fps);
    ensure!(network.n_mels == mel::N_MELS, "it reads {} mel bands, not {}", network.n_mels, mel::N_MELS);
    ensure!((4..=MOST_WIDTH).contains(&network.width), "its width is {}, expected 4 to {MOST_WIDTH}", network.width);
    contents.expect_numbers(network.width * network.width)?;
    ensure!(fps.is_plausible(), "it moves at {fps}, expected 1 to 1000 frames a second");
    metadata.normalisation.check()?;
    metadata.representation.check()?;
    let mut params = Params::frozen();
    let generator = Generator::new(&mut params, &metadata.network)?;
    params.load(&contents.part(GENERATOR))?;
    Ok((metadata, generator))
}

/// The best checkpoint by the validation's score: the generator alone, to generate with.
pub const BEST: &str = "best.safetensors";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::normalisation::N_FEATURES;
    use crate::nn::gan::generator::Preset;
    use crate::types::skeleton::N_BONES;
    use std::collections::BTreeMap;

    #[test]
    fn facts_that_no_training_writes_are_refused() {
        let table = vec![1.0; N_FEATURES];
        let normal =
            Normalisation { mean: table.clone(), std: table, bone_lengths: vec![0.1; N_BONES], channels: Vec::new() };
        let network = Config { width: 8, ..Config::from_preset(Preset::Light, N_FEATURES) };
        let facts =
            SpeakerMetadata::new("host", FrameRate::new(15, 1), "", network.clone(), normal, Representation::Positions);
        let mut params = Params::new(0);
        Generator::new(&mut params, &network).unwrap();
        let mut contents = Contents { facts: serde_json::json!({ "speaker": facts }), tensors: BTreeMap::new() };
        contents.add(GENERATOR, params.tensors().unwrap());
        build(&contents).unwrap();
        for (place, value) in [
            ("/speaker/network/width", 1_000_000),
            ("/speaker/network/width", 0),
            ("/speaker/network/n_mels", 1_000_000),
            ("/speaker/fps/num", 4_000_000_000u32),
            ("/speaker/representation", 7),
        ] {
            let mut facts = contents.facts.clone();
            *facts.pointer_mut(place).unwrap() = value.into();
            let wrong = Contents { facts, tensors: contents.tensors.clone() };
            assert!(build(&wrong).is_err(), "{place} {value}");
        }
    }
}
