//! A stage that works on videos in one way and on keypoints of other programs in another.

use super::stage::{KeypointExtractStage, KeypointPose2dStage};
use crate::config::Settings;
use crate::config::videos::Videos;
use crate::stage::progress::Progress;
use crate::stage::{Input, Report, Stage, Unit};
use anyhow::Result;
use std::collections::BTreeSet;
use std::path::Path;

/// Both ways of a stage, and the units that are keypoints.
pub struct StageBySource {
    of_videos: Box<dyn Stage>,
    of_keypoints: Box<dyn Stage>,
    keypoints: BTreeSet<(String, String)>,
}

impl StageBySource {
    /// The stage `extract`.
    pub fn extract(of_videos: Box<dyn Stage>, settings: &Settings, all: &[Videos]) -> Box<dyn Stage> {
        let of_keypoints = KeypointExtractStage::new(&settings.extract, all);
        Self::both(of_videos, Box::new(of_keypoints), all)
    }

    /// The stage `pose2d`.
    pub fn pose2d(of_videos: Box<dyn Stage>, settings: &Settings, all: &[Videos]) -> Box<dyn Stage> {
        Self::both(of_videos, Box::new(KeypointPose2dStage::new(&settings.work.dir)), all)
    }

    /// The way of videos alone where there are no keypoints.
    fn both(of_videos: Box<dyn Stage>, of_keypoints: Box<dyn Stage>, all: &[Videos]) -> Box<dyn Stage> {
        let names = |videos: &Videos| {
            videos.keypoints.keys().map(|video| (videos.speaker.clone(), video.clone())).collect::<Vec<_>>()
        };
        let keypoints: BTreeSet<(String, String)> = all.iter().flat_map(names).collect();
        if keypoints.is_empty() { of_videos } else { Box::new(Self { of_videos, of_keypoints, keypoints }) }
    }

    fn of(&self, unit: &Unit) -> &dyn Stage {
        let is_keypoints = self.keypoints.contains(&(unit.speaker.clone(), unit.video.clone()));
        if is_keypoints { &*self.of_keypoints } else { &*self.of_videos }
    }
}

impl Stage for StageBySource {
    fn name(&self) -> &'static str {
        self.of_videos.name()
    }

    /// Of the way of videos; that of keypoints has its own in the settings.
    fn version(&self) -> u32 {
        self.of_videos.version()
    }

    fn cost(&self) -> u32 {
        self.of_videos.cost()
    }

    fn settings(&self, unit: &Unit) -> serde_json::Value {
        self.of(unit).settings(unit)
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        self.of(unit).inputs(unit)
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        self.of(unit).run(unit, out, progress)
    }
}
