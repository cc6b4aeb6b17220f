//! A training that begins with another speaker's model: the network's weights are taken over, normalisation and skeleton
//! are the new speaker's.

use super::recipe::settings::GanSettings;
use super::step::GanTrainer;
use crate::dataset::Dataset;
use crate::formats::checkpoint;
use crate::formats::checkpoint::Contents;
use crate::generate::model::{BEST, GENERATOR, SpeakerMetadata, TrainedVideo};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};

/// Model that a training begins with.
pub struct StartingModel {
    path: PathBuf,
    speaker: SpeakerMetadata,
    contents: Contents,
}

impl StartingModel {
    /// Reads a checkpoint of `orator train gan`, or of its folder the best one, else the newest. Errors name the file.
    pub fn read(path: &Path) -> Result<Self> {
        let path = if path.is_dir() { in_folder(path)? } else { path.to_owned() };
        let contents = Contents::read(&path)?;
        let speaker = serde_json::from_value(contents.facts["speaker"].clone());
        let speaker = speaker.with_context(|| format!("{} is no checkpoint of `orator train gan`", path.display()))?;
        Ok(Self { path, speaker, contents })
    }

    /// The file and its speaker.
    pub fn account(&self) -> String {
        format!("what {} learnt of {}", self.path.display(), self.speaker.name)
    }

    /// A trainer of the speaker that `metadata` describes, with the weights of this model and its videos in the list.
    ///
    /// # Errors
    /// Networks of another shape.
    pub fn begin(&self, mut metadata: SpeakerMetadata, settings: GanSettings) -> Result<GanTrainer> {
        let (own, other) = (&metadata.network, &self.speaker.network);
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
        metadata.videos.extend(self.speaker.videos.iter().cloned());
        metadata.videos.sort();
        metadata.videos.dedup();
        let trainer = GanTrainer::new(metadata, settings)?;
        trainer
            .begin_with(&self.contents.part(GENERATOR), &self.contents)
            .with_context(|| format!("cannot begin with {}", self.path.display()))?;
        Ok(trainer)
    }
}

fn in_folder(folder: &Path) -> Result<PathBuf> {
    let best = folder.join(BEST);
    if best.is_file() {
        return Ok(best);
    }
    match checkpoint::list(folder)?.pop() {
        Some((_, newest)) => Ok(newest),
        None => bail!("there is no checkpoint in {}; `orator train gan` writes one", folder.display()),
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
