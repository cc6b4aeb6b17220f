//! Demo folder of a rendered person for the models trained on real persons: videos, their ground truth, speech without
//! a video, and a configuration for `orator run`.

use super::people::condition::Condition;
use super::people::scene::{CapturedClip, ClipSeeds, PersonScene};
use anyhow::{Context, Result};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::types::time::FrameRate;
use orator_formats::wav;
use orator_test_support::drawn::folder::{DemoPlan, SPEECH_ONLY_SECS, pipeline};
use orator_test_support::drawn::speech::Speech;
use orator_test_support::rule::rule::RuleGestures;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};

/// A clip of the host: the speech of a seed, with the gestures that follow from it by the rule, and random variation.
pub fn scene(body: u64, seed: u64, secs: f64, fps: FrameRate) -> PersonScene {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let speech = Speech::free(secs, &mut rng);
    let motion = RuleGestures::with_variation(&speech, &[], secs, &mut rng).motion(fps.frames_in(secs), fps);
    let clip = CapturedClip { motion, sound: Some(speech.sound(secs, &mut rng)), trunk: Vec::new() };
    let seeds = ClipSeeds { body, clothes: body, camera: body, motion: seed, voice: None };
    PersonScene::new(Condition::Front, seeds, secs, fps, Some(&clip))
}

/// Writes `videos/host/clip-<n>.mp4`, `truth/clip-<n>.npz`, `speech.wav` and `pipeline.toml` into `dir`; returns the
/// videos. Body, clothes, voice, room and camera are equal in all videos; speech differs, and gestures follow from it
/// by a known rule.
///
/// # Errors
/// An invalid plan; a failure to render or to write.
pub fn draw(dir: &Path, plan: &DemoPlan, progress: &dyn Progress) -> Result<Vec<PathBuf>> {
    plan.check()?;
    let seed = plan.seed.wrapping_mul(1000);
    let mut videos = Vec::new();
    for number in 1..=plan.n_videos as u64 {
        let scene = scene(seed, seed.wrapping_add(number), plan.secs, plan.fps);
        let video = dir.join(format!("videos/host/clip-{number}.mp4"));
        let mut truth = None;
        workdir::replace(&video, |attempt| {
            truth = Some(scene.film(attempt, progress)?);
            Ok(())
        })?;
        truth.context("the rendered clip has no ground truth")?.write(&dir.join(format!("truth/clip-{number}.npz")))?;
        videos.push(video);
    }
    let speech_only = scene(seed, seed, SPEECH_ONLY_SECS, plan.fps);
    workdir::replace(&dir.join("speech.wav"), |attempt| wav::write(attempt, speech_only.sound()))?;
    let title =
        "The rendered speaker of `orator-lab demo`, for the pose models for real people (`orator models fetch`).";
    let pipeline = pipeline(title, "rendered by orator demo", "", plan.n_videos);
    workdir::write_file(&dir.join("pipeline.toml"), pipeline.as_bytes())?;
    Ok(videos)
}
