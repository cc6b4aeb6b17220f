//! `orator lift`.

use super::video::VisibleVideo;
use crate::cli::Outcome;
use crate::cli::sandbox::enter_sandbox;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, bail, ensure};
use orator_avatar::animate::export::file::ExportFormat;
use orator_base::stage::progress::Progress;
use orator_base::text::counted;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_formats::keypoints::{CoordinateUnit, range};
use orator_formats::npz::Npz;
use orator_formats::{joints_description as description, keypoints, keypoints_npz, npy};
use orator_pipeline::keypoints::convert;
use orator_pipeline::lift::Lifter;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Lift a video or 2D keypoints to 3D joints.
///
/// Everything in which the speaker is visible is lifted, fit for training or not. The keypoints of a video are detected
/// in the work folder of pipeline.toml in the current folder, else in `work`; `orator animate VIDEO` shows the motion.
///
/// Other inputs: a folder of OpenPose (one JSON file per frame); JSON of MMPose, AlphaPose or COCO-WholeBody;
/// arrays of MediaPipe or PATS (.npy, .npz); or the .npz of this program. The format is detected from the content.
/// The .npz of this program holds `body` [T,17,3] (COCO-17; x px, y px, score) and optionally `left_hand` and
/// `right_hand` [T,21,3] (wrist, then thumb to little finger, each from base to tip), `fps` and `image_size`.
///
/// JOINTS.npz holds `pose3d`, `mask` and `fps`; JOINTS.npy holds the joints only, with the frame rate in
/// JOINTS.npy.json. Joints are float32 [T,49,3] in metres, x right in the image, y down, z away from the camera, the
/// neck at the origin; order: neck, right arm, left arm, left hand, right hand.
///
/// Gaps of up to one second in a joint are filled; longer gaps are NaN. Legs, face, hips or hands may be missing in
/// all frames; both shoulders must be detected in some. A missing nose is derived from the eyes (15 % of the way from
/// them to the neck) or from the ears.
#[derive(clap::Args)]
pub struct Args {
    /// Video, or file or folder of 2D keypoints.
    #[arg(value_name = "INPUT")]
    keypoints: PathBuf,
    /// Frame rate of the keypoints, frames per second; defaults to that of the file. Required for formats of other
    /// programs that do not state one; the .npz of this program is then read at 15.
    #[arg(long, value_name = "RATE")]
    input_fps: Option<FrameRate>,
    /// Width and height of the image, pixels, such as 1280x720; coordinates from 0 to 1 are multiplied by it.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    size: Option<[u32; 2]>,
    /// File of 3D joints to write: .npz, .npy or .txt.
    #[arg(long, value_name = "JOINTS.npz")]
    out: PathBuf,
    /// Also write nose, right hip and left hip: float32 [T,3,3], metres relative to the neck; NaN in gaps longer than
    /// one second.
    #[arg(long, value_name = "FILE.npy")]
    extra: Option<PathBuf>,
    /// Rotate the motion so that the camera is level and the torso is upright on average.
    #[arg(long)]
    level: bool,
    /// Weights written by `orator-lab train lifter --part body`; defaults to the built-in ones.
    #[arg(long, value_name = "FILE")]
    body_weights: Option<PathBuf>,
    /// Weights written by `orator-lab train lifter --part hands`, of either network; defaults to the built-in ones.
    #[arg(long, value_name = "FILE")]
    hand_weights: Option<PathBuf>,
    /// Standard deviation of the Gaussian that smooths the arms, in frames at 15 fps; 0 disables it. Defaults to 0.8, for a
    /// video to that of pipeline.toml.
    #[arg(long, value_name = "FRAMES")]
    smooth_arms: Option<f64>,
    /// Standard deviation of the Gaussian that smooths the hands, in frames at 15 fps; 0 disables it. Defaults to 1.5, for a
    /// video to that of pipeline.toml.
    #[arg(long, value_name = "FRAMES")]
    smooth_hands: Option<f64>,
}

fn size(text: &str) -> Result<[u32; 2], String> {
    config::image_size(text).ok_or_else(|| "expected width and height in pixels, such as 1280x720".to_owned())
}

/// Whether the file has this program's format. An unreadable `.npz` file counts as such, so that its reader reports
/// why.
fn is_ours(path: &Path) -> bool {
    match Npz::open(path) {
        Ok(npz) => npz.has("body"),
        Err(_) => !path.is_dir() && path.extension().is_some_and(|end| end == "npz"),
    }
}

/// Reads keypoints in this program's format, with notes for the user.
fn read_own(args: &Args) -> Result<(Keypoints, Vec<String>)> {
    let (mut keypoints, mut notes) = keypoints_npz::read_sized(&args.keypoints, args.size)?;
    range::check_pixels(range::coordinates(&keypoints)).with_context(|| args.keypoints.display().to_string())?;
    if let Some(fps) = args.input_fps {
        keypoints.fps = fps;
        notes.retain(|note| !note.contains("`fps`"));
    }
    Ok((keypoints, notes))
}

/// Reads keypoints of another program at their own frame rate, with notes for the user.
fn read_foreign(args: &Args) -> Result<(Keypoints, Vec<String>)> {
    let file = args.keypoints.display();
    let found = keypoints::read(&args.keypoints)?;
    let fps = args.input_fps.or(found.fps);
    let fps = fps.with_context(|| format!("{file} does not state its frame rate; give it with --input-fps"))?;
    let mut notes = vec![format!("{} at {fps}", found.format)];
    let size = match args.size.or(found.image_size) {
        Some(size) => size,
        None if found.unit == CoordinateUnit::Pixels => {
            notes.push("image size not stated: derived from the outermost points (set it with --size)".to_owned());
            found.extent()
        }
        None => bail!("{file} does not state its image size; give it with --size, such as 1280x720"),
    };
    let imported = convert(found, fps, size, fps)?;
    notes.extend(imported.notes);
    Ok((imported.keypoints, notes))
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    let video = VisibleVideo::find(&args.keypoints, ui)?;
    enter_sandbox([Some(&args.out), args.extra.as_ref()].into_iter().flatten().map(PathBuf::as_path), []);
    let format = ExportFormat::from_path(&args.out).ok().filter(|format| format.holds_joints());
    let format = format
        .with_context(|| format!("--out {}: expected a file that ends in .npz, .npy or .txt", args.out.display()))?;
    if let Some(path) = args.extra.as_ref().filter(|path| path.extension().is_none_or(|ending| ending != "npy")) {
        bail!("--extra {}: expected a file that ends in .npy", path.display());
    }
    ensure!(args.extra.as_ref() != Some(&args.out), "--out and --extra name the same file {}", args.out.display());
    for sigma in [args.smooth_arms, args.smooth_hands].into_iter().flatten() {
        ensure!(
            (0.0..=100.0).contains(&sigma),
            "--smooth-arms and --smooth-hands: expected 0 to 100 frames, found {sigma}"
        );
    }
    ensure!(
        video.is_none() || (args.input_fps.is_none() && args.size.is_none()),
        "{} is a video: --input-fps and --size apply to keypoints only",
        args.keypoints.display()
    );
    let base = video.as_ref().map(|video| video.settings.lift.clone()).unwrap_or_default();
    let settings = config::LiftConfig {
        body_weights: args.body_weights.clone().unwrap_or(base.body_weights),
        hand_weights: args.hand_weights.clone().unwrap_or(base.hand_weights),
        smooth_arms: args.smooth_arms.unwrap_or(base.smooth_arms),
        smooth_hands: args.smooth_hands.unwrap_or(base.smooth_hands),
        level: args.level || base.level,
        ..base
    };
    let (keypoints, lifted, mut notes, secs) = if let Some(video) = &video {
        let started = Instant::now();
        let (keypoints, lifted) = video.lift(&settings)?;
        (keypoints, lifted, Vec::new(), started.elapsed().as_secs_f64())
    } else {
        let (keypoints, notes) = if is_ours(&args.keypoints) { read_own(&args)? } else { read_foreign(&args)? };
        let (file, lifter) = (args.keypoints.display(), Lifter::new(&settings)?);
        let expected = "expected [T, 17, 3] with T at least 1";
        ensure!(keypoints.n_frames() > 0, "{file} has no frames: `body` is [0, 17, 3], {expected}");
        let started = Instant::now();
        let lifted = lifter.lift_all(&keypoints).with_context(|| format!("cannot lift {file}"))?;
        (keypoints, lifted, notes, started.elapsed().as_secs_f64())
    };
    notes.extend(orator_pipeline::lift::notes(&keypoints, &lifted));
    notes.iter().for_each(|note| ui.say(&format!("{}: {note}", args.keypoints.display())));
    let (motion, camera) = (&lifted.motion, lifted.cameras.first());
    format.write_joints(&args.out, motion)?;
    if let Some(path) = &args.extra {
        let write = |attempt: &Path| npy::write_points(attempt, &lifted.extra);
        description::with(path, motion.fps, lifted.extra.shape(), write)?;
    }

    let n = motion.n_frames();
    let per_joint = |joint: usize| (0..n).filter(|&t| motion.joints[[t, joint, 0]].is_finite()).count();
    let share =
        |joints: &[usize]| joints.iter().map(|&j| per_joint(j)).sum::<usize>() as f64 / (n * joints.len()) as f64;
    let (arms, left, right) = (share(&[1, 2, 3, 4, 5, 6]), share(&[8]), share(&[29]));
    let bone = |joint: usize| lifted.lengths[joint - 1];
    let roll = camera.and_then(|camera| camera.roll_degrees);
    let pitch = camera.and_then(|camera| camera.pitch_degrees);
    let angle = |degrees: Option<f64>| degrees.map_or("unknown".to_owned(), |v| format!("{v:.0} degrees"));
    let text = format!(
        "{} at {} lifted, {:.0} frames/s\narms in {:.0} % of the frames, left hand {:.0} %, right hand {:.0} %\n\
         shoulders {:.3} m, upper arm {:.3} m, forearm {:.3} m\n\
         camera{}: roll {}, downward pitch {}\nwrote {}",
        counted(n, "frame"),
        motion.fps,
        n as f64 / secs.max(1e-9),
        100.0 * arms,
        100.0 * left,
        100.0 * right,
        2.0 * bone(L_SHOULDER),
        bone(L_ELBOW),
        bone(L_WRIST),
        if args.level { " (levelled)" } else { "" },
        angle(roll),
        angle(pitch),
        args.out.display()
    );
    let (input, film) = match &video {
        Some(_) => (&args.keypoints, args.out.with_file_name("film.mp4")),
        None => (&args.out, args.out.with_extension("bvh")),
    };
    let next = format!("orator animate {} --out {}", input.display(), film.display());
    let facts = json!({
        "out": args.out,
        "n_frames": n,
        "fps": motion.fps,
        "frames_per_sec": n as f64 / secs.max(1e-9),
        "arms": arms,
        "left_hand": left,
        "right_hand": right,
        "lengths_metres": lifted.lengths.to_vec(),
        "roll_degrees": roll,
        "pitch_degrees": pitch,
        "levelled": args.level,
        "notes": notes,
        "next": next,
    });
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}
