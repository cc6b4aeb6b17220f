//! Demo folder: videos of the synthetic speaker, their ground truth, the marker models, and a configuration for
//! `orator run`.

use super::scene::DrawnScene;
use super::truth::DrawnTruth;
use anyhow::ensure;
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::types::time::FrameRate;
use orator_formats::wav;
use std::path::{Path, PathBuf};

/// Frame rate of the dataset and of the ground truth.
pub const DATASET_FPS: FrameRate = FrameRate::new(15, 1);
/// Duration of the speech without video, for `orator generate`, seconds.
pub const SPEECH_ONLY_SECS: f64 = 10.0;

const MODELS: [(&str, &[u8]); 3] = [
    ("marker_person.onnx", include_bytes!("../../../models/marker_person.onnx")),
    ("marker_body.onnx", include_bytes!("../../../models/marker_body.onnx")),
    ("marker_hand.onnx", include_bytes!("../../../models/marker_hand.onnx")),
];

/// Configuration template of a demo; `TITLE`, `SPLITS`, `SOURCE` and `MODELS` are replaced.
const PIPELINE: &str = r#"# TITLE
[[speaker]]
name = "host"
videos = ["videos/host/*.mp4"]
SPLITS
licence = "cc0-1.0"
consent = "none needed: nobody is shown"
source = "SOURCE"

MODELS[segment]
speech = "loudness"                # the speech consists of tones, which the speech model does not classify as speech

[gan]
preset = "small"                   # a few minutes of processor time; "auto" is better from ten minutes of speech on
steps = 800
"#;

const MARKER_MODELS: &str = r#"[pose2d]
person = "person-marker"
body = "body-marker"
hand = "hand-marker"
palm = ""
face = ""                          # the figure has no face

"#;

/// Configuration of a demo with `n_videos` videos: a title, the origin of the videos, and the section of its models.
pub fn pipeline(title: &str, source: &str, models: &str, n_videos: usize) -> String {
    let filled = PIPELINE.replace("TITLE", title).replace("SOURCE", source).replace("MODELS", models);
    filled.replace("SPLITS", &splits(n_videos))
}

/// Contents of a demo folder.
#[derive(Clone, Debug)]
pub struct DemoPlan {
    pub n_videos: usize,
    /// Duration of each video, seconds.
    pub secs: f64,
    /// Frame rate of the videos.
    pub fps: FrameRate,
    /// Width and height in px, both even.
    pub size: [usize; 2],
    pub seed: u64,
}

impl Default for DemoPlan {
    fn default() -> Self {
        Self { n_videos: 4, secs: 30.0, fps: FrameRate::new(30, 1), size: [960, 720], seed: 1 }
    }
}

impl DemoPlan {
    /// Longest duration of a video, seconds.
    pub const MAX_SECS: f64 = 3600.0;

    /// Checks the ranges of the values.
    ///
    /// # Errors
    /// A number of videos outside 1..=1000 or a duration outside 1..=3600 s.
    pub fn check(&self) -> anyhow::Result<()> {
        ensure!((1..=1000).contains(&self.n_videos), "invalid --videos {}: expected 1 to 1000", self.n_videos);
        ensure!((1.0..=Self::MAX_SECS).contains(&self.secs), "invalid --secs {}: expected 1 to 3600", self.secs);
        Ok(())
    }
}

/// Writes `videos/host/clip-<n>.mp4`, `truth/clip-<n>.npz`, `speech.wav`, `models/` and `pipeline.toml` into `dir`;
/// returns the videos.
pub fn draw(dir: &Path, plan: &DemoPlan, progress: &dyn Progress) -> anyhow::Result<Vec<PathBuf>> {
    plan.check()?;
    for (name, bytes) in MODELS {
        workdir::write_file(&dir.join("models").join(name), bytes)?;
    }
    let mut videos = Vec::new();
    for number in 1..=plan.n_videos {
        let scene = DrawnScene::new(plan.seed.wrapping_mul(1000).wrapping_add(number as u64), plan.secs, plan.size);
        let video = dir.join(format!("videos/host/clip-{number}.mp4"));
        workdir::replace(&video, |attempt| scene.film(attempt, plan.fps, progress))?;
        DrawnTruth::new(&scene, DATASET_FPS).write(&dir.join(format!("truth/clip-{number}.npz")))?;
        videos.push(video);
    }
    let speech_only = DrawnScene::new(plan.seed.wrapping_mul(1000), SPEECH_ONLY_SECS, plan.size).sound();
    workdir::replace(&dir.join("speech.wav"), |attempt| wav::write(attempt, &speech_only))?;
    let title = "The synthetic speaker of `orator-lab demo`: the marker models detect its suit only, no real people.";
    let pipeline = pipeline(title, "drawn by orator demo", MARKER_MODELS, plan.n_videos);
    workdir::write_file(&dir.join("pipeline.toml"), pipeline.as_bytes())?;
    Ok(videos)
}

/// Configuration lines for the splits: the last videos are the test split (a third of few videos, a sixth of many), a
/// tenth before them, at least one, is the validation split; fewer than three are all training.
fn splits(n_videos: usize) -> String {
    if n_videos < 3 {
        return "train = [\"*.mp4\"]".to_owned();
    }
    let list = |numbers: std::ops::RangeInclusive<usize>| {
        numbers.map(|number| format!("\"clip-{number}.mp4\"")).collect::<Vec<_>>().join(", ")
    };
    let first_test = n_videos - (n_videos / 3).min((n_videos / 6).max(2)) + 1;
    let first_validation = first_test - (n_videos / 10).max(1);
    let (train, validation, test) =
        (list(1..=first_validation - 1), list(first_validation..=first_test - 1), list(first_test..=n_videos));
    format!("train = [{train}]\nvalidation = [{validation}]\ntest = [{test}]")
}
