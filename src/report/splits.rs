//! Splits of the videos, from the datasets that were made of them.

use orator_base::stage::artifacts::{StageName, speaker_dir};
use orator_base::types::split::Split;
use orator_dataset::INFO;
use orator_dataset::config::Settings;
use orator_dataset::config::videos::Videos;
use orator_dataset::info::{DatasetInfo, DatasetVideo};
use std::collections::BTreeMap;

/// The splits of a video in words, by `speaker/video`.
pub type VideoSplits = BTreeMap<String, String>;

/// Splits of all videos that are in a dataset; a speaker without a dataset has none.
pub fn of_videos(settings: &Settings, videos: &[Videos]) -> VideoSplits {
    let mut splits = VideoSplits::new();
    for Videos { speaker, .. } in videos {
        // One file, which is whole also while a run replaces the dataset.
        let info = std::fs::read(speaker_dir(&settings.work.dir, StageName::Dataset, speaker).join(INFO));
        let info: Option<DatasetInfo> = info.ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let named = info.iter().flat_map(|info| &info.videos).filter(|video| video.samples > 0);
        splits.extend(named.map(|video| (format!("{speaker}/{}", video.name), in_words(video))));
    }
    splits
}

/// Its split, or those of its blocks of time.
fn in_words(video: &DatasetVideo) -> String {
    let has =
        |split: &Split| video.split == Some(*split) || video.blocks.iter().any(|block| block.split == Some(*split));
    Split::ALL.into_iter().filter(has).map(Split::name).collect::<Vec<_>>().join(", ")
}
