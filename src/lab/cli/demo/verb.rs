//! `orator-lab demo`.

use super::learned;
use crate::demo::GENERATOR;
use crate::demo::check::pipeline;
use crate::demo::check::pipeline::{MIN_FRAMES, MIN_JOINTS, Millimetres};
use crate::demo::check::sheet;
use crate::demo::host;
use crate::demo::people;
use crate::demo::people::condition::Condition;
use crate::demo::people::folder::RenderPlan;
use crate::mocap::captured::source::MotionSource;
use anyhow::{Context, Result, bail, ensure};
use orator::cli::Outcome;
use orator::cli::ui::Ui;
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::text::{counted, length};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_dataset::info::DatasetInfo;
use orator_formats::mocap::motion_file;
use orator_media::opencv::png;
use orator_test_support::drawn::folder;
use orator_test_support::drawn::folder::DemoPlan;
use orator_test_support::rule::{dataset, speech_dataset};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Default duration of a clip of rendered persons, seconds.
const PEOPLE_SECS: f64 = 8.0;

/// Generate synthetic speakers with known motion, and measure results on them.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    part: DemoVerb,
}

#[derive(clap::Subcommand)]
enum DemoVerb {
    /// Draw videos of a synthetic speaker with known joints.
    ///
    /// Writes the videos with audio, the ground truth, the marker models and a pipeline.toml into DIR. With --people,
    /// renders people in rooms, for the pose models for real people.
    Draw {
        /// Demo folder; created if it does not exist.
        dir: PathBuf,
        /// Number of videos.
        #[arg(long, default_value_t = DemoPlan::default().n_videos, conflicts_with = "people")]
        videos: usize,
        /// Render people: N clips per condition, a multiple of 3 (one third each for training, selection and test).
        #[arg(long, value_name = "N")]
        people: Option<usize>,
        /// Conditions to render, separated by commas (front, standing, crossing ...); defaults to all.
        #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "people")]
        conditions: Vec<String>,
        /// Write only the ground truth of the rendered persons, without videos: motion for `orator-lab train lifter
        /// --mocap DIR/truth`.
        #[arg(long, requires = "people")]
        truth_only: bool,
        /// Motion of the rendered persons; every clip is rendered with the motion of each source: generated (the
        /// default), cmu, bandai, beat2, ted (captured motion below the folder ORATOR_DATA), or a motion file or
        /// folder (the audio is the .wav next to it).
        #[arg(long, value_name = "SOURCE|PATH", num_args = 1.., requires = "people")]
        motion: Vec<MotionSource>,
        /// Render the speaker as a person for the models for real people (`orator models fetch`), instead of as a
        /// figure in a marker suit for the marker models.
        #[arg(long, conflicts_with = "people")]
        rendered: bool,
        /// Duration of each video, seconds; defaults to 30, for rendered persons to 8.
        #[arg(long)]
        secs: Option<f64>,
        /// Frame rate, frames per second, 1 to 120.
        #[arg(long, default_value_t = 30)]
        fps: u32,
        /// Random seed of the speech and the gestures.
        #[arg(long, default_value_t = DemoPlan::default().seed)]
        seed: u64,
    },
    /// Compare the keypoints and the dataset of a run in DIR with the ground truth.
    ///
    /// Exit code 2: a target is missed.
    Measure {
        /// Demo folder.
        dir: PathBuf,
    },
    /// Write a dataset of a synthetic speaker that gestures by a known rule.
    ///
    /// The dataset has audio and motion, without video.
    Speaker {
        /// Dataset folder to write; must not exist or be empty.
        dir: PathBuf,
        /// Duration of the training split, hours; validation and test have ten minutes each, with --words the test
        /// split has thirty.
        #[arg(long, default_value_t = 2.0)]
        hours: f64,
        /// Add words that cannot be distinguished by their audio, some of which move a hand to a position of their
        /// own (version 2 of the first rule).
        #[arg(long)]
        words: bool,
        /// Variant of the rule: other vowels move the hands, after other delays; 0 is the original rule.
        #[arg(long, value_name = "N", default_value_t = 0)]
        habits: u64,
        /// Folder of recorded speech to use instead of synthetic speech: NAME.wav with NAME.tsv (start, end, word) and,
        /// if its words were recognised, NAME.json, in the split that NAME begins with. The gestures follow the second rule
        /// (version 3), based on loud syllables, phrases and 40 words.
        #[arg(long, value_name = "DIR", conflicts_with_all = ["hours", "words", "habits"])]
        speech: Option<PathBuf>,
        /// Random seed of the speech and of the variation of the speaker.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Measure how much of the rule of a synthetic speaker a trained model has learned.
    ///
    /// The test split is used. Exit code 2: a target is missed.
    Learned {
        /// Dataset folder.
        #[arg(long, value_name = "DIR")]
        dataset: PathBuf,
        /// Folder `truth` of `demo draw --rendered`, for a dataset built from its videos.
        #[arg(long, value_name = "DIR")]
        truth: Option<PathBuf>,
        /// Checkpoint of `orator train gan` or `orator train seq2seq`, or its folder; without it only the baselines
        /// are measured.
        #[arg(long, value_name = "FILE|DIR")]
        checkpoint: Option<PathBuf>,
        /// Picture to write, .png: wrist speeds and poses of the rule, the speaker and the checkpoint for the first
        /// test clip.
        #[arg(long, value_name = "FILE", requires = "checkpoint")]
        picture: Option<PathBuf>,
    },
    /// Draw a contact sheet of a run: video, keypoints, 3D figure, generated motion.
    Sheet {
        /// Demo folder.
        dir: PathBuf,
        /// Picture to write, .png.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Generated motion to show next to the clip, .npy.
        #[arg(long, value_name = "FILE")]
        motion: Option<PathBuf>,
    },
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.part {
        DemoVerb::Draw { dir, videos, people, conditions, truth_only, motion, rendered, secs, fps, seed, .. } => {
            let fps = FrameRate::new(fps.clamp(1, 120), 1);
            if let Some(n_clips) = people {
                let conditions = Condition::of_names(&conditions)?;
                let secs = secs.unwrap_or(PEOPLE_SECS);
                let motions = if motion.is_empty() { vec![MotionSource::Generated] } else { motion };
                return render(&dir, &RenderPlan { conditions, n_clips, secs, fps, seed, motions, truth_only }, ui);
            }
            let defaults = DemoPlan::default();
            let plan = DemoPlan { n_videos: videos, secs: secs.unwrap_or(defaults.secs), fps, seed, ..defaults };
            draw(&dir, &plan, rendered, ui)
        }
        DemoVerb::Measure { dir } => measure(&dir, ui),
        DemoVerb::Speaker { dir, speech: Some(folder), seed, .. } => {
            let speech = speech_dataset::speech_of(&folder)?;
            let write = |attempt: &Path| speech_dataset::write(attempt, &speech, seed, ui);
            write_speaker(&dir, speech.len(), speech_dataset::RULE_OF_SPEECH, ui, write)
        }
        DemoVerb::Speaker { dir, hours, words, habits, seed, speech: None } => {
            let rule = if words { dataset::RULE_OF_WORDS } else { dataset::RULE };
            let clips = dataset::clips(hours, seed, rule, habits)?;
            write_speaker(&dir, clips.len(), rule, ui, |attempt| dataset::write(attempt, &clips, ui))
        }
        DemoVerb::Learned { dataset, truth, checkpoint, picture } => {
            learned::run(&dataset, truth.as_deref(), checkpoint.as_deref(), picture.as_deref(), ui)
        }
        DemoVerb::Sheet { dir, out, motion } => draw_sheet(&dir, &out, motion.as_deref(), ui),
    }
}

fn draw(dir: &Path, plan: &DemoPlan, rendered: bool, ui: &Ui) -> Result<Outcome> {
    let videos = if rendered { host::draw(dir, plan, ui)? } else { folder::draw(dir, plan, ui)? };
    let next = format!("orator run -c {}", dir.join("pipeline.toml").display());
    let text = format!(
        "wrote {} of {} to {}",
        counted(videos.len(), "video"),
        length(plan.secs),
        dir.join("videos/host").display()
    );
    ui.summary(&text, Some(&next), json!({ "videos": videos, "next": next }));
    Ok(Outcome::Done)
}

fn render(dir: &Path, plan: &RenderPlan, ui: &Ui) -> Result<Outcome> {
    let clips = people::folder::draw(dir, plan, ui)?;
    let next = format!("orator run -c {} --to pose2d", dir.join("pipeline.toml").display());
    let text = format!(
        "rendered {} of persons under {} to {}",
        counted(clips.len(), "clip"),
        counted(plan.conditions.len(), "condition"),
        dir.join("videos").display()
    );
    ui.summary(&text, Some(&next), json!({ "clips": clips, "next": next }));
    Ok(Outcome::Done)
}

fn measure(dir: &Path, ui: &Ui) -> Result<Outcome> {
    let m = pipeline::measure(dir)?;
    let row = |name: &str, mm: &Millimetres| {
        format!("{name:34}{:>8.1}{:>8.1}{:>8.1}{:>9.1}\n", mm.all, mm.body, mm.wrists, mm.fingers)
    };
    let px = |name: &str, px: &pipeline::Pixels| {
        format!("{name:34}{:>8.2}{:>8.2}{:>7.1} %\n", px.median, px.p90, 100.0 * px.found)
    };
    let targets = m.targets();
    let mut text = format!("{:34}{:>8}{:>8}{:>9}\n", "2D keypoint error, px", "median", "90 %", "detected");
    text += &px("body (13 points)", &m.body);
    text += &px("hands (2 x 21 points)", &m.hands);
    text += &m.shoulders_px.map_or(String::new(), |shoulders| {
        let [body, hands] = [m.body.median, m.hands.median].map(|px| 100.0 * px / shoulders);
        format!(
            "visible points only; medians relative to the shoulder width of {shoulders:.0} px: body {body:.1} %, hands \
             {hands:.1} %\n"
        )
    });
    text += &format!("{:34}{:>8}{:>8}{:>8}{:>9}\n", "3D joint error, mean mm", "joints", "body", "wrists", "fingers");
    text += &row("this run", &m.lifted);
    text += &row("baseline: mean pose", &m.mean_pose);
    text += &row("baseline: true x, y, mean depth", &m.mean_depth);
    text += &row("baseline: true x, y, bone lengths", &m.bone_depth);
    text += &format!(
        "{} of {} frames are in the dataset; {:.1} % of their joints have values, and all rows use these only.\n\
         joints: 48, relative to the neck; fingers: relative to their wrist; segments of 60 frames are scaled to \
         0.90 m (shoulder width + upper arm + forearm) and not rotated.\n",
        m.n_frames,
        m.n_drawn,
        100.0 * m.joints
    );
    text += &format!("training data: {}\n", length(m.train_secs));
    let targets_met = m.meets_targets();
    let met = if targets_met { "met" } else { "MISSED" };
    let generator =
        if m.shoulders_px.is_some() { "rendered person, with the pose models for real people" } else { GENERATOR };
    text += &format!("generator: {generator}\n");
    text += &format!(
        "3D error: {:.1} mm; targets: 2D error {:.1} px, 3D error {:.0} mm, {:.0} % of points detected, {:.0} % of \
         frames and {:.0} % of joints in the dataset: {met}",
        m.lifted.all,
        targets.max_px,
        targets.max_mm,
        100.0 * targets.min_found,
        100.0 * MIN_FRAMES,
        100.0 * MIN_JOINTS
    );
    let mm = |mm: &Millimetres| json!({ "all": mm.all, "body": mm.body, "wrists": mm.wrists, "fingers": mm.fingers });
    let facts = json!({
        "body_px": { "median": m.body.median, "p90": m.body.p90, "found": m.body.found },
        "hands_px": { "median": m.hands.median, "p90": m.hands.p90, "found": m.hands.found },
        "mm": mm(&m.lifted), "mean_pose_mm": mm(&m.mean_pose), "mean_depth_mm": mm(&m.mean_depth),
        "bone_depth_mm": mm(&m.bone_depth), "joints": m.joints, "shoulders_px": m.shoulders_px,
        "generator": generator,
        "n_frames": m.n_frames, "n_drawn": m.n_drawn, "targets_met": targets_met, "train_secs": m.train_secs,
    });
    ui.summary(&text, None, facts);
    Ok(if targets_met { Outcome::Done } else { Outcome::SomeFailed })
}

fn write_speaker(
    dir: &Path,
    n_clips: usize,
    rule: u32,
    ui: &Ui,
    write: impl FnOnce(&Path) -> Result<DatasetInfo>,
) -> Result<Outcome> {
    let out = std::path::absolute(dir)?;
    let _lock = FolderLock::exclusive(&out)?;
    ensure!(!workdir::has_files(&out), "the folder {} is not empty; choose another one", dir.display());
    let info = workdir::build_folder(&out, write)?;
    let secs: Vec<String> = info.splits.iter().map(|(name, split)| format!("{name} {}", length(split.secs))).collect();
    let text = format!(
        "wrote {} by version {rule} of the rule to {}: {}",
        counted(n_clips, "clip"),
        dir.display(),
        secs.join(", ")
    );
    let next = format!("orator-lab demo learned --dataset {}", dir.display());
    ui.summary(&text, Some(&next), json!({ "dataset": dir, "clips": n_clips, "next": next }));
    Ok(Outcome::Done)
}

fn draw_sheet(dir: &Path, out: &Path, generated: Option<&Path>, ui: &Ui) -> Result<Outcome> {
    let config = config::load(&dir.join("pipeline.toml"), &[])?;
    let units = config::videos::all(&config);
    let Some(unit) = units.iter().flat_map(|videos| &videos.units).next() else {
        bail!("no entry of {} matches a video", dir.join("pipeline.toml").display());
    };
    let generated = generated.map(|path| motion_file::read(path, Some(folder::DATASET_FPS))).transpose()?;
    let image = sheet::draw_sheet(&config.settings.work.dir, unit, generated.as_ref().map(|read| &read.motion))
        .with_context(|| format!("cannot draw a contact sheet of {}", unit.source.display()))?;
    workdir::replace(out, |attempt| png::write(attempt, &image))?;
    ui.summary(&format!("wrote {}", out.display()), None, json!({ "sheet": out }));
    Ok(Outcome::Done)
}
