//! `orator demo`.

use super::{Outcome, ui::Ui};
use anyhow::{Context, Result, bail};
use orator::config;
use orator::demo::GENERATOR;
use orator::demo::folder::{self, Plan};
use orator::demo::measure::{self, LEAST_FOUND, LEAST_FRAMES, LEAST_JOINTS, MOST_MM, MOST_PX, Millimetres};
use orator::demo::sheet;
use orator::motion::npy;
use orator::stage::workdir;
use orator::types::pose3d::Motion;
use orator::types::time::FrameRate;
use orator::vision::png;
use serde_json::json;
use std::path::{Path, PathBuf};

/// A synthetic speaker with known joints: draw its videos, measure what a run made of them.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    part: Part,
}

#[derive(clap::Subcommand)]
enum Part {
    /// Draw videos of the speaker with sound, their truth, the marker models and a pipeline.toml into DIR.
    Draw {
        /// The demo's folder; made if it is not there.
        dir: PathBuf,
        /// How many videos.
        #[arg(long, default_value_t = Plan::default().n_videos)]
        videos: usize,
        /// Seconds of each video.
        #[arg(long, default_value_t = Plan::default().secs)]
        secs: f64,
        /// Frames a second.
        #[arg(long, default_value_t = 30)]
        fps: u32,
        /// Another seed is another speech with other gestures.
        #[arg(long, default_value_t = Plan::default().seed)]
        seed: u64,
    },
    /// Hold the keypoints and the dataset of a run in DIR against the truth; exit code 2 where a target is missed.
    Measure {
        /// The demo's folder.
        dir: PathBuf,
    },
    /// Draw a contact sheet of a run in DIR: video, keypoints, 3D figure, generated motion.
    Sheet {
        /// The demo's folder.
        dir: PathBuf,
        /// The picture to write, .png.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// A generated motion, .npy, to show beside the clip.
        #[arg(long, value_name = "FILE")]
        motion: Option<PathBuf>,
    },
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    match args.part {
        Part::Draw { dir, videos, secs, fps, seed } => {
            let fps = FrameRate::new(fps.clamp(1, 120), 1);
            let plan = Plan { n_videos: videos, secs, fps, seed, ..Plan::default() };
            draw(&dir, &plan, ui)
        }
        Part::Measure { dir } => measure(&dir, ui),
        Part::Sheet { dir, out, motion } => draw_sheet(&dir, &out, motion.as_deref(), ui),
    }
}

fn draw(dir: &Path, plan: &Plan, ui: &Ui) -> Result<Outcome> {
    let videos = folder::draw(dir, plan, ui)?;
    let next = format!("orator run -c {}", dir.join("pipeline.toml").display());
    let text = format!("drew {} videos of {} s into {}", videos.len(), plan.secs, dir.join("videos/host").display());
    ui.summary(&text, Some(&next), json!({ "videos": videos, "next": next }));
    Ok(Outcome::Done)
}

fn measure(dir: &Path, ui: &Ui) -> Result<Outcome> {
    let m = measure::measure(dir)?;
    let row = |name: &str, mm: &Millimetres| {
        format!("{name:34}{:>8.1}{:>8.1}{:>8.1}{:>9.1}\n", mm.all, mm.body, mm.wrists, mm.fingers)
    };
    let px = |name: &str, px: &measure::Pixels| {
        format!("{name:34}{:>8.2}{:>8.2}{:>7.1} %\n", px.median, px.p90, 100.0 * px.found)
    };
    let mut text = format!("{:34}{:>8}{:>8}{:>9}\n", "2D, px from the truth", "median", "90 %", "found");
    text += &px("body (13 points)", &m.body);
    text += &px("hands (2 x 21 points)", &m.hands);
    text +=
        &format!("{:34}{:>8}{:>8}{:>8}{:>9}\n", "3D, mean mm from the truth", "joints", "body", "wrists", "fingers");
    text += &row("this run", &m.lifted);
    text += &row("trivial: the mean pose", &m.mean_pose);
    text += &row("trivial: true x, y and mean depth", &m.mean_depth);
    text += &row("trivial: true x, y and bone lengths", &m.bone_depth);
    text += &format!(
        "{} of {} frames are in the dataset, {:.1} % of their joints have a number; all rows count these. joints: 48 from the neck; fingers: from their wrist; no rotation,\n\
         segments of 60 frames scaled to 0.90 m of shoulders, upper arm and forearm.\n",
        m.n_frames,
        m.n_drawn,
        100.0 * m.joints
    );
    let good = m.good();
    let met = if good { "met" } else { "MISSED" };
    text += &format!("generator: {GENERATOR}\n");
    text += &format!(
        "3D error against the known truth: {:.1} mm; targets: {MOST_PX} px, {MOST_MM} mm, {:.0} % of points found, {:.0} % \
         of frames, {:.0} % of joints: {met}",
        m.lifted.all,
        100.0 * LEAST_FOUND,
        100.0 * LEAST_FRAMES,
        100.0 * LEAST_JOINTS
    );
    let mm = |mm: &Millimetres| json!({ "all": mm.all, "body": mm.body, "wrists": mm.wrists, "fingers": mm.fingers });
    let facts = json!({
        "body_px": { "median": m.body.median, "p90": m.body.p90, "found": m.body.found },
        "hands_px": { "median": m.hands.median, "p90": m.hands.p90, "found": m.hands.found },
        "mm": mm(&m.lifted), "mean_pose_mm": mm(&m.mean_pose), "mean_depth_mm": mm(&m.mean_depth),
        "bone_depth_mm": mm(&m.bone_depth), "joints": m.joints, "generator": GENERATOR,
        "n_frames": m.n_frames, "n_drawn": m.n_drawn, "good": good,
    });
    ui.summary(&text, None, facts);
    Ok(if good { Outcome::Done } else { Outcome::SomeFailed })
}

fn draw_sheet(dir: &Path, out: &Path, generated: Option<&Path>, ui: &Ui) -> Result<Outcome> {
    let config = config::load(&dir.join("pipeline.toml"), &[])?;
    let units = config::videos::of(&config);
    let Some(unit) = units.iter().flat_map(|videos| &videos.units).next() else {
        bail!("{} names no video", dir.join("pipeline.toml").display());
    };
    let stage = |name: &str| config.settings.work.dir.join(name).join(&unit.speaker).join(&unit.video);
    let generated = generated.map(|path| -> Result<Motion> { npy::read(path, folder::DATASET_FPS) }).transpose()?;
    let image = sheet::draw_sheet(&unit.source, &stage("pose2d"), &stage("lift"), generated.as_ref())
        .with_context(|| format!("drawing a contact sheet of {}", unit.source.display()))?;
    workdir::replace(out, |attempt| png::write(attempt, &image))?;
    ui.summary(&format!("wrote {}", out.display()), None, json!({ "sheet": out }));
    Ok(Outcome::Done)
}
