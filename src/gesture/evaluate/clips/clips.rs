//! Evaluation clips of one frame rate: ground truth, prediction of the same frames, and sound features. This file reads
//! them from files; `from_checkpoints` generates them with checkpoints from a dataset.

use super::motion_store::{MotionStore, StoredMotion};
use super::pairs::FilePair;
use super::sound_features::{self, SoundFeatures};
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3, s};
use orator_base::input;
use orator_base::motion::{bones, resample, units};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::PostureChannel;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, NECK, is_duplicate};
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_dataset::Dataset;
use orator_dataset::index::SampleRef;
use orator_formats::mocap::motion_file;
use orator_formats::wav;
use orator_media::ffmpeg::sound_stream::SoundStream;
use rayon::prelude::*;
use std::os::unix::fs::FileExt as _;
use std::path::PathBuf;

/// Largest accepted difference in length of the files of a clip, seconds, unless `MAX_LENGTH_DIFFERENCE` allows more.
const MAX_LENGTH_DIFFERENCE_SECS: f64 = 1.0;
/// Largest accepted difference in length of the files of a clip as a share of the longer one.
const MAX_LENGTH_DIFFERENCE: f64 = 0.05;
/// Largest share of the ground-truth joints that may be missing in a prediction.
const MAX_MISSING: f64 = 0.05;
/// Largest distance of the neck from the origin, metres, that is not corrected.
const NECK_METRES: f32 = 1e-3;
/// Ratio of median bone lengths from which another unit is assumed.
const OTHER_UNIT: f64 = 2.5;

#[derive(Clone, Debug)]
pub struct EvalClip {
    pub name: String,
    /// Joints [T, 49, 3], metres, the neck at the origin. Clips with posture channels also have head and trunk as rows
    /// 49 and 50: yaw, pitch and roll in radians, NaN where not visible.
    pub ground_truth: StoredMotion,
    pub predicted: StoredMotion,
    /// Mask [T, 49] of the compared joints, which are those visible in the ground truth.
    pub mask: Array2<bool>,
    pub features: Option<SoundFeatures>,
    /// Sound for the player of the report.
    pub audio: Option<ClipAudio>,
}

/// Location of the sound of a clip, from which it can be read again.
#[derive(Clone, Debug)]
pub enum ClipAudio {
    File(PathBuf),
    /// 16-bit samples at 16 kHz in a file, starting at byte `offset`.
    Within {
        path: PathBuf,
        offset: u64,
        n_samples: usize,
    },
}

impl ClipAudio {
    pub fn of_sample(dataset: &Dataset, sample: &SampleRef) -> Self {
        Self::Within {
            path: dataset.dir().join(&sample.shard),
            offset: sample.wav.offset + wav::HEADER_BYTES as u64,
            n_samples: sample.n_sound_samples(),
        }
    }

    /// Samples at 16 kHz from second `start` to `end`; fewer if the sound ends earlier.
    pub fn samples(&self, start: f64, end: f64) -> Result<Vec<i16>> {
        let at = |secs: f64| (secs.max(0.0) * f64::from(SAMPLE_RATE)).round() as usize;
        let (from, to) = (at(start), at(end));
        match self {
            Self::Within { path, offset, n_samples } => {
                let (from, to) = (from.min(*n_samples), to.min(*n_samples));
                let reading = || format!("reading {}", path.display());
                let mut bytes = vec![0; 2 * to.saturating_sub(from)];
                let file = input::open(path).with_context(reading)?;
                file.read_exact_at(&mut bytes, offset + 2 * from as u64).with_context(reading)?;
                Ok(bytes.chunks_exact(2).map(|pair| i16::from_le_bytes([pair[0], pair[1]])).collect())
            }
            Self::File(path) => {
                let (mut n, mut samples) = (0, Vec::new());
                for piece in SoundStream::open(path, SAMPLE_RATE) {
                    let piece = piece?;
                    let range = from.saturating_sub(n).min(piece.len())..to.saturating_sub(n).min(piece.len());
                    samples.extend(piece[range].iter().copied().map(pcm));
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

fn pcm(sample: f32) -> i16 {
    (sample * 32_768.0).round().clamp(-32_768.0, 32_767.0) as i16
}

impl EvalClip {
    pub fn n_frames(&self) -> usize {
        self.mask.nrows()
    }
}

#[derive(Clone, Debug)]
pub struct EvalClips {
    pub fps: FrameRate,
    pub clips: Vec<EvalClip>,
    /// Assumptions, changes and omissions, one sentence each.
    pub notes: Vec<String>,
    /// Whether the model was trained on these clips, so that the metrics measure memorisation.
    pub trained_on: bool,
    /// Posture channels that are compared in addition to the joints.
    pub channels: Vec<PostureChannel>,
}

impl EvalClips {
    pub fn n_frames(&self) -> usize {
        self.clips.iter().map(EvalClip::n_frames).sum()
    }

    pub fn secs(&self) -> f64 {
        self.fps.secs(self.n_frames())
    }

    /// Hash of the ground truth and of its compared joints.
    pub fn truth(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for clip in &self.clips {
            let seen = clip.mask.indexed_iter().filter(|(_, seen)| **seen).map(|(index, _)| index);
            for (t, joint) in seen {
                for k in 0..3 {
                    hasher.update(&clip.ground_truth[[t, joint, k]].to_le_bytes());
                }
            }
            for angle in clip.ground_truth.view().slice(s![.., N_JOINTS.., ..]) {
                hasher.update(&angle.to_le_bytes());
            }
            hasher.update(&clip.n_frames().to_le_bytes());
        }
        hasher.finalize().to_hex().as_str()[..16].to_owned()
    }

    /// Whether any finger joint is compared in any frame.
    pub fn have_fingers(&self) -> bool {
        let is_finger = |joint: usize| joint > L_HAND && !is_duplicate(joint);
        let seen = |clip: &EvalClip| clip.mask.indexed_iter().any(|((_, joint), seen)| *seen && is_finger(joint));
        self.clips.iter().any(seen)
    }

    pub fn have_sound(&self) -> bool {
        self.clips.iter().any(|clip| clip.features.is_some())
    }
}

/// Reads pairs of files, resampled to the frame rate of the first ground truth. `fps` is the rate of files without one.
///
/// # Errors
/// A file without motion; a prediction much longer or shorter than its ground truth, or with many missing joints. The
/// message names the clip and a remedy.
pub fn read(pairs: &[FilePair], fps: Option<FrameRate>, store: &MotionStore) -> Result<EvalClips> {
    let first = pairs.first().context("no pair of truth and prediction")?;
    let rate = motion_file::read(&first.truth, fps)?.motion.fps;
    let clip = |pair: &FilePair| clip(pair, fps, rate, store).with_context(|| format!("clip {}", pair.name));
    let read: Vec<(EvalClip, Vec<String>)> = pairs.par_iter().map(clip).collect::<Result<_>>()?;
    let (clips, notes): (Vec<EvalClip>, Vec<Vec<String>>) = read.into_iter().unzip();
    Ok(EvalClips {
        fps: rate,
        clips,
        notes: notes.into_iter().flatten().collect(),
        trained_on: false,
        channels: Vec::new(),
    })
}

fn clip(
    pair: &FilePair,
    given: Option<FrameRate>,
    fps: FrameRate,
    store: &MotionStore,
) -> Result<(EvalClip, Vec<String>)> {
    let mut notes = Vec::new();
    let mut side = |path: &PathBuf, what: &str| -> Result<Motion> {
        let read = motion_file::read(path, given)?;
        units::check(&read.motion).with_context(|| path.display().to_string())?;
        notes.extend(read.notes);
        if let Some(given) = given.filter(|given| read.has_rate && *given != read.motion.fps) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            notes.push(format!("{name} has {}: {given} (--input-fps) is ignored for this file", read.motion.fps));
        }
        let mut motion = read.motion;
        if motion.fps != fps {
            notes.push(format!("{}: the {what} at {} was resampled to {fps}", pair.name, motion.fps));
            motion = resample::at_rate(&motion, fps);
        }
        if let Some(distance) = neck_to_origin(&mut motion) {
            notes.push(format!(
                "{}: the neck of the {what} is up to {distance:.2} m from the origin: moved there",
                pair.name
            ));
        }
        Ok(motion)
    };
    let (mut ground_truth, predicted) = (side(&pair.truth, "truth")?, side(&pair.prediction, "prediction")?);
    let (n_ground_truth, n_predicted) = (ground_truth.n_frames(), predicted.n_frames());
    let (truth_secs, predicted_secs) = (fps.secs(n_ground_truth), fps.secs(n_predicted));
    let difference = (truth_secs - predicted_secs).abs();
    ensure!(
        difference <= MAX_LENGTH_DIFFERENCE_SECS.max(MAX_LENGTH_DIFFERENCE * truth_secs.max(predicted_secs)),
        "the truth lasts {truth_secs:.2} s ({n_ground_truth} frames at {fps}) and the prediction {predicted_secs:.2} s ({n_predicted} frames): \
         expected lengths that differ by at most 1 s or 5 %; check that both are of the same audio, and the frame rates (--input-fps)"
    );
    let n_frames = n_ground_truth.min(n_predicted);
    if n_ground_truth != n_predicted {
        notes.push(format!(
            "{}: the truth has {n_ground_truth} frames, the prediction {n_predicted}: both were cut to {n_frames}",
            pair.name
        ));
    }
    notes.extend(other_unit(&ground_truth, &predicted).map(|note| format!("{}: {note}", pair.name)));
    ground_truth.mask = ground_truth.mask.slice(s![..n_frames, ..]).to_owned();
    let [ground_truth_joints, mut predicted_joints] =
        [ground_truth.joints, predicted.joints].map(|joints| joints.slice_move(s![..n_frames, .., ..]));
    let (mask, n_missing) = compared(&ground_truth_joints, &ground_truth.mask, &mut predicted_joints);
    let n_visible = ground_truth.mask.iter().filter(|seen| **seen).count().max(1);
    let share = n_missing as f64 / n_visible as f64;
    ensure!(
        share <= MAX_MISSING,
        "the prediction {} is NaN for {:.1} % of the joints that are visible in the truth: at most {:.0} % may be \
         missing",
        pair.prediction.display(),
        100.0 * share,
        100.0 * MAX_MISSING
    );
    if n_missing > 0 {
        notes.push(format!(
            "{}: the prediction is NaN for {n_missing} of {n_visible} joints: their last positions are used",
            pair.name
        ));
    }
    let mut features = None;
    if let Some(path) = &pair.sound {
        features = sound_features::extract(path, fps, n_frames)?;
        let secs = fps.secs(n_frames);
        match &features {
            None => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                notes.push(format!("{name} has no audio: {} is left out of metrics that need audio", pair.name));
            }
            Some(features) => ensure!(
                features.secs >= secs - MAX_LENGTH_DIFFERENCE_SECS.max(MAX_LENGTH_DIFFERENCE * secs),
                "{} lasts {:.2} s, the motion {secs:.2} s: is it the audio of another clip?",
                path.display(),
                features.secs
            ),
        }
    }
    let audio = pair.sound.clone().filter(|_| features.is_some()).map(ClipAudio::File);
    Ok((
        EvalClip {
            name: pair.name.clone(),
            ground_truth: store.keep(ground_truth_joints)?,
            predicted: store.keep(predicted_joints)?,
            mask,
            features,
            audio,
        },
        notes,
    ))
}

/// Mask of the compared joints, which are those visible in the ground truth, and the number of them that are missing in
/// the prediction. Missing predicted joints are replaced by their last position (before the first: by the neck's).
pub fn compared(ground_truth: &Array3<f32>, seen: &Array2<bool>, predicted: &mut Array3<f32>) -> (Array2<bool>, usize) {
    let is_present = |joints: &Array3<f32>, t: usize, joint: usize| (0..3).all(|k| joints[[t, joint, k]].is_finite());
    let mask =
        Array2::from_shape_fn(seen.raw_dim(), |(t, joint)| seen[[t, joint]] && is_present(ground_truth, t, joint));
    let mut n_missing = 0;
    for ((t, joint), range) in mask.indexed_iter() {
        if !is_present(predicted, t, joint) {
            n_missing += usize::from(*range);
            (0..3).for_each(|k| predicted[[t, joint, k]] = if t > 0 { predicted[[t - 1, joint, k]] } else { 0.0 });
        }
    }
    (mask, n_missing)
}

/// Moves the neck to the origin; returns its largest distance from the origin, if it was more than `NECK_METRES`.
fn neck_to_origin(motion: &mut Motion) -> Option<f32> {
    let mut distance = 0.0f32;
    for mut frame in motion.joints.outer_iter_mut() {
        let neck: [f32; 3] = std::array::from_fn(|k| frame[[NECK, k]]);
        let length = neck.iter().map(|v| v * v).sum::<f32>().sqrt();
        if length.is_finite() && length > NECK_METRES {
            distance = distance.max(length);
            for joint in 0..N_JOINTS {
                (0..3).for_each(|k| frame[[joint, k]] -= neck[k]);
            }
        }
    }
    (distance > 0.0).then_some(distance)
}

/// Note if the bone lengths of the prediction indicate another unit.
fn other_unit(ground_truth: &Motion, predicted: &Motion) -> Option<String> {
    let size = |motion: &Motion| bones::measure(motion).iter().take(6).map(|v| f64::from(*v)).sum::<f64>();
    let ratio = size(predicted) / size(ground_truth);
    (ratio.is_finite() && ratio > 0.0 && !(1.0 / OTHER_UNIT..OTHER_UNIT).contains(&ratio)).then(|| {
        format!("the arms of the prediction are {ratio:.2} times as long as those of the truth: are both in metres?")
    })
}
