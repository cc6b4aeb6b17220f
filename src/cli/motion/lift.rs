//! `orator lift`.

use crate::cli::Outcome;
use crate::cli::ui::Ui;
use anyhow::{Context, Result, ensure};
use orator::config;
use orator::formats::{keypoints_npz, npy};
use orator::pipeline::lift::Lifter;
use orator::stage::progress::Progress;
use orator::stage::workdir;
use orator::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Lift 2D keypoints to 3D joints, outside a run.
///
/// KEYPOINTS.npz holds `body` [T,17,3] (COCO-17; x px, y px, score) and, if known, `left_hand` and `right_hand`
/// [T,21,3] (wrist, then thumb to little finger, each base to tip), `fps` and `image_size`. JOINTS.npy becomes
/// float32 [T,49,3]: metres, x image right, y down, z away from the camera, the neck at the origin; neck, right arm,
/// left arm, left hand, right hand. A joint not seen for up to a second is filled; one missing for longer is NaN. Legs,
/// face, hips or hands may be missing throughout; both shoulders must be seen now and then. A nose that is missing is
/// taken from the eyes (15 % of the way from them to the neck) or the ears.
#[derive(clap::Args)]
pub struct Args {
    /// The keypoints.
    #[arg(value_name = "KEYPOINTS.npz")]
    keypoints: PathBuf,
    /// The joints to write.
    #[arg(long, value_name = "JOINTS.npy")]
    out: PathBuf,
    /// Also write nose, right hip, left hip, float32 [T,3,3], metres about the neck; NaN where not seen for a second.
    #[arg(long, value_name = "FILE.npy")]
    extra: Option<PathBuf>,
    /// Turn the motion as if the camera had been level and the speaker's torso upright on average.
    #[arg(long)]
    level: bool,
    /// Weights of `orator train lifter --part body`; without: the built-in ones.
    #[arg(long, value_name = "FILE")]
    body_weights: Option<PathBuf>,
    /// Weights of `orator train lifter --part hands`; without: the built-in ones.
    #[arg(long, value_name = "FILE")]
    hand_weights: Option<PathBuf>,
    /// Width of the Gaussian that smooths arms, in frames at 15 fps; 0: none.
    #[arg(long, default_value_t = config::LiftConfig::default().smooth_arms)]
    smooth_arms: f64,
    /// Width of the Gaussian that smooths hands, in frames at 15 fps; 0: none.
    #[arg(long, default_value_t = config::LiftConfig::default().smooth_hands)]
    smooth_hands: f64,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    for path in [Some(&args.out), args.extra.as_ref()].into_iter().flatten() {
        ensure!(
            path.extension().is_some_and(|e| e == "npy"),
            "{}: joints are written as .npy; name such a file",
            path.display()
        );
    }
    ensure!(args.extra.as_ref() != Some(&args.out), "--out and --extra name the same file {}", args.out.display());
    for sigma in [args.smooth_arms, args.smooth_hands] {
        ensure!((0.0..=100.0).contains(&sigma), "a smoothing of {sigma} frames; it must lie between 0 and 100");
    }
    let settings = config::LiftConfig {
        body_weights: args.body_weights.unwrap_or_default().into(),
        hand_weights: args.hand_weights.unwrap_or_default().into(),
        smooth_arms: args.smooth_arms,
        smooth_hands: args.smooth_hands,
        level: args.level,
        ..config::LiftConfig::default()
    };
    let (keypoints, mut notes) = keypoints_npz::read_noting(&args.keypoints)?;
    let lifter = Lifter::new(&settings)?;
    ensure!(
        keypoints.n_frames() > 0,
        "{} has no frames: `body` is [0, 17, 3], expected [T, 17, 3] with T at least 1",
        args.keypoints.display()
    );
    let started = Instant::now();
    let lifted = lifter.lift_all(&keypoints).with_context(|| format!("cannot lift {}", args.keypoints.display()))?;
    let secs = started.elapsed().as_secs_f64();
    notes.extend(orator::pipeline::lift::notes(&keypoints, &lifted));
    notes.iter().for_each(|note| ui.say(&format!("{}: {note}", args.keypoints.display())));
    let (motion, camera) = (&lifted.motion, lifted.cameras.first());
    workdir::replace(&args.out, |attempt| npy::write(attempt, motion))?;
    if let Some(path) = &args.extra {
        workdir::replace(path, |attempt| npy::write_points(attempt, &lifted.extra))?;
    }

    let n = motion.n_frames();
    let per_joint = |joint: usize| (0..n).filter(|&t| motion.joints[[t, joint, 0]].is_finite()).count();
    let share =
        |joints: &[usize]| joints.iter().map(|&j| per_joint(j)).sum::<usize>() as f64 / (n * joints.len()) as f64;
    let (arms, left, right) = (share(&[1, 2, 3, 4, 5, 6]), share(&[8]), share(&[29]));
    let bone = |joint: usize| lifted.lengths[joint - 1];
    let roll = camera.and_then(|camera| camera.roll_degrees);
    let pitch = camera.and_then(|camera| camera.pitch_degrees);
    let held = |degrees: Option<f64>| degrees.map_or("not to be known".to_owned(), |v| format!("{v:.0} degrees"));
    let text = format!(
        "{n} frames at {} lifted, {:.0} a second\narms in {:.0} % of the frames, left hand {:.0} %, right hand {:.0} %\n\
         shoulders {:.3} m, upper arm {:.3} m, forearm {:.3} m\n\
         camera{}: roll {}, looking down {}\nwrote {}",
        motion.fps,
        n as f64 / secs.max(1e-9),
        100.0 * arms,
        100.0 * left,
        100.0 * right,
        2.0 * bone(L_SHOULDER),
        bone(L_ELBOW),
        bone(L_WRIST),
        if args.level { " (levelled)" } else { "" },
        held(roll),
        held(pitch),
        args.out.display()
    );
    let next = format!("python3 -c \"import numpy; print(numpy.load('{}').shape)\"", args.out.display());
    let facts = json!({
        "out": args.out,
        "n_frames": n,
        "fps": motion.fps,
        "frames_a_second": n as f64 / secs.max(1e-9),
        "arms": arms,
        "left_hand": left,
        "right_hand": right,
        "lengths_metres": lifted.lengths.to_vec(),
        "roll_degrees": roll,
        "pitch_degrees": pitch,
        "levelled": args.level,
        "notes": notes,
    });
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}
