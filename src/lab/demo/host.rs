//! Demo folder of a rendered person for the models trained on real persons: videos, their ground truth, speech without
//! a video, and a configuration for `orator run`.

use super::check::pipeline::origin;
use super::people::condition::Condition;
use super::people::scene::{CapturedClip, ClipSeeds, PersonScene};
use anyhow::{Context, Result, ensure};
use ndarray::{Array3, s};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::types::time::FrameRate;
use orator_dataset::Sample;
use orator_formats::wav;
use orator_test_support::drawn::folder::{DemoPlan, SPEECH_ONLY_SECS, pipeline};
use orator_test_support::drawn::speech::Speech;
use orator_test_support::rule::rule::RuleGestures;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Speech of a clip of the host: phrases of `secs` seconds from a seed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HostSpeech {
    pub seed: u64,
    pub secs: f64,
}

impl HostSpeech {
    /// Phrases of the speech, and the random generator of what else varies in the clip.
    fn phrases(&self) -> (Speech, ChaCha8Rng) {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        (Speech::free(self.secs, &mut rng), rng)
    }

    /// Rendered clip: the gestures follow from the speech by the rule, with random variation.
    pub fn scene(&self, body: u64, fps: FrameRate) -> PersonScene {
        let Self { seed, secs } = *self;
        let (speech, mut rng) = self.phrases();
        let motion = RuleGestures::with_variation(&speech, &[], secs, &mut rng).motion(fps.frames_in(secs), fps);
        let clip = CapturedClip { motion, sound: Some(speech.sound(secs, &mut rng)), trunk: Vec::new() };
        let seeds = ClipSeeds { body, clothes: body, camera: body, motion: seed, voice: None };
        PersonScene::new(Condition::Front, seeds, secs, fps, Some(&clip))
    }
}

/// Joints [T, 49, 3] by the rule without variation for a sample of the demo's dataset, metres, in the axes of the body;
/// `truth` is the folder `truth` of the demo.
///
/// # Errors
/// A sample that is not of a video of the demo; a clip whose file in `truth` is missing or invalid.
pub fn predictable(truth: &Path, sample: &Sample) -> Result<Array3<f32>> {
    let (video, first) = origin(&sample.key)?;
    let path = truth.join(format!("{video}.json"));
    let invalid = || format!("cannot read {}: expected the file of `orator-lab demo draw --rendered`", path.display());
    let speech: HostSpeech =
        serde_json::from_slice(&std::fs::read(&path).with_context(invalid)?).with_context(invalid)?;
    let (fps, end) = (sample.motion.fps, first.saturating_add(sample.n_frames()));
    ensure!(
        speech.secs <= DemoPlan::MAX_SECS && end <= fps.frames_in(speech.secs),
        "{}: the speech has {} s, the sample {} ends at {} s",
        path.display(),
        speech.secs,
        sample.key,
        fps.secs(end)
    );
    let motion = RuleGestures::new(&speech.phrases().0, &[]).motion(end, fps);
    Ok(motion.joints.slice_move(s![first.., .., ..]))
}

/// Writes `videos/host/clip-<n>.mp4`, `truth/clip-<n>.npz` and `.json` (the speech), `speech.wav` and `pipeline.toml`
/// into `dir`; returns the videos. Body, clothes, voice, room and camera are equal in all videos; speech differs, and
/// gestures follow from it by a known rule.
///
/// # Errors
/// An invalid plan; a failure to render or to write.
pub fn draw(dir: &Path, plan: &DemoPlan, progress: &dyn Progress) -> Result<Vec<PathBuf>> {
    plan.check()?;
    let seed = plan.seed.wrapping_mul(1000);
    let mut videos = Vec::new();
    let task = progress.begin("render videos", plan.n_videos as u64);
    for number in 1..=plan.n_videos as u64 {
        let speech = HostSpeech { seed: seed.wrapping_add(number), secs: plan.secs };
        let scene = speech.scene(seed, plan.fps);
        let video = dir.join(format!("videos/host/clip-{number}.mp4"));
        let mut truth = None;
        workdir::replace(&video, |attempt| {
            truth = Some(scene.film(attempt, progress)?);
            Ok(())
        })?;
        truth.context("the rendered clip has no ground truth")?.write(&dir.join(format!("truth/clip-{number}.npz")))?;
        workdir::write_file(&dir.join(format!("truth/clip-{number}.json")), &serde_json::to_vec(&speech)?)?;
        videos.push(video);
        task.advance(1);
        task.milestone(&format!("rendered clip-{number}.mp4, {number} of {}", plan.n_videos));
    }
    let speech_only = HostSpeech { seed, secs: SPEECH_ONLY_SECS }.scene(seed, plan.fps);
    workdir::replace(&dir.join("speech.wav"), |attempt| wav::write(attempt, speech_only.sound()))?;
    let title =
        "The rendered speaker of `orator-lab demo`, for the pose models for real people (`orator models fetch`).";
    let pipeline = pipeline(title, "rendered by orator demo", "", plan.n_videos);
    workdir::write_file(&dir.join("pipeline.toml"), pipeline.as_bytes())?;
    Ok(videos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::types::pose3d::Motion;
    use orator_base::types::sound::Sound;
    use orator_test_support::drawn::folder::DATASET_FPS;
    use orator_test_support::rule::ridge::correlation;
    use orator_test_support::rule::rule::wrist_speeds;
    use serde_json::json;

    /// The predictable part of a sample begins at its frame of the video, and most of the motion follows it.
    #[test]
    fn the_rule_of_a_sample_is_that_of_its_frames() {
        let dir = tempfile::tempdir().unwrap();
        let speech = HostSpeech { seed: 1003, secs: 40.0 };
        std::fs::write(dir.path().join("clip-3.json"), serde_json::to_vec(&speech).unwrap()).unwrap();
        let truth = speech.scene(1000, DATASET_FPS).truth_without_pictures().joints;
        let sample = |key: &str, first: usize| Sample {
            key: key.to_owned(),
            motion: Motion::from_joints(DATASET_FPS, truth.slice(s![first.., .., ..]).to_owned()),
            pose2d: Array3::zeros((0, 0, 0)),
            sound: Sound { rate: 16_000, samples: Vec::new() },
            words: None,
            posture: None,
            interlocutor: None,
            meta: json!({}),
        };
        for first in [0, 90] {
            let sample = sample(&format!("clip-3-0123abcd-{first:06}"), first);
            let rule = predictable(dir.path(), &sample).unwrap();
            assert_eq!(rule.dim(), sample.motion.joints.dim());
            let speeds = [&rule, &sample.motion.joints].map(|joints| wrist_speeds(joints.view(), DATASET_FPS));
            let [left, right] = [0, 1].map(|hand| correlation(speeds[0].column(hand), speeds[1].column(hand)));
            assert!(left > 0.3 && right > 0.3, "{first}: {left} {right}");
        }
        for (key, part) in [("clip", "`clip`"), ("clip-4-0123abcd-000000", "clip-4.json")] {
            let error = format!("{:#}", predictable(dir.path(), &sample(key, 0)).unwrap_err());
            assert!(error.contains(part), "{error}");
        }
        let late = predictable(dir.path(), &sample("clip-3-0123abcd-000100", 0)).unwrap_err().to_string();
        assert!(late.contains("ends at"), "{late}");
    }
}
