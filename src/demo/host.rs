//! Demo folder of a rendered person for the models that know real people: videos, their truth, speech without a video,
//! and a configuration for `orator run`.

use super::drawn::folder::{DemoPlan, UNHEARD_SECS, pipeline};
use super::people::condition::Condition;
use super::people::scene::{ClipSeeds, PeopleScene};
use super::people::voice::Voice;
use crate::formats::wav;
use crate::stage::progress::Progress;
use crate::stage::workdir;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};

/// Writes `videos/host/clip-<n>.mp4`, `truth/clip-<n>.npz`, `speech.wav` and `pipeline.toml` into `dir`; returns the
/// videos. Body, clothes, voice, room and camera are the same in all videos, speech and gestures are not.
pub fn draw(dir: &Path, plan: &DemoPlan, progress: &dyn Progress) -> Result<Vec<PathBuf>> {
    plan.check()?;
    let seed = plan.seed.wrapping_mul(1000);
    let mut videos = Vec::new();
    for number in 1..=plan.n_videos as u64 {
        let motion = seed.wrapping_add(number);
        let seeds = ClipSeeds { body: seed, clothes: seed, camera: seed, motion, voice: Some(seed) };
        let scene = PeopleScene::new(Condition::Front, seeds, plan.secs, plan.fps, None);
        let video = dir.join(format!("videos/host/clip-{number}.mp4"));
        let mut truth = None;
        workdir::replace(&video, |attempt| {
            truth = Some(scene.film(attempt, progress)?);
            Ok(())
        })?;
        truth.context("a rendered clip has no truth")?.write(&dir.join(format!("truth/clip-{number}.npz")))?;
        videos.push(video);
    }
    let unheard = Voice::new(seed, UNHEARD_SECS, Some(seed)).sound;
    workdir::replace(&dir.join("speech.wav"), |attempt| wav::write(attempt, &unheard))?;
    let title = "The rendered speaker of `orator demo`, seen by the models for real people (`orator models fetch`).";
    let pipeline = pipeline(title, "rendered by orator demo", "", plan.n_videos);
    workdir::write_file(&dir.join("pipeline.toml"), pipeline.as_bytes())?;
    Ok(videos)
}
