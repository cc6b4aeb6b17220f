//! A training that begins with another speaker's model: the network's weights are taken over, normalisation and skeleton
//! are the new speaker's.

use super::recipe::settings::GanSettings;
use super::step::GanTrainer;
use crate::dataset::Dataset;
use crate::formats::checkpoint;
use crate::formats::checkpoint::Contents;
use crate::generate::model::{self, BEST, SpeakerMetadata, TrainedVideo};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};

/// Model that a training begins with.
pub struct StartingModel {
    path: PathBuf,
    speakers: Vec<SpeakerMetadata>,
    contents: Contents,
}

impl StartingModel {
    /// Reads a checkpoint of `orator train gan`, or of its folder the best one, else the newest. Errors name the file.
    pub fn read(path: &Path) -> Result<Self> {
        let path = if path.is_dir() { in_folder(path)? } else { path.to_owned() };
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

    /// A trainer of these speakers, with the weights of this model and its videos in their lists.
    ///
    /// # Errors
    /// Networks of another shape.
    pub fn begin(&self, mut speakers: Vec<SpeakerMetadata>, settings: GanSettings) -> Result<GanTrainer> {
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
        let trainer = GanTrainer::new(speakers, settings)?;
        trainer.begin_with(&self.contents).with_context(|| format!("cannot begin with {}", self.path.display()))?;
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
