//! Folder of rendered persons: videos by condition, their ground truth, a list of the clips, and a configuration for
//! `orator run` with the models for real persons.

use super::condition::Condition;
use super::scene::{CapturedClip, PersonScene};
use crate::demo::captured_body;
use crate::mocap::captured::source::{MotionSource, data_folder};
use crate::mocap::captured::take::CapturedTake;

pub use super::scene::ClipSeeds;
use crate::rendered_truth::LIST;
use anyhow::{Context, Result, bail, ensure};
use orator_base::motion::units;
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir;
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use orator_formats::mocap::motion_file;
use orator_media::ffmpeg::audio::read_sound;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Part of a set; the parts share no body, clothes, camera or motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SetPart {
    First,
    Middle,
    Last,
}

impl SetPart {
    /// All parts, in order.
    pub const ALL: [Self; 3] = [Self::First, Self::Middle, Self::Last];
}

/// A clip of a set; paths are relative to the set's folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PersonClip {
    pub video: PathBuf,
    pub truth: PathBuf,
    /// Name of the condition.
    pub condition: String,
    pub part: SetPart,
    pub seeds: ClipSeeds,
    /// Width and height, px.
    pub size: [usize; 2],
    pub focal_px: f64,
    /// Frame rate, frames/s, as a fraction.
    pub fps: [u32; 2],
    pub secs: f64,
    /// File or excerpt of the captured motion, if one was used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<PathBuf>,
    /// Name of the source of the motion, unless it is generated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Joints of captured motion that are generated, since the capture lacks them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub generated_joints: Vec<usize>,
}

/// Rendering plan.
#[derive(Clone, Debug)]
pub struct RenderPlan {
    pub conditions: Vec<Condition>,
    /// Number of clips per condition, a multiple of 3.
    pub n_clips: usize,
    pub secs: f64,
    pub fps: FrameRate,
    pub seed: u64,
    /// Sources of motion; every clip is rendered once with the motion of each.
    pub motions: Vec<MotionSource>,
    /// Write only the ground truth, without videos: training motion for the lifters.
    pub truth_only: bool,
}

const PIPELINE: &str = r#"# Rendered people of `orator-lab demo draw --people`: one speaker per condition.
[segment]
speech = "loudness"                # the speech consists of tones, which the speech model does not classify as speech
"#;

const SPEAKER: &str = r#"
[[speaker]]
name = "NAME"
videos = ["videos/NAME/*.mp4"]
SPLITS
licence = "cc0-1.0"
consent = "none needed: nobody is shown"
source = "rendered by orator demo"
"#;

/// Renders the clips of a plan into `dir`; returns their list.
///
/// # Errors
/// An invalid plan; captured motion that cannot be read; a failure to render or to write.
pub fn draw(dir: &Path, plan: &RenderPlan, progress: &dyn Progress) -> Result<Vec<PersonClip>> {
    let n = plan.n_clips;
    ensure!(n > 0 && n.is_multiple_of(3), "invalid --people {n}: expected a positive multiple of 3");
    ensure!((1.0..=600.0).contains(&plan.secs), "invalid --secs {}: expected 1 to 600", plan.secs);
    let (mut clips, mut configuration) = (Vec::new(), PIPELINE.to_owned());
    for source in &plan.motions {
        let motions = Motions::read(source, plan.secs)?;
        let is_plain = match source {
            MotionSource::Generated => true,
            MotionSource::Files(_) => plan.motions.len() == 1,
            _ => false,
        };
        for (order, &condition) in plan.conditions.iter().enumerate() {
            let prefix = if is_plain { String::new() } else { format!("{}-", source.name()) };
            let name = format!("{prefix}{}", condition.name());
            let mut files = [const { Vec::new() }; 3];
            for number in 0..n {
                let part = SetPart::ALL[3 * number / n];
                let place = ClipPlace { part, order, number, n_conditions: plan.conditions.len(), n };
                let Some(SourceMotion { captured, motion, generated_joints }) = motions.of_clip(place)? else {
                    continue;
                };
                let seeds = seeds(plan.seed, condition, number, part);
                let secs = captured.as_ref().map_or(plan.secs, |clip| plan.secs.min(secs_of(&clip.motion)));
                let scene = PersonScene::new(condition, seeds, secs, plan.fps, captured.as_ref());
                let stem = format!("{name}-{}", number + 1);
                let video = PathBuf::from(format!("videos/{name}/{stem}.mp4"));
                let truth = PathBuf::from(format!("truth/{name}/{stem}.npz"));
                let mut known = plan.truth_only.then(|| scene.truth_without_pictures());
                if !plan.truth_only {
                    workdir::replace(&dir.join(&video), |attempt| {
                        known = Some(scene.film(attempt, progress)?);
                        Ok(())
                    })?;
                }
                known.context("the rendered clip has no ground truth")?.write(&dir.join(&truth))?;
                files[3 * number / n].push(format!("\"{stem}.mp4\""));
                clips.push(PersonClip {
                    video,
                    truth,
                    condition: condition.name().to_owned(),
                    part,
                    seeds,
                    size: scene.camera.size,
                    focal_px: scene.camera.focal_px,
                    fps: [plan.fps.num, plan.fps.den],
                    secs: plan.fps.secs(scene.n_frames),
                    motion,
                    source: (*source != MotionSource::Generated).then(|| source.name().to_owned()),
                    generated_joints,
                });
            }
            let [train, validation, test] = files.map(|files| files.join(", "));
            let splits = format!("train = [{train}]\nvalidation = [{validation}]\ntest = [{test}]");
            configuration += &SPEAKER.replace("NAME", &name).replace("SPLITS", &splits);
        }
    }
    ensure!(!clips.is_empty(), "the sources of motion have no takes for these parts");
    workdir::write_file(&dir.join(LIST), &serde_json::to_vec_pretty(&clips)?)?;
    workdir::write_file(&dir.join("pipeline.toml"), configuration.as_bytes())?;
    Ok(clips)
}

/// Motion of the clips of one source.
enum Motions {
    Generated,
    Files(Vec<PathBuf>),
    /// Excerpts of each part.
    Excerpts([Vec<CapturedTake>; 3]),
}

/// Position of a clip in a plan of `n` clips for each condition.
#[derive(Clone, Copy)]
struct ClipPlace {
    part: SetPart,
    /// Index of the condition, and of the clip within it.
    order: usize,
    number: usize,
    n_conditions: usize,
    n: usize,
}

#[derive(Default)]
struct SourceMotion {
    captured: Option<CapturedClip>,
    motion: Option<PathBuf>,
    generated_joints: Vec<usize>,
}

impl Motions {
    fn read(source: &MotionSource, secs: f64) -> Result<Self> {
        let excerpts = |data: &Path, part: SetPart| -> Result<Vec<CapturedTake>> {
            Ok(source.takes(data, part)?.iter().flat_map(|take| take.excerpts(secs)).collect())
        };
        match source {
            MotionSource::Generated => Ok(Self::Generated),
            MotionSource::Files(path) => Ok(Self::Files(motion_files(path)?)),
            _ => {
                let data = data_folder()?;
                let [first, middle, last] = SetPart::ALL.map(|part| excerpts(&data, part));
                Ok(Self::Excerpts([first?, middle?, last?]))
            }
        }
    }

    /// Motion of a clip; `None` if the source has none for its part. The clips of a part take excerpts at even
    /// distances.
    fn of_clip(&self, place: ClipPlace) -> Result<Option<SourceMotion>> {
        let ClipPlace { part, order, number, n_conditions, n } = place;
        match self {
            Self::Generated => Ok(Some(SourceMotion::default())),
            Self::Files(files) => {
                let file = &files[(order * n + number) % files.len()];
                let captured = Some(captured(file)?);
                Ok(Some(SourceMotion { captured, motion: Some(file.clone()), ..SourceMotion::default() }))
            }
            Self::Excerpts(excerpts) => {
                let (excerpts, n_of_part) = (&excerpts[part as usize], n / 3);
                let index = order * n_of_part + number % n_of_part;
                let take = excerpts.get(index * excerpts.len() / (n_conditions * n_of_part));
                Ok(take.map(|take| SourceMotion {
                    captured: Some(captured_body::clip(take)),
                    motion: Some(PathBuf::from(&take.name)),
                    generated_joints: take.missing_joints(),
                }))
            }
        }
    }
}

/// Reads the clip list of a folder written by `draw`.
///
/// # Errors
/// A list that is missing or invalid.
pub fn read(dir: &Path) -> Result<Vec<PersonClip>> {
    let path = dir.join(LIST);
    let text = std::fs::read_to_string(&path).with_context(|| {
        format!(
            "cannot read {}: expected the list that `orator-lab demo draw {} --people N` writes",
            path.display(),
            dir.display()
        )
    })?;
    serde_json::from_str(&text).with_context(|| format!("invalid list of rendered clips {}", path.display()))
}

/// Seeds of a clip. The three parts use disjoint ranges, so that no body, camera, clothes or motion occurs in two
/// parts.
fn seeds(seed: u64, condition: Condition, number: usize, part: SetPart) -> ClipSeeds {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(1000 * condition as u64 + number as u64);
    let range = (part as u64) << 32;
    let mut next = || range + u64::from(rng.random::<u32>());
    ClipSeeds { body: next(), clothes: next(), camera: next(), motion: next(), voice: None }
}

/// The motion files of a folder, sorted by name, or the file itself.
fn motion_files(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = std::fs::read_dir(path).with_context(|| format!("cannot read the folder {}", path.display()))?;
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    files.retain(|file| file.is_file() && motion_file::has_ending(file));
    files.sort();
    if files.is_empty() {
        bail!("no motion in {}: expected files that end in {}", path.display(), motion_file::ENDINGS.join(", "));
    }
    Ok(files)
}

fn secs_of(motion: &Motion) -> f64 {
    motion.fps.secs(motion.n_frames())
}

fn captured(path: &Path) -> Result<CapturedClip> {
    let motion = motion_file::read(path, None)?.motion;
    units::check(&motion).with_context(|| path.display().to_string())?;
    ensure!(secs_of(&motion) >= 1.0, "the motion {} is too short: expected at least 1 s", path.display());
    let audio = path.with_extension("wav");
    let sound = audio.is_file().then(|| read_sound(&audio)).transpose()?;
    Ok(CapturedClip { motion, sound, trunk: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn no_seed_is_in_two_parts_or_in_two_clips() {
        let mut parts = BTreeMap::new();
        for condition in Condition::ALL {
            for number in 0..30 {
                let part = SetPart::ALL[number / 10];
                let ClipSeeds { body, clothes, camera, motion, .. } = seeds(7, condition, number, part);
                for (kind, seed) in [("body", body), ("clothes", clothes), ("camera", camera), ("motion", motion)] {
                    assert_eq!(parts.insert((kind, seed), part), None, "{kind} {seed}");
                    assert_eq!(seed >> 32, part as u64);
                }
            }
        }
    }
}
