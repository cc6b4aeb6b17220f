//! Metadata of the speakers before the first step, from the statistics of their datasets or from a resumed checkpoint.

use super::pretrained;
use super::windows::WindowLoader;
use crate::generate::model::SpeakerMetadata;
use crate::generate::normalisation::{ChannelNormalisation, Normalisation};
use crate::generate::representation::Representation;
use anyhow::{Context, Result, bail, ensure};
use orator_base::motion::bones;
use orator_base::types::posture::PostureChannel;
use orator_base::types::skeleton::N_BONES;
use orator_dataset::config::{GanSettings, MotionRepresentation, NetworkPreset};
use orator_dataset::{Dataset, Split};
use orator_nn::gan::generator::{Config, Preset};

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
    let network = Config::from_preset(preset(settings.preset), normal.n_features());
    let several = n_speakers > 1;
    let network = Config { n_speakers: if several { n_speakers } else { 0 }, speaker_weights: several, ..network };
    let (info, hash) = (dataset.info(), dataset.hash()?);
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

/// Network preset for a preset of the configuration.
pub const fn preset(preset: NetworkPreset) -> Preset {
    match preset {
        NetworkPreset::Auto | NetworkPreset::Light => Preset::Light,
        NetworkPreset::Paper => Preset::Paper,
    }
}

/// Normalisation of the posture channels that are to be trained.
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
