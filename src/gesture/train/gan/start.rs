//! A training that begins with another speaker's model: the network's weights are taken over, normalisation and skeleton
//! are the new speaker's.

use super::recipe::TrainingStart;
use super::step::GanTrainer;
use super::windows::JoinedWindows;
use crate::generate::model::{self, GENERATOR, SpeakerMetadata, TrainedVideo, checkpoint_file};
use anyhow::{Context, Result, bail, ensure};
use candle_core::Tensor;
use orator_dataset::Dataset;
use orator_dataset::config::GanSettings;
use orator_nn::gan::generator::Config;
use orator_nn::gan::speaker_layer::SPEAKER;
use orator_nn::weights::Contents;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Windows by which the layer of a new speaker is chosen, at most.
const NEAREST_WINDOWS: usize = 128;

/// Model that a training begins with.
pub struct StartingModel {
    path: PathBuf,
    speakers: Vec<SpeakerMetadata>,
    contents: Contents,
}

impl StartingModel {
    /// Reads a checkpoint of `orator train gan`, or of its folder the best one, else the newest. Errors name the file.
    pub fn read(path: &Path) -> Result<Self> {
        let path = checkpoint_file(path)?;
        let contents = Contents::read(&path)?;
        let speakers = model::speakers(&contents.facts);
        let speakers =
            speakers.with_context(|| format!("{} is no checkpoint of `orator train gan`", path.display()))?;
        Ok(Self { path, speakers, contents })
    }

    /// The file and its speakers.
    pub fn account(&self) -> String {
        let names: Vec<&str> = self.speakers.iter().map(|speaker| speaker.name.as_str()).collect();
        format!("what {} learnt of {}", self.path.display(), names.join(", "))
    }

    /// What this model is for a training of so many speakers.
    pub fn kind(&self, n_speakers: usize) -> TrainingStart {
        if n_speakers == 1 && self.speakers.iter().any(|speaker| speaker.network.speaker_weights) {
            TrainingStart::SeveralSpeakers
        } else {
            TrainingStart::AnotherSpeaker
        }
    }

    /// A trainer of these speakers, with the weights of this model and its videos in their lists. One speaker who begins with a
    /// model of several gets the layer of the one by whose its first error on `windows` is least, or the mean of all.
    ///
    /// # Errors
    /// Networks of another shape.
    pub fn begin(
        &self,
        mut speakers: Vec<SpeakerMetadata>,
        settings: GanSettings,
        windows: &JoinedWindows,
    ) -> Result<GanTrainer> {
        let (Some(own), Some(other)) = (speakers.first(), self.speakers.first()) else { bail!("there is no speaker") };
        let (own, other) = (&own.network, &other.network);
        ensure!(
            own.preset == other.preset && own.width == other.width && own.n_out == other.n_out,
            "{} is a network of preset {:?}, width {} and {} numbers a pose, the training's one of preset {:?}, width {} and \
             {}: set gan.preset and gan.channels as it had them",
            self.path.display(),
            other.preset,
            other.width,
            other.n_out,
            own.preset,
            own.width,
            own.n_out
        );
        let earlier = self.speakers.iter().flat_map(|speaker| speaker.videos.iter().cloned());
        let earlier: Vec<TrainedVideo> = earlier.collect();
        speakers.iter_mut().for_each(|speaker| speaker.add_videos(earlier.clone()));
        let mut layers = self.contents.part(GENERATOR);
        layers.retain(|name, _| name.starts_with(SPEAKER));
        let begins_with_several = speakers.len() == 1 && !layers.is_empty();
        if begins_with_several {
            let speaker_weights = self.speakers[0].network.speaker_weights;
            speakers[0].network = Config { n_speakers: 1, speaker_weights, ..speakers[0].network.clone() };
        }
        let trainer = GanTrainer::new(speakers, settings)?;
        let begin = || {
            if begins_with_several {
                self.begin_as_the_nearest(&trainer, &layers, windows)
            } else {
                trainer.begin_with(&self.contents, None)
            }
        };
        begin().with_context(|| format!("cannot begin with {}", self.path.display()))?;
        Ok(trainer)
    }

    /// Takes over the weights with the layer of least error, of those of all speakers (tensors with a row each) and their mean.
    fn begin_as_the_nearest(
        &self,
        trainer: &GanTrainer,
        layers: &BTreeMap<String, Tensor>,
        windows: &JoinedWindows,
    ) -> Result<()> {
        let layer = |of: &dyn Fn(&Tensor) -> candle_core::Result<Tensor>| -> Result<BTreeMap<String, Tensor>> {
            layers.iter().map(|(name, table)| Ok((name.clone(), of(table)?))).collect()
        };
        let rows = (0..self.speakers.len()).map(|row| layer(&|table| table.narrow(0, row, 1)));
        let candidates = rows.chain(std::iter::once_with(|| layer(&|table| table.mean_keepdim(0))));
        let n = windows.len();
        let which: Vec<usize> = (0..n.min(NEAREST_WINDOWS)).map(|i| i * n / n.min(NEAREST_WINDOWS)).collect();
        let batch = windows.batch_changed(&which, &[])?;
        let mut least = None;
        for candidate in candidates {
            let candidate = candidate?;
            trainer.begin_with(&self.contents, Some(&candidate))?;
            let error = trainer.error(&batch)?;
            if least.as_ref().is_none_or(|(least, _)| error < *least) {
                least = Some((error, candidate));
            }
        }
        trainer.begin_with(&self.contents, least.as_ref().map(|(_, layer)| layer))
    }
}

/// Videos of a dataset, as checkpoints list them.
pub fn videos(dataset: &Dataset) -> Vec<TrainedVideo> {
    let info = dataset.info();
    let video = |content: &String| TrainedVideo { speaker: info.speaker.clone(), content: content.clone() };
    let mut videos: Vec<TrainedVideo> = info.videos.iter().map(|of| video(&of.content)).collect();
    videos.sort();
    videos.dedup();
    videos
}
