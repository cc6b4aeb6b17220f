//! Additional speech of the demo's speaker without video: a dataset of the same person, voice and gestures, from which
//! a model is pre-trained before it is trained on the videos.

use super::host;
use anyhow::Result;
use orator_base::stage::progress::Progress;
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::{SAMPLE_RATE, sample_at};
use orator_base::types::split::Split;
use orator_dataset::info::{About, DatasetInfo};
use orator_dataset::write::assemble::DatasetWriter;
use orator_test_support::drawn::folder::{DATASET_FPS, DemoPlan};
use orator_test_support::drawn::scene::DrawnScene;
use orator_test_support::drawn::truth::DrawnTruth;
use orator_test_support::spoken_video::SpokenVideo;
use rayon::prelude::*;
use serde_json::json;
use std::path::Path;

/// Duration of a clip, seconds.
const CLIP_SECS: f64 = 30.0;
/// Number of validation clips; a single one would give too noisy an error.
const N_VALIDATION: usize = 8;
/// Number of the first clip, above those of all videos that a demo may have.
const FIRST: u64 = 500_000;
const SHARD_BYTES: u64 = 256 << 20;

/// Note in the dataset's card about its origin; a dataset with another note is a different one.
pub fn note(plan: &DemoPlan, is_rendered: bool, train_secs: f64) -> String {
    let figure = if is_rendered { "the rendered person" } else { "the figure in a suit of markers" };
    format!(
        "Joints of {figure} of seed {}, {train_secs} s to train on, not seen by any camera; pose2d is 0 everywhere.",
        plan.seed
    )
}

/// Writes the dataset with `train_secs` of training data into the existing, empty folder `dir`. Its speech occurs in
/// no video of the plan. `is_rendered`: of the rendered person, otherwise of the figure in a marker suit.
///
/// # Errors
/// A clip that cannot be generated or written.
pub fn write(
    dir: &Path,
    plan: &DemoPlan,
    is_rendered: bool,
    train_secs: f64,
    progress: &dyn Progress,
) -> Result<DatasetInfo> {
    let n_train = (train_secs / CLIP_SECS).ceil() as usize;
    let about = About {
        licence: "cc0-1.0".to_owned(),
        consent: "none needed: nobody is shown".to_owned(),
        source: "made by orator demo draw".to_owned(),
        notes: vec![note(plan, is_rendered, train_secs)],
        ..About::new("host", DATASET_FPS)
    };
    let writer = DatasetWriter::new(dir, about, SHARD_BYTES);
    let splits = (0..n_train + N_VALIDATION).map(|n| if n < n_train { Split::Train } else { Split::Validation });
    let clips: Vec<(u64, Split)> = (FIRST..).zip(splits).collect();
    let task = progress.begin("generate speech", clips.len() as u64);
    for batch in clips.chunks(16) {
        let spoken: Vec<SpokenVideo> =
            batch.par_iter().map(|(number, _)| clip(plan, is_rendered, *number)).collect::<Result<_>>()?;
        for ((_, split), spoken) in batch.iter().zip(spoken) {
            spoken.write(&writer, *split)?;
            task.advance(1);
        }
    }
    Ok(writer.finish()?.0)
}

fn clip(plan: &DemoPlan, is_rendered: bool, number: u64) -> Result<SpokenVideo> {
    let seed = plan.seed.wrapping_mul(1000).wrapping_add(number);
    let (motion, mut sound) = if is_rendered {
        let scene = host::scene(plan.seed.wrapping_mul(1000), seed, CLIP_SECS, DATASET_FPS);
        (Motion::from_joints(DATASET_FPS, scene.truth_without_pictures().joints), scene.sound().clone())
    } else {
        let scene = DrawnScene::new(seed, CLIP_SECS, plan.size);
        (DrawnTruth::new(&scene, DATASET_FPS).motion, scene.sound())
    };
    sound.samples.resize(sample_at(DATASET_FPS, SAMPLE_RATE, motion.n_frames()), 0.0);
    let name = format!("spoken-{number}");
    let content = blake3::hash(format!("orator demo, more speech {is_rendered} {seed}").as_bytes());
    let content = content.to_hex().to_string();
    Ok(SpokenVideo { name, content, motion, sound, words: None, posture: None, meta: json!({}) })
}
