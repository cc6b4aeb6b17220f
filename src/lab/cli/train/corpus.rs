//! Training motion of the two fixed motion spaces (`orator-lab train basis` and `orator-lab train embedding`).

use crate::mocap::upper_body;
use crate::train::space::corpus::Corpus;
use anyhow::{Context, Result, ensure};
use orator::cli::ui::Ui;
use orator_base::math::vec3;
use orator_base::stage::progress::Progress as _;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{N_JOINTS, NECK};
use orator_base::types::time::FrameRate;
use orator_test_support::drawn::figure::DrawnFigure;
use orator_test_support::drawn::gesture;
use orator_test_support::drawn::speech::Speech;
use orator_test_support::rule::dataset;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;

/// Number of one-minute clips of each kind of procedural speaker, and of additional ones for evaluation only.
const CLIPS: usize = 12;
const HELD_OUT: usize = 2;
const FPS: FrameRate = FrameRate::new(15, 1);
const CLIP_SECS: f64 = 60.0;

/// Sources of the motion.
#[derive(clap::Args)]
pub struct CorpusArgs {
    /// Captured motion: .bvh or .npz files, or folders of them; may be repeated.
    #[arg(long, value_name = "PATH", num_args = 1.., required = true)]
    mocap: Vec<PathBuf>,
    /// Takes to hold out from training and measure on, by name: patterns such as 'test_*'.
    #[arg(long, value_name = "PATTERN", num_args = 1..)]
    hold_out: Vec<String>,
    /// Random seed; equal seeds give equal results.
    #[arg(long, default_value_t = 1337)]
    pub seed: u64,
}

pub fn gather(args: &CorpusArgs, ui: &Ui) -> Result<Corpus> {
    let task = ui.begin("reading motion", 0);
    let takes = upper_body::read_all(&args.mocap).context("cannot read --mocap")?;
    let (held_out, mut takes) = upper_body::divide(takes, &args.hold_out)?;
    ensure!(!takes.is_empty(), "--hold-out selects every take: expected at least one take for training");
    takes.sort_by(|a, b| a.name.cmp(&b.name));
    task.detail("procedural speakers");
    let mut speakers = Vec::new();
    for seed in 0..CLIPS + HELD_OUT {
        let number = args.seed.wrapping_add(seed as u64);
        let clip = dataset::clips(CLIP_SECS / 3600.0, number, dataset::RULE, 0)?
            .into_iter()
            .next()
            .context("the synthetic speaker has no clip")?;
        speakers.push((format!("speaker {number}"), clip.motion()));
        speakers.push((format!("gestures {number}"), gestures(number)));
    }
    let others = speakers.split_off(2 * CLIPS);
    Corpus::new(&takes, &held_out, &speakers, &others, args.seed)
}

/// One minute of the drawn figure of `orator-lab demo`.
fn gestures(seed: u64) -> Motion {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let speech = Speech::new(CLIP_SECS, &mut rng);
    let gestures = gesture::DrawnGestures::new(&speech, &mut rng);
    let figures: Vec<DrawnFigure> =
        (0..FPS.frames_in(CLIP_SECS)).map(|t| DrawnFigure::new(&gestures.controls(FPS.secs(t)))).collect();
    let joints = ndarray::Array3::from_shape_fn((figures.len(), N_JOINTS, 3), |(t, joint, k)| {
        vec3::sub(figures[t].joints[joint], figures[t].joints[NECK])[k] as f32
    });
    Motion::from_joints(FPS, joints)
}
