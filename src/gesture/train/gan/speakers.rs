//! The speakers of a training, one or several: their metadata before the first step, from the statistics of their
//! datasets or from a resumed checkpoint, and the decoders from network outputs to poses.

use super::losses::BoneConstancy;
use super::pretrained;
use super::windows::WindowLoader;
use crate::generate::live;
use crate::generate::model::SpeakerMetadata;
use crate::generate::normalisation::{ChannelNormalisation, Normalisation};
use crate::generate::representation::{PoseDecoder, Representation};
use anyhow::{Context, Result, bail, ensure};
use candle_core::{DType, Device, Tensor};
use orator_base::motion::bones;
use orator_base::types::posture::PostureChannel;
use orator_base::types::skeleton::N_BONES;
use orator_base::types::time::FrameRate;
use orator_dataset::config::{BoneLoss, GanSettings, MotionRepresentation, NetworkPreset};
use orator_dataset::{Dataset, Split};
use orator_nn::gan::generator::{Config, Preset};
use orator_nn::gan::look_ahead::LookAhead;

/// Speakers in the order of their rows in the network's speaker table.
pub struct SpeakerSet {
    of: Vec<SpeakerMetadata>,
    decoders: Vec<PoseDecoder>,
    bones: Vec<BoneConstancy>,
}

impl SpeakerSet {
    /// Set of the speakers of one network, with the form of the bone length loss.
    ///
    /// # Errors
    /// No speaker, or another number than the network has; a speaker whose channels, frame rate or network differ from
    /// the first one's.
    pub fn new(of: Vec<SpeakerMetadata>, bone_loss: BoneLoss, device: &Device) -> Result<Self> {
        ensure!(!of.is_empty(), "no speaker to train");
        let first = &of[0];
        ensure!(
            first.network.n_speakers.max(1) == of.len(),
            "the network has {} speakers, expected {}",
            first.network.n_speakers,
            of.len()
        );
        for other in &of[1..] {
            let channels = |speaker: &SpeakerMetadata| -> Vec<_> {
                speaker.normalisation.channels.iter().map(|channel| channel.channel).collect()
            };
            ensure!(
                other.fps == first.fps && channels(other) == channels(first) && other.network == first.network,
                "{} has {} and {} {}, but a network has one frame rate: set extract.fps and build both datasets again",
                first.name,
                first.fps,
                other.name,
                other.fps
            );
        }
        let decoder = |of: &SpeakerMetadata| of.representation.decoder(&of.normalisation, DType::F32, device);
        Ok(Self {
            decoders: of.iter().map(decoder).collect::<candle_core::Result<_>>()?,
            bones: of
                .iter()
                .map(|of| BoneConstancy::new(&of.normalisation, bone_loss, DType::F32, device))
                .collect::<candle_core::Result<_>>()?,
            of,
        })
    }

    pub fn all(&self) -> &[SpeakerMetadata] {
        &self.of
    }

    pub fn network(&self) -> &Config {
        &self.of[0].network
    }

    /// Names of the speakers, separated by commas.
    pub fn names(&self) -> String {
        self.of.iter().map(|of| of.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    pub fn n_features(&self) -> usize {
        self.of[0].normalisation.n_features()
    }

    /// Decodes network outputs [B, features, T] to normalised poses [B, features, T]; `speakers` is the speaker index
    /// of each window.
    pub fn poses(&self, raw: &Tensor, speakers: &[u32]) -> Result<Tensor> {
        if let [decoder] = &self.decoders[..] {
            return Ok(decoder.poses(raw)?);
        }
        let of_run = |run: Run| Ok(self.decoders[run.speaker].poses(&raw.narrow(0, run.first, run.n)?)?);
        let poses: Vec<Tensor> = runs(speakers).into_iter().map(of_run).collect::<Result<_>>()?;
        Ok(Tensor::cat(&poses, 0)?)
    }

    /// Bone length constancy loss (`BoneConstancy`) of normalised poses [B, features, T]; `None` if the representation
    /// keeps the lengths constant.
    pub fn bone_loss(&self, poses: &Tensor, speakers: &[u32]) -> Result<Option<Tensor>> {
        if self.of[0].representation.keeps_lengths() {
            return Ok(None);
        }
        if let [bones] = &self.bones[..] {
            return Ok(Some(bones.loss(poses)?));
        }
        let mut sum = Tensor::zeros((), poses.dtype(), poses.device())?;
        for run in runs(speakers) {
            let loss = self.bones[run.speaker].loss(&poses.narrow(0, run.first, run.n)?)?;
            sum = (sum + (loss * (run.n as f64 / speakers.len() as f64))?)?;
        }
        Ok(Some(sum))
    }
}

/// Consecutive windows of one speaker in a batch.
struct Run {
    speaker: usize,
    first: usize,
    n: usize,
}

fn runs(speakers: &[u32]) -> Vec<Run> {
    let mut first = 0;
    let run = |same: &[u32]| {
        let run = Run { speaker: same[0] as usize, first, n: same.len() };
        first += same.len();
        run
    };
    speakers.chunk_by(|a, b| a == b).map(run).collect()
}

/// Fails unless every dataset has sound and each is of a different speaker.
pub fn check(datasets: &[&Dataset]) -> Result<()> {
    for (n, dataset) in datasets.iter().enumerate() {
        let (info, dir) = (dataset.info(), dataset.dir().display());
        ensure!(
            !info.no_sound,
            "{dir} was imported without audio, but training needs speech; import it with its audio files"
        );
        let earlier = datasets[..n].iter().find(|other| other.info().speaker == info.speaker);
        if let Some(other) = earlier {
            bail!(
                "{} and {dir} are both of speaker {}; give one dataset per speaker",
                other.dir().display(),
                info.speaker
            );
        }
    }
    Ok(())
}

/// Normalisation fitted to the training split of a dataset, including these posture channels.
pub fn normalisation_with_channels(dataset: &Dataset, wanted: &[PostureChannel]) -> Result<Normalisation> {
    Ok(Normalisation { channels: channels(dataset, wanted)?, ..normalisation(dataset)? })
}

/// Frames read at a time for statistics of all poses.
const PART_FRAMES: usize = 4096;

/// Metadata of one speaker of a new training with `n_speakers` speakers.
pub fn metadata(
    dataset: &Dataset,
    normal: &Normalisation,
    loader: &WindowLoader,
    settings: &GanSettings,
    n_speakers: usize,
) -> Result<SpeakerMetadata> {
    let representation = match settings.representation {
        MotionRepresentation::Positions => Representation::Positions,
        MotionRepresentation::Auto | MotionRepresentation::Bones => {
            Representation::bones(normal, loader.poses(PART_FRAMES))?
        }
    };
    let network = network(settings.preset, normal.n_features());
    let several = n_speakers > 1;
    let (info, hash) = (dataset.info(), dataset.hash()?);
    let (n_speakers, look_ahead) = (if several { n_speakers } else { 0 }, look_ahead(settings, info.fps));
    let network = Config { n_speakers, speaker_weights: several, look_ahead, ..network };
    let mut metadata = SpeakerMetadata::new(&info.speaker, info.fps, &hash, network, normal.clone(), representation);
    metadata.add_videos(pretrained::videos(dataset));
    Ok(metadata)
}

/// Updates the metadata of a speaker from a resumed checkpoint for the current dataset; adds a message to `differences`
/// if the dataset has changed.
///
/// # Errors
/// A dataset of another speaker or frame rate.
pub fn resume(metadata: &mut SpeakerMetadata, dataset: &Dataset, differences: &mut Vec<String>) -> Result<()> {
    let info = dataset.info();
    ensure!(
        metadata.name == info.speaker && metadata.fps == info.fps,
        "it is a model of {} at {}, the dataset is of {} at {}; choose another --out",
        metadata.name,
        metadata.fps,
        info.speaker,
        info.fps
    );
    let hash = dataset.hash()?;
    if metadata.dataset != hash {
        differences.push(
            "the dataset has changed: training continues on it with the mean, deviation and bone lengths of the checkpoint"
                .to_owned(),
        );
        metadata.dataset = hash;
        metadata.add_videos(pretrained::videos(dataset));
    }
    Ok(())
}

/// Network with `n_out` outputs for a preset of the configuration. `Small` is `Light` with half the channels.
pub fn network(preset: NetworkPreset, n_out: usize) -> Config {
    let light = Config::from_preset(Preset::Light, n_out);
    match preset {
        NetworkPreset::Auto | NetworkPreset::Light => light,
        NetworkPreset::Small => Config { width: light.width / 2, ..light },
        NetworkPreset::Paper => Config::from_preset(Preset::Paper, n_out),
    }
}

/// View of the future of a network with these settings; `None`: the complete speech.
pub fn look_ahead(settings: &GanSettings, fps: FrameRate) -> Option<LookAhead> {
    let Config { preset, .. } = network(settings.preset, 0);
    let secs = settings.look_ahead_secs;
    (secs > 0.0).then(|| live::look_ahead(preset, secs, fps))
}

fn channels(dataset: &Dataset, wanted: &[PostureChannel]) -> Result<Vec<ChannelNormalisation>> {
    let posture = dataset.stats().posture.as_ref();
    let of = |channel: PostureChannel| -> Result<ChannelNormalisation> {
        let stats = posture.and_then(|posture| posture.get(&channel)).filter(|stats| stats.n_visible != [0; 3]);
        let stats = stats.with_context(|| {
            let (name, dir) = (channel.name(), dataset.dir().display());
            format!(
                "gan.channels has \"{name}\", which is not visible in any training frame of {dir}: set posture = true under \
                 [dataset] and build the dataset again, or remove it from gan.channels"
            )
        })?;
        Ok(ChannelNormalisation::new(channel, stats.n_visible, stats.mean, stats.std))
    };
    PostureChannel::ALL.into_iter().filter(|channel| wanted.contains(channel)).map(of).collect()
}

/// Normalisation of the joints fitted to the training split. Bone lengths come from the metadata of the dataset, or are
/// measured on the longest training interval if the metadata has none.
pub fn normalisation(dataset: &Dataset) -> Result<Normalisation> {
    let stated = &dataset.info().bone_lengths_metres;
    let mut lengths: Vec<f32> = (0..N_BONES).map(|bone| stated.get(bone).map_or(0.0, |v| *v as f32)).collect();
    if lengths.iter().all(|length| *length == 0.0) {
        let longest = dataset.samples(Split::Train).into_iter().max_by_key(|sample| sample.n_frames);
        let longest = longest.context("the training split of the dataset is empty")?;
        lengths = bones::measure(&dataset.read(&longest)?.motion).to_vec();
    }
    Ok(Normalisation::new(&dataset.stats().mean(), &dataset.stats().std(), lengths))
}
