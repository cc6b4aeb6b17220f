//! How the pictures of a run's videos are to be read, for whoever shows them beside what was found in them.

use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::types::image::PictureOptions;
use orator_formats::media_json::MediaInfo;
use std::path::Path;

/// How `extract` found that the pictures of `unit` are to be read; as they are where it has not run.
pub fn options(work: &Path, unit: &Unit) -> PictureOptions {
    MediaInfo::read(&Artifact::MediaInfo.path(work, unit))
        .map_or_else(|_| PictureOptions::default(), |media| media.pictures)
}
