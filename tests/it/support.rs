//! Input that the project makes itself, for tests of more than one room.

use orator::demo::folder::{self, Plan};
use orator::stage::progress::Silent;
use orator::types::time::FrameRate;
use std::path::{Path, PathBuf};

/// Draws one clip of the synthetic speaker, 640x480 at 15 frames a second with sound, and all that `orator demo draw`
/// puts beside it (truth, marker models, pipeline.toml), into `dir`; gives the video. About 0.2 s a second of clip.
pub fn speaker_clip(dir: &Path, secs: f64, seed: u64) -> PathBuf {
    let plan = Plan { n_videos: 1, secs, fps: FrameRate::new(15, 1), size: [640, 480], seed };
    folder::draw(dir, &plan, &Silent).unwrap().remove(0)
}
