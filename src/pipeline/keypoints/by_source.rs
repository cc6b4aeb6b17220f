//! A stage that works on videos in one way and on keypoints of other programs in another.

use super::stage::{KeypointExtractStage, KeypointPose2dStage};
use orator_base::stage::{Stage, StageWrapper, Unit};
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use std::collections::BTreeSet;

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
}

impl StageWrapper for StageBySource {
    /// Version and cost are those of the way of videos; that of keypoints has its own version in the settings.
    fn inner(&self, unit: Option<&Unit>) -> &dyn Stage {
        let is_keypoints =
            unit.is_some_and(|unit| self.keypoints.contains(&(unit.speaker.clone(), unit.video.clone())));
        if is_keypoints { &*self.of_keypoints } else { &*self.of_videos }
    }
}
