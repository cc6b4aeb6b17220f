//! `orator sheet`.

use crate::cli::Outcome;
use crate::cli::config_args::ConfigArgs;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Result, bail, ensure};
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Progress as _;
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::text::counted;
use orator_base::types::image::PictureOptions;
use orator_dataset::config::videos::Videos;
use orator_formats::keypoints_npz;
use orator_formats::mocap::motion_file;
use orator_media::opencv::png;
use orator_pipeline::Pipeline;
use orator_pipeline::extract::picture_options;
use orator_pipeline::lift::quality::{self, ArmStatistics, ClipStatistics};
use orator_report::sheet::sheet::SheetClip;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Draw contact sheets: image, keypoints and 3D pose.
///
/// The source is the lifted videos of a run (`-c`), or separate files (`--video`, `--keypoints`, `--joints`). One
/// pose is drawn every second, from the front and from the side; the grid spacing is 0.1 m, its axes cross at the
/// neck. A strip shows the height and depth of the wrists.
///
/// For each arm these values are printed: median lengths of upper arm and forearm, jitter of the wrist (median second
/// difference), its reprojection error, and the shares of frames without a wrist position and without a detected
/// wrist, and of hand joints with a position and detected.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: ConfigArgs,
    /// Draw only this speaker; may be repeated.
    #[arg(long, value_name = "NAME")]
    speaker: Vec<String>,
    /// With a run: draw only this video, given by its work name or its file name without extension. With separate
    /// files: the video.
    #[arg(long, value_name = "NAME|FILE")]
    video: Option<PathBuf>,
    /// Keypoints of the video, for separate files.
    #[arg(long, value_name = "FILE.npz", requires_all = ["video", "joints"], conflicts_with = "speaker")]
    keypoints: Option<PathBuf>,
    /// Joints lifted from the keypoints, .npy or .npz, for separate files.
    #[arg(long, value_name = "FILE", requires = "keypoints")]
    joints: Option<PathBuf>,
    /// Also show the figure that `orator animate` derives from the lifted pose.
    #[arg(long)]
    figure: bool,
    /// Interval between two poses, seconds.
    #[arg(long, default_value_t = 1.0, value_name = "SECS")]
    every: f64,
    /// With separate files: the .png to write; defaults to sheet.png. With a run: the folder to write to; defaults to
    /// `sheets` in the work folder. If the poses do not fit on one sheet, the files are numbered: sheet_000.png.
    #[arg(long, value_name = "FILE|DIR")]
    out: Option<PathBuf>,
}

/// The files of one clip.
struct SheetFiles {
    title: String,
    video: PathBuf,
    pictures: PictureOptions,
    keypoints: PathBuf,
    joints: PathBuf,
    /// Ledger with the reasons for frames without joints.
    ledger: Option<PathBuf>,
    out: PathBuf,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let (mut lock, mut locked) = (None, None);
    let clips = match (&args.keypoints, &args.joints, &args.video) {
        (Some(keypoints), Some(joints), Some(video)) => {
            let out = args.out.clone().unwrap_or_else(|| PathBuf::from("sheet.png"));
            ensure!(
                out.extension().is_some_and(|e| e == "png"),
                "--out {}: expected a file that ends in .png",
                out.display()
            );
            let title = video.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let pictures = PictureOptions::default();
            let (video, keypoints, joints) = (video.clone(), keypoints.clone(), joints.clone());
            vec![SheetFiles { title, video, pictures, keypoints, joints, ledger: None, out }]
        }
        _ => {
            let pipeline = Pipeline::open(args.config.load()?)?;
            let work = &pipeline.config().settings.work.dir;
            lock = Some(FolderLock::shared(work)?);
            locked = Some(work.clone());
            of_run(&pipeline, &args)?
        }
    };
    enter_sandbox(clips.iter().map(|files| files.out.as_path()), locked.as_deref());
    let (mut text, mut facts, mut n_failed, mut next) = (String::new(), Vec::new(), 0, None);
    for files in &clips {
        match draw(files, args.every, args.figure, ui) {
            Ok((written, metrics)) => {
                text += &format!("{}\n{}", files.title, table(&metrics));
                written.iter().for_each(|path| text += &format!("wrote {}\n", path.display()));
                next = next.or_else(|| Some(format!("xdg-open {}", written.first()?.display())));
                facts.push(json!({ "clip": files.title, "sheets": written, "metrics": as_json(&metrics) }));
            }
            Err(error) if clips.len() > 1 => {
                n_failed += 1;
                ui.say(&format!("failed  {}: {error:#}", files.title));
                facts.push(json!({ "clip": files.title, "error": format!("{error:#}") }));
            }
            Err(error) => return Err(error.context(format!("cannot draw a sheet of {}", files.title))),
        }
    }
    drop(lock);
    if n_failed > 0 {
        text += &format!("{n_failed} of {} failed\n", counted(clips.len(), "clip"));
    }
    ui.summary(&text, next.as_deref(), json!({ "clips": facts, "failed": n_failed, "next": next }));
    Ok(if n_failed > 0 { Outcome::SomeFailed } else { Outcome::Done })
}

/// The requested lifted clips of a run.
fn of_run(pipeline: &Pipeline, args: &Args) -> Result<Vec<SheetFiles>> {
    let config = pipeline.config();
    let work = &config.settings.work.dir;
    let folder = args.out.clone().unwrap_or_else(|| work.join("sheets"));
    let is_chosen = |unit: &Unit| {
        let Some(name) = &args.video else { return true };
        name.as_os_str() == unit.video.as_str() || unit.source.file_stem() == Some(name.as_os_str())
    };
    let mut clips = Vec::new();
    let mut names = Vec::new();
    let with_pictures = |videos: Videos| {
        let Videos { units, keypoints, .. } = videos;
        units.into_iter().filter(move |unit| !keypoints.contains_key(&unit.video))
    };
    for unit in pipeline.videos(&args.speaker)?.into_iter().flat_map(with_pictures) {
        names.push(unit.video.clone());
        if is_chosen(&unit) {
            clips.push(SheetFiles {
                title: unit.to_string(),
                pictures: picture_options(work, &unit),
                keypoints: Artifact::Keypoints.path(work, &unit),
                joints: Artifact::Joints.path(work, &unit),
                ledger: Some(Artifact::LiftLedger.path(work, &unit)),
                out: folder.join(&unit.speaker).join(format!("{}.png", unit.video)),
                video: unit.source,
            });
        }
    }
    if let (true, Some(name)) = (clips.is_empty(), &args.video) {
        bail!("no video is named {}; the videos are: {}", name.display(), names.join(", "));
    }
    ensure!(!clips.is_empty(), "{} selects no video files (keypoint files have no sheets)", config.file.display());
    let (lifted, waiting): (Vec<_>, Vec<_>) = clips.into_iter().partition(|files| files.joints.exists());
    let first = waiting.first().map(|files| files.title.clone()).unwrap_or_default();
    let flags = args.config.flags();
    ensure!(!lifted.is_empty(), "{first} is not lifted yet; run `orator run --to lift{flags}`");
    Ok(lifted)
}

/// Draws one clip; returns the written images and the statistics of the clip.
fn draw(files: &SheetFiles, every_secs: f64, figure: bool, ui: &Ui) -> Result<(Vec<PathBuf>, ClipStatistics)> {
    let (keypoints, notes) = keypoints_npz::read_noting(&files.keypoints)?;
    notes.iter().for_each(|note| ui.say(&format!("{}: {note}", files.keypoints.display())));
    // A file without a frame rate is assumed to have that of the keypoints.
    let motion = motion_file::read(&files.joints, Some(keypoints.fps))?.motion;
    let figure = figure.then(|| perform(&motion, None, &AnimationOptions::default()).motion());
    let figure = figure.as_ref();
    let (title, video, pictures) = (&files.title, &files.video, files.pictures);
    let rejected = files.ledger.as_deref().map(Ledger::read).transpose()?.unwrap_or_default().rejected;
    let clip =
        SheetClip { title, video, pictures, keypoints: &keypoints, motion: &motion, rejected: &rejected, figure };
    let mut written = Vec::new();
    clip.pages(every_secs, ui, |number, n_pages, page| {
        let path = if n_pages == 1 { files.out.clone() } else { numbered(&files.out, number) };
        workdir::replace(&path, |attempt| png::write(attempt, page))?;
        written.push(path);
        Ok(())
    })?;
    Ok((written, quality::measure(&motion, &keypoints)?))
}

/// `sheet.png` to `sheet_003.png`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}_{number:03}.png"))
}

type Row = (&'static str, &'static str, fn(&ArmStatistics) -> f64, &'static str);

/// Label in the table, key in JSON, value, usual values. The usual lengths are those of adults; the usual jitter at 15
/// fps is that of gestures in captured motion and in the clips released with Rebol et al. (2021).
const ROWS: [Row; 8] = [
    ("upper arm, m", "upper_arm_metres", |a| a.upper_arm_metres, "0.25 to 0.37"),
    ("forearm, m", "forearm_metres", |a| a.forearm_metres, "0.21 to 0.31"),
    ("wrist jitter, mm", "jitter_mm", |a| a.jitter_mm, "3 to 12"),
    ("wrist reprojection error, mm", "wrist_reprojection_mm", |a| a.wrist_off_mm, "below 30"),
    ("frames without wrist position, %", "missing_percent", |a| 100.0 * a.missing, "the rejected share"),
    ("frames without detected wrist, %", "masked_percent", |a| 100.0 * a.masked, "at most 10 more"),
    ("hand joints with position, %", "hand_present_percent", |a| 100.0 * a.hand_there, "the accepted share"),
    ("hand joints detected, %", "hand_detected_percent", |a| 100.0 * a.hand_visible, "at most 20 less"),
];

fn table(metrics: &ClipStatistics) -> String {
    if metrics.left.missing + metrics.right.missing >= 2.0 {
        return "  no frame is lifted (`orator status --why` prints the reasons; `orator lift` applies no checks)\n"
            .to_owned();
    }
    let number = |v: f64| if v.is_finite() { format!("{v:.2}") } else { "-".to_owned() };
    let head = format!("  {:40}{:>9}{:>9}   usual\n", "", "left", "right");
    ROWS.iter().fold(head, |text, (name, _, of, usual)| {
        text + &format!("  {name:40}{:>9}{:>9}   {usual}\n", number(of(&metrics.left)), number(of(&metrics.right)))
    })
}

fn as_json(metrics: &ClipStatistics) -> Value {
    let arm = |arm: &ArmStatistics| -> serde_json::Map<String, Value> {
        ROWS.iter().map(|(_, name, of, _)| ((*name).to_owned(), json!(of(arm)))).collect()
    };
    json!({ "left": arm(&metrics.left), "right": arm(&metrics.right) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_states_usual_values() {
        let arm = ArmStatistics {
            upper_arm_metres: 0.3,
            forearm_metres: 0.26,
            jitter_mm: 3.5,
            wrist_off_mm: 20.0,
            missing: 0.0,
            masked: 0.0,
            hand_there: 1.0,
            hand_visible: 1.0,
        };
        let table = table(&ClipStatistics { left: arm, right: arm });
        let row = format!("  {:40}{:>9}{:>9}   0.25 to 0.37\n", "upper arm, m", "0.30", "0.30");
        assert!(table.contains(&row) && table.lines().all(|line| line.len() > 60), "{table}");
    }
}
