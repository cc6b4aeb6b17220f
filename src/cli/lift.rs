//! `orator lift`.

use super::{Outcome, ui::Ui};
use anyhow::{Context, Result, ensure};
use orator::config;
use orator::lift::Lifter;
use orator::motion::{bones, keypoints_npz, npy};
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
/// left arm, left hand, right hand. A joint not seen for up to a second is filled; one missing for longer is NaN.
#[derive(clap::Args)]
pub struct Args {
    /// The keypoints.
    #[arg(value_name = "KEYPOINTS.npz")]
    keypoints: PathBuf,
    /// The joints to write.
    #[arg(long, value_name = "JOINTS.npy")]
    out: PathBuf,
    /// Weights of `orator train lifter --part body`; without: the built-in ones.
    #[arg(long, value_name = "FILE")]
    body_weights: Option<PathBuf>,
    /// Weights of `orator train lifter --part hands`; without: the built-in ones.
    #[arg(long, value_name = "FILE")]
    hand_weights: Option<PathBuf>,
    /// Width of the Gaussian that smooths arms, in frames at 15 fps; 0: none.
    #[arg(long, default_value_t = config::Lift::default().smooth_arms)]
    smooth_arms: f64,
    /// The same for hands.
    #[arg(long, default_value_t = config::Lift::default().smooth_hands)]
    smooth_hands: f64,
}

pub fn run(args: Args, ui: &Ui) -> Result<Outcome> {
    ensure!(
        args.out.extension().is_some_and(|e| e == "npy"),
        "{}: joints are written as .npy; name such a file",
        args.out.display()
    );
    for sigma in [args.smooth_arms, args.smooth_hands] {
        ensure!((0.0..=100.0).contains(&sigma), "a smoothing of {sigma} frames; it must lie between 0 and 100");
    }
    let settings = config::Lift {
        body_weights: args.body_weights.unwrap_or_default(),
        hand_weights: args.hand_weights.unwrap_or_default(),
        smooth_arms: args.smooth_arms,
        smooth_hands: args.smooth_hands,
    };
    let (keypoints, notes) = keypoints_npz::read_noting(&args.keypoints)?;
    let lifter = Lifter::new(&settings)?;
    notes.iter().for_each(|note| ui.say(&format!("{}: {note}", args.keypoints.display())));
    ensure!(keypoints.n_frames() > 0, "{} has no frames", args.keypoints.display());
    let started = Instant::now();
    let motion = lifter.lift(&keypoints).with_context(|| format!("cannot lift {}", args.keypoints.display()))?;
    let secs = started.elapsed().as_secs_f64();
    workdir::replace(&args.out, |attempt| npy::write(attempt, &motion))?;

    let n = motion.n_frames();
    let per_joint = |joint: usize| (0..n).filter(|&t| motion.joints[[t, joint, 0]].is_finite()).count();
    let share =
        |joints: &[usize]| joints.iter().map(|&j| per_joint(j)).sum::<usize>() as f64 / (n * joints.len()) as f64;
    let (arms, left, right) = (share(&[1, 2, 3, 4, 5, 6]), share(&[8]), share(&[29]));
    let lengths = bones::measure(&motion);
    let bone = |joint: usize| lengths[joint - 1];
    let text = format!(
        "{n} frames at {} lifted, {:.0} a second\narms in {:.0} % of the frames, left hand {:.0} %, right hand {:.0} %\n\
         shoulders {:.3} m, upper arm {:.3} m, forearm {:.3} m\nwrote {}",
        motion.fps,
        n as f64 / secs.max(1e-9),
        100.0 * arms,
        100.0 * left,
        100.0 * right,
        2.0 * bone(L_SHOULDER),
        bone(L_ELBOW),
        bone(L_WRIST),
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
        "lengths_metres": lengths.to_vec(),
        "notes": notes,
    });
    ui.summary(&text, Some(&next), facts);
    Ok(Outcome::Done)
}
