//! `cargo bench -- lift`.

use super::report::{Report, median};
use anyhow::{Result, bail, ensure};
use candle_core::{DType, Device, Tensor};
use ndarray::{Array3, s};
use orator_base::motion::upper_body::{COCO, L_WRIST, R_WRIST};
use orator_base::stage::progress::Progress;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_lab::train::scene::body::{FilmedScene, Filming};
use orator_lab::train::scene::hand_shape;
use orator_nn::Mode;
use orator_nn::lifter::body::BodyLifter;
use orator_nn::lifter::hand::HandLifter;
use orator_pipeline::lift::weights::HandNetwork;
use orator_pipeline::lift::{Lifter, weights};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Lifting of keypoints to joints, body and both hands: frames per second on one processor core, and the ratio to the
/// time of the networks alone. The keypoints are those of a rule-based speaker. Uses a pool of one thread.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Frames to lift per round, at 15 fps.
    #[arg(long, default_value_t = 1800, value_name = "N")]
    frames: usize,
    /// Rounds; each measures every variant once.
    #[arg(long, default_value_t = 7, value_name = "N")]
    rounds: usize,
    /// Weights of `orator-lab train lifter --part body`; default: built in.
    #[arg(long, value_name = "FILE")]
    body_weights: Option<PathBuf>,
    /// Weights of `orator-lab train lifter --part hands`; default: built in.
    #[arg(long, value_name = "FILE")]
    hand_weights: Option<PathBuf>,
}

/// Windows and hands per batch, as in the lifters.
const BATCH: (usize, usize) = (512, 1024);

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.frames > 0 && args.rounds > 0, "nothing to measure: there must be frames and rounds");
    let settings = config::LiftConfig {
        body_weights: args.body_weights.clone().unwrap_or_default(),
        hand_weights: args.hand_weights.clone().unwrap_or_default(),
        ..Default::default()
    };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let task = progress.begin("lift", args.rounds as u64);
    let (mut lifting, mut inference) = (Vec::new(), Vec::new());
    one_thread.install(|| -> Result<()> {
        let lifter = Lifter::new(&settings)?;
        let body = weights::body(&settings.body_weights)?;
        let HandNetwork::Coordinates(hands) = weights::hands(&settings.hand_weights)? else {
            bail!("--hand-weights: expected weights of `orator-lab train lifter --part hands --network coordinates`")
        };
        let keypoints = rule_based_keypoints(args.frames);
        lifter.lift(&keypoints)?;
        networks(&body, &hands, args.frames)?;
        for _ in 0..args.rounds {
            let start = Instant::now();
            lifter.lift(&keypoints)?;
            lifting.push(start.elapsed().as_secs_f64());
            let start = Instant::now();
            networks(&body, &hands, args.frames)?;
            inference.push(start.elapsed().as_secs_f64());
            task.advance(1);
        }
        Ok(())
    })?;
    drop(task);

    let n_frames = args.frames as f64;
    let ratio = median(lifting.iter().zip(&inference).map(|(lifting, inference)| lifting / inference).collect());
    let [frames_per_sec, of_networks] = [&lifting, &inference].map(|secs| n_frames / median(secs.clone()));
    let text = format!(
        "{n_frames} frames, body and both hands, median of {} rounds, one thread\n\
         lifting         {frames_per_sec:8.0} frames per second\n\
         networks alone  {of_networks:8.0} frames per second: ratio {ratio:.3}",
        args.rounds
    );
    let facts = json!({
        "n_frames": args.frames, "frames_per_sec": frames_per_sec, "frames_per_sec_networks": of_networks,
        "ratio": ratio,
    });
    Ok(Report { text, facts })
}

/// Inference for `n_frames` frames: a window and its mirror image, and two hands each.
fn networks(body: &BodyLifter, hands: &HandLifter, n_frames: usize) -> Result<()> {
    let config = body.net.config();
    let batches = |batch: usize| (0..2 * n_frames).step_by(batch).map(move |first| batch.min(2 * n_frames - first));
    for n in batches(BATCH.0) {
        let x = Tensor::ones((n, config.n_in, config.receptive_field()), DType::F32, &Device::Cpu)?;
        body.net.forward(&x, &mut Mode::Eval)?;
    }
    for n in batches(BATCH.1) {
        let x = Tensor::ones((n, hands.config().n_in), DType::F32, &Device::Cpu)?;
        hands.forward(&x, &mut Mode::Eval)?;
    }
    Ok(())
}

/// Keypoints of a rule-based speaker with noise and gaps, and a hand of one shape at each wrist.
fn rule_based_keypoints(n_frames: usize) -> Keypoints {
    let mut rng = ChaCha8Rng::seed_from_u64(1337);
    let scene = FilmedScene::from_rule(Filming::Training, n_frames, &mut rng);
    let shape = hand_shape::sample_shape(&mut rng);
    let none = Array3::zeros((n_frames, 21, 3));
    let mut keypoints = Keypoints {
        fps: FrameRate::new(15, 1),
        image_size: [1280, 720],
        hand_depth: None,
        body: Array3::zeros((n_frames, 17, 3)),
        left_hand: none.clone(),
        right_hand: none,
    };
    for (t, seen) in scene.seen.iter().enumerate() {
        for (point, coco) in COCO.into_iter().enumerate() {
            if let Some([x, y]) = seen[point] {
                keypoints.body.slice_mut(s![t, coco, ..]).assign(&ndarray::arr1(&[x, y, 0.9]));
            }
        }
        for (hand, wrist, flip) in
            [(&mut keypoints.right_hand, R_WRIST, 1.0), (&mut keypoints.left_hand, L_WRIST, -1.0)]
        {
            let Some([x, y]) = seen[wrist] else { continue };
            for (j, p) in shape.iter().enumerate() {
                let (dx, dy) = (flip * p[0] * scene.px_per_metre, p[1] * scene.px_per_metre);
                hand.slice_mut(s![t, j, ..]).assign(&ndarray::arr1(&[x + dx as f32, y + dy as f32, 0.9]));
            }
        }
    }
    keypoints
}
