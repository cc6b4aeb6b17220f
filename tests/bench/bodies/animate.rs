//! `cargo bench -- animate`.

use super::super::report::{Report, median};
use anyhow::{Result, ensure};
use orator_avatar::animate::avatar::{Appearance, Avatar};
use orator_avatar::animate::export::glb_scene;
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::stage::progress::Progress;
use orator_base::types::time::FrameRate;
use orator_test_support::drawn::speech::Speech;
use orator_test_support::rule::rule::RuleGestures;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::time::Instant;

/// Conversion of joints to animation on one core: smoothing, rotations and constraints, then the bytes of each file
/// format, which are not written to disk. The motion is that of the synthetic speaker, with missing hands.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Seconds of motion.
    #[arg(long, default_value_t = 300.0, value_name = "SECS")]
    secs: f64,
    /// Rounds; each measures every step once.
    #[arg(long, default_value_t = 5, value_name = "N")]
    rounds: usize,
    /// Frame rate of the output; the motion has 15 fps.
    #[arg(long, default_value_t = 15, value_name = "N")]
    fps: u32,
}

const FPS: FrameRate = FrameRate::new(15, 1);

pub(crate) fn run(args: &Args, progress: &dyn Progress) -> Result<Report> {
    ensure!(args.secs >= 1.0 && args.secs < 1e5, "--secs is {}, expected 1 to a hundred thousand", args.secs);
    ensure!(args.rounds > 0 && args.fps > 0, "nothing to measure: there must be rounds and frames per second");
    let mut rng = ChaCha8Rng::seed_from_u64(1337);
    let speech = Speech::new(args.secs, &mut rng);
    let mut motion =
        RuleGestures::with_variation(&speech, &[], args.secs, &mut rng).motion(FPS.frames_in(args.secs), FPS);
    for (t, mut frame) in motion.joints.outer_iter_mut().enumerate() {
        if t % 100 < 10 {
            frame.slice_mut(ndarray::s![8..28, ..]).fill(f32::NAN);
        }
    }
    let options = AnimationOptions { fps: Some(FrameRate::new(args.fps, 1)), ..AnimationOptions::default() };
    let task = progress.begin("animate", args.rounds as u64);
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut secs: [Vec<f64>; 4] = Default::default();
    let mut n_bytes = [0; 2];
    for _ in 0..args.rounds {
        let start = Instant::now();
        let performance = perform(&motion, None, &options);
        secs[0].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        n_bytes[0] = performance.clip.to_bvh().len();
        secs[1].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let avatar = one_core.install(|| Avatar::new(&performance.rig, &Appearance::plain()));
        secs[2].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        n_bytes[1] = glb_scene::file(&performance.rig, &performance.clip, &avatar, Names::Own).len();
        secs[3].push(start.elapsed().as_secs_f64());
        task.advance(1);
    }
    drop(task);
    let [perform_secs, bvh_secs, avatar_secs, glb_secs] = secs.map(median);
    let speed = |secs: f64| args.secs / secs;
    let total = speed(perform_secs + bvh_secs);
    let text = format!(
        "{:.0} s of motion at {FPS}, written at {} fps, one core, median of {} round(s)\n\
         joints to performance {:6.0} x real time\n\
         performance to BVH    {:6.0} x real time ({:.1} KiB a second)\n\
         joints to BVH         {total:6.0} x real time\n\
         the avatar, once      {avatar_secs:6.2} s\n\
         performance to GLB    {:6.0} x real time ({:.1} KiB a second)\n\
         avatar and GLB        {:6.0} x real time",
        args.secs,
        args.fps,
        args.rounds,
        speed(perform_secs),
        speed(bvh_secs),
        n_bytes[0] as f64 / 1024.0 / args.secs,
        speed(glb_secs),
        n_bytes[1] as f64 / 1024.0 / args.secs,
        speed(avatar_secs + glb_secs),
    );
    let facts = json!({
        "secs": args.secs,
        "fps": args.fps,
        "perform_times_real_time": speed(perform_secs),
        "bvh_times_real_time": speed(bvh_secs),
        "times_real_time": total,
        "avatar_secs": avatar_secs,
        "glb_times_real_time": speed(glb_secs),
        "glb_with_avatar_times_real_time": speed(avatar_secs + glb_secs),
    });
    Ok(Report { text, facts })
}
