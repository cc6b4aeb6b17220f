//! What is measured: clips of one rate, each the real motion, the made one of the same frames, and what was heard. Here
//! files become clips; a dataset and a speaker become them in `speaker`.

use super::pairs::FilePair;
use super::sound_features;
use super::sound_features::SoundFeatures;
use crate::external::ffmpeg::sound_stream::SoundStream;
use crate::mocap::motion_file;
use crate::motion::bones;
use crate::motion::resample;
use crate::types::pose3d::Motion;
use crate::types::skeleton::{N_JOINTS, NECK};
use crate::types::sound::SAMPLE_RATE;
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3, s};
use rayon::prelude::*;
use std::path::PathBuf;

/// Two lengths of one clip may differ by a second, or by this share of the longer.
const MOST_APART_SECS: f64 = 1.0;
const MOST_APART: f64 = 0.05;
/// Share of the real joints for which a prediction may have no number.
const MOST_MISSING: f64 = 0.05;
/// How far a neck may stand from the origin before it is moved there, metres.
const NECK_METRES: f32 = 1e-3;
/// Median bones this many times longer or shorter are in another unit.
const OTHER_UNIT: f64 = 2.5;

/// One clip.
#[derive(Clone, Debug)]
pub struct EvalClip {
    pub name: String,
    /// [T, 49, 3], metres, the neck at the origin.
    pub ground_truth: Array3<f32>,
    pub predicted: Array3<f32>,
    /// [T, 49]: what is compared: seen in the real motion.
    pub mask: Array2<bool>,
    pub features: Option<SoundFeatures>,
    /// Where its sound is, for whoever wants to hear it.
    pub voice: Option<ClipAudio>,
}

/// A sound that can be heard again.
#[derive(Clone, Debug)]
pub enum ClipAudio {
    File(PathBuf),
    /// 16 kHz.
    Kept(Vec<i16>),
}

impl ClipAudio {
    /// The 16 kHz samples from second `start` to `end`, fewer where the sound ends before.
    pub fn samples(&self, start: f64, end: f64) -> Result<Vec<i16>> {
        let at = |secs: f64| (secs.max(0.0) * f64::from(SAMPLE_RATE)).round() as usize;
        let (from, to) = (at(start), at(end));
        match self {
            Self::Kept(samples) => Ok(samples.get(from..to.min(samples.len())).unwrap_or_default().to_vec()),
            Self::File(path) => {
                let (mut n, mut samples) = (0, Vec::new());
                for piece in SoundStream::open(path, SAMPLE_RATE) {
                    let piece = piece?;
                    let wanted = from.saturating_sub(n).min(piece.len())..to.saturating_sub(n).min(piece.len());
                    samples.extend(piece[wanted].iter().copied().map(pcm));
                    n += piece.len();
                    if n >= to {
                        break;
                    }
                }
                Ok(samples)
            }
        }
    }
}

/// A sample of 16 bits.
pub fn pcm(sample: f32) -> i16 {
    (sample * 32_768.0).round().clamp(-32_768.0, 32_767.0) as i16
}

impl EvalClip {
    pub fn n_frames(&self) -> usize {
        self.mask.nrows()
    }
}

/// Clips of one rate.
#[derive(Clone, Debug)]
pub struct EvalClips {
    pub fps: FrameRate,
    pub clips: Vec<EvalClip>,
    /// What had to be assumed, changed or left out, in sentences.
    pub notes: Vec<String>,
    /// Whether the prediction's maker learnt from these very clips: then it can show nothing.
    pub learnt: bool,
}

impl EvalClips {
    pub fn n_frames(&self) -> usize {
        self.clips.iter().map(EvalClip::n_frames).sum()
    }

    pub fn secs(&self) -> f64 {
        self.fps.secs(self.n_frames())
    }

    /// Hash of the real motion, and of what of it is compared.
    pub fn truth(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for clip in &self.clips {
            let seen = clip.mask.indexed_iter().filter(|(_, seen)| **seen).map(|(place, _)| place);
            for (t, joint) in seen {
                for k in 0..3 {
                    hasher.update(&clip.ground_truth[[t, joint, k]].to_le_bytes());
                }
            }
            hasher.update(&clip.n_frames().to_le_bytes());
        }
        hasher.finalize().to_hex().as_str()[..16].to_owned()
    }

    pub fn have_sound(&self) -> bool {
        self.clips.iter().any(|clip| clip.features.is_some())
    }
}

/// Reads pairs of files at the rate of the first truth. `fps`: for files that do not say theirs.
///
/// # Errors
/// A file that is no motion; a prediction much longer or shorter than its truth, or with many missing joints. The
/// message names the clip and what to do.
pub fn read(pairs: &[FilePair], fps: Option<FrameRate>) -> Result<EvalClips> {
    let first = pairs.first().context("there is no pair to measure")?;
    let rate = motion_file::read(&first.truth, fps)?.motion.fps;
    let clip = |pair: &FilePair| clip(pair, fps, rate).with_context(|| format!("clip {}", pair.name));
    let read: Vec<(EvalClip, Vec<String>)> = pairs.par_iter().map(clip).collect::<Result<_>>()?;
    let (clips, notes): (Vec<EvalClip>, Vec<Vec<String>>) = read.into_iter().unzip();
    Ok(EvalClips { fps: rate, clips, notes: notes.into_iter().flatten().collect(), learnt: false })
}

fn clip(pair: &FilePair, given: Option<FrameRate>, fps: FrameRate) -> Result<(EvalClip, Vec<String>)> {
    let mut notes = Vec::new();
    let mut side = |path: &PathBuf, what: &str| -> Result<Motion> {
        let read = motion_file::read(path, given)?;
        notes.extend(read.notes);
        let mut motion = read.motion;
        if motion.fps != fps {
            notes.push(format!("{}: the {what} at {} was resampled to {fps}", pair.name, motion.fps));
            motion = resample::at_rate(&motion, fps);
        }
        if let Some(far) = neck_to_origin(&mut motion) {
            notes.push(format!("{}: the {what}'s neck stands {far:.2} m from the origin: moved there", pair.name));
        }
        Ok(motion)
    };
    let (mut ground_truth, predicted) = (side(&pair.truth, "truth")?, side(&pair.prediction, "prediction")?);
    let (n_ground_truth, n_predicted) = (ground_truth.n_frames(), predicted.n_frames());
    let (real_secs, made_secs) = (fps.secs(n_ground_truth), fps.secs(n_predicted));
    let apart = (real_secs - made_secs).abs();
    ensure!(
        apart <= MOST_APART_SECS.max(MOST_APART * real_secs.max(made_secs)),
        "the truth lasts {real_secs:.2} s ({n_ground_truth} frames at {fps}) and the prediction {made_secs:.2} s ({n_predicted} frames): \
         more than a second and 5 % apart, so they are not of the same sound, or a rate is wrong (--fps)"
    );
    let n_frames = n_ground_truth.min(n_predicted);
    if n_ground_truth != n_predicted {
        notes.push(format!(
            "{}: {n_ground_truth} frames of truth, {n_predicted} of prediction: cut to {n_frames}",
            pair.name
        ));
    }
    notes.extend(other_unit(&ground_truth, &predicted).map(|note| format!("{}: {note}", pair.name)));
    ground_truth.mask = ground_truth.mask.slice(s![..n_frames, ..]).to_owned();
    let (ground_truth_joints, mut predicted_joints) =
        (cut(ground_truth.joints, n_frames), cut(predicted.joints, n_frames));
    let (mask, n_missing) = compared(&ground_truth_joints, &ground_truth.mask, &mut predicted_joints);
    let n_seen = ground_truth.mask.iter().filter(|seen| **seen).count().max(1);
    let share = n_missing as f64 / n_seen as f64;
    ensure!(
        share <= MOST_MISSING,
        "the prediction {} has no number (NaN) for {:.1} % of the joints that the truth has: at most {:.0} % can be \
         held over, or a prediction could leave out what it cannot do",
        pair.prediction.display(),
        100.0 * share,
        100.0 * MOST_MISSING
    );
    if n_missing > 0 {
        notes.push(format!(
            "{}: the prediction has no number (NaN) for {n_missing} of {n_seen} joints: each counts as where it was last",
            pair.name
        ));
    }
    let features = match &pair.sound {
        Some(path) => sound_features::extract(path, fps, n_frames)?,
        None => None,
    };
    if let (Some(path), features) = (&pair.sound, &features) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let secs = fps.secs(n_frames);
        match features {
            None => notes.push(format!("{name} holds no sound: {} is not part of what needs sound", pair.name)),
            Some(features) => ensure!(
                features.secs >= secs - MOST_APART_SECS.max(MOST_APART * secs),
                "{} lasts {:.2} s, the motion {secs:.2} s: is it the sound of another clip?",
                path.display(),
                features.secs
            ),
        }
    }
    let voice = pair.sound.clone().filter(|_| features.is_some()).map(ClipAudio::File);
    Ok((
        EvalClip {
            name: pair.name.clone(),
            ground_truth: ground_truth_joints,
            predicted: predicted_joints,
            mask,
            features,
            voice,
        },
        notes,
    ))
}

fn cut(joints: Array3<f32>, n_frames: usize) -> Array3<f32> {
    if joints.shape()[0] == n_frames { joints } else { joints.slice(s![..n_frames, .., ..]).to_owned() }
}

/// What is compared: the real joints that are seen. Where the made motion has no number it is held where it was last (before
/// its first number, at the neck); at how many of the compared places is told.
pub fn compared(ground_truth: &Array3<f32>, seen: &Array2<bool>, predicted: &mut Array3<f32>) -> (Array2<bool>, usize) {
    let there = |joints: &Array3<f32>, t: usize, joint: usize| (0..3).all(|k| joints[[t, joint, k]].is_finite());
    let mask = Array2::from_shape_fn(seen.raw_dim(), |(t, joint)| seen[[t, joint]] && there(ground_truth, t, joint));
    let mut n_missing = 0;
    for ((t, joint), wanted) in mask.indexed_iter() {
        if !there(predicted, t, joint) {
            n_missing += usize::from(*wanted);
            (0..3).for_each(|k| predicted[[t, joint, k]] = if t > 0 { predicted[[t - 1, joint, k]] } else { 0.0 });
        }
    }
    (mask, n_missing)
}

/// Takes the neck off all joints of a frame; how far it stood away at most, where that is worth a word.
fn neck_to_origin(motion: &mut Motion) -> Option<f32> {
    let mut far = 0.0f32;
    for mut frame in motion.joints.outer_iter_mut() {
        let neck: [f32; 3] = std::array::from_fn(|k| frame[[NECK, k]]);
        let length = neck.iter().map(|v| v * v).sum::<f32>().sqrt();
        if length.is_finite() && length > NECK_METRES {
            far = far.max(length);
            for joint in 0..N_JOINTS {
                (0..3).for_each(|k| frame[[joint, k]] -= neck[k]);
            }
        }
    }
    (far > 0.0).then_some(far)
}

/// A word where the made bones are so much longer or shorter that they must be in another unit.
fn other_unit(ground_truth: &Motion, predicted: &Motion) -> Option<String> {
    let size = |motion: &Motion| bones::measure(motion).iter().take(6).map(|v| f64::from(*v)).sum::<f64>();
    let times = size(predicted) / size(ground_truth);
    (times.is_finite() && times > 0.0 && !(1.0 / OTHER_UNIT..OTHER_UNIT).contains(&times))
        .then(|| format!("the prediction's arms are {times:.2} times as long as the truth's: are both in metres?"))
}
