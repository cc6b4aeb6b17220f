//! What is measured beside each other: the trained speaker, and three that know less. `mean pose` does nothing;
//! `nearest neighbour` copies; `mismatched` is the trained speaker hearing another sound, so that what it gains over that
//! one it owes to the sound.

use super::held_out::HeldOut;
use super::neighbour;
use crate::dataset::{Dataset, sync};
use crate::generate::Speaker;
use crate::train::poses::{N_NUMBERS, Normalisation};
use crate::types::pose3d::Motion;
use crate::types::skeleton::N_JOINTS;
use crate::types::sound::{SAMPLE_RATE, Sound};
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3, s};

/// Names in the table.
pub const MODEL: &str = "model";
pub const MEAN_POSE: &str = "mean pose";
pub const NEIGHBOUR: &str = "nearest neighbour";
pub const MISMATCHED: &str = "mismatched";

/// A predictor's motion for every held-out interval, each as long as the interval.
pub struct Predicted {
    pub name: &'static str,
    pub motions: Vec<Motion>,
}

/// The trained speaker's motion for one sound, exactly `n_frames` long.
pub fn motion(speaker: &Speaker, sound: &Sound, n_frames: usize) -> Result<Motion> {
    let wanted = sync::sample_at(speaker.fps(), SAMPLE_RATE, n_frames) + 1;
    let mut sound = sound.clone();
    sound.samples.resize(sound.samples.len().max(wanted), 0.0);
    let made = speaker.motion(&sound)?;
    ensure!(made.n_frames() >= n_frames, "{} frames of motion for {n_frames} of sound", made.n_frames());
    Ok(Motion::from_joints(made.fps, made.joints.slice(s![..n_frames, .., ..]).to_owned()))
}

/// All predictors, the model first; the nearest neighbour is left out where the training split is too short for it.
pub fn predict(
    dataset: &Dataset,
    speaker: &Speaker,
    normal: &Normalisation,
    held_out: &[HeldOut],
) -> Result<Vec<Predicted>> {
    let for_sounds = |sounds: &[Sound]| -> Result<Vec<Motion>> {
        let of = |(interval, sound): (&HeldOut, &Sound)| {
            motion(speaker, sound, interval.real.n_frames()).with_context(|| format!("no motion for {}", interval.key))
        };
        held_out.iter().zip(sounds).map(of).collect()
    };
    let own: Vec<Sound> = held_out.iter().map(|interval| interval.sound.clone()).collect();
    let still = |interval: &HeldOut| mean_pose(normal, speaker.fps(), interval.real.n_frames());
    let mut predicted = vec![
        Predicted { name: MODEL, motions: for_sounds(&own)? },
        Predicted { name: MEAN_POSE, motions: held_out.iter().map(still).collect() },
    ];
    if let Some(motions) = neighbour::motions(dataset, normal, held_out)? {
        predicted.push(Predicted { name: NEIGHBOUR, motions });
    }
    predicted.push(Predicted { name: MISMATCHED, motions: for_sounds(&turned(&own))? });
    Ok(predicted)
}

/// The mean of the training split in every frame.
fn mean_pose(normal: &Normalisation, fps: FrameRate, n_frames: usize) -> Motion {
    let pose: Array3<f32> = normal.joints(Array2::zeros((N_NUMBERS, 1)).view());
    let joints = Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(_, joint, k)| pose[[0, joint, k]]);
    Motion::from_joints(fps, joints)
}

/// Every sound replaced by what is heard half of the held-out sound later (and from the beginning again), as long as it
/// was: the furthest away, and most often another video.
fn turned(sounds: &[Sound]) -> Vec<Sound> {
    let all: Vec<f32> = sounds.iter().flat_map(|sound| sound.samples.iter().copied()).collect();
    let mut at = all.len() / 2;
    let mut turned = Vec::with_capacity(sounds.len());
    for sound in sounds {
        let samples = (at..at + sound.samples.len()).map(|i| all[i % all.len()]).collect();
        turned.push(Sound { rate: sound.rate, samples });
        at += sound.samples.len();
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sound_becomes_another_one_of_its_length() {
        let sound = |samples: &[f32]| Sound { rate: SAMPLE_RATE, samples: samples.to_vec() };
        let turned = turned(&[sound(&[1.0, 2.0, 3.0]), sound(&[]), sound(&[4.0, 5.0, 6.0])]);
        assert_eq!(turned, [sound(&[4.0, 5.0, 6.0]), sound(&[]), sound(&[1.0, 2.0, 3.0])]);
        assert_eq!(super::turned(&[sound(&[])]), [sound(&[])]);
    }
}
