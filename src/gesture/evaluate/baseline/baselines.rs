//! Baselines for the prediction: two constant poses, the nearest neighbour by sound (copying), mismatched motion
//! (realistic, but unrelated to the sound), and the ground truth itself, which bounds every metric.

use super::constant_pose::ConstantPoses;
use super::predictor::{self, Library, Query};
use crate::evaluate::clips::clips::{EvalClip, EvalClips};
use crate::evaluate::clips::motion_store::{MotionStore, StoredMotion};
use anyhow::Result;
use ndarray::{Array2, Array3, ArrayView3, s};
use serde::Serialize;

/// Smallest time shift of a mismatched motion, seconds.
const MIN_SHIFT_SECS: f64 = 3.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PredictorKind {
    Prediction,
    MeanPose,
    MedianPose,
    NearestNeighbour,
    MismatchedPrediction,
    /// The clip's own prediction, shifted in time.
    LatePrediction,
    MismatchedTruth,
    /// One half of the ground truth against the other.
    TruthHalves,
    Truth,
}

impl PredictorKind {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Prediction => "prediction",
            Self::MeanPose => "mean pose",
            Self::MedianPose => "median pose",
            Self::NearestNeighbour => "nearest neighbour",
            Self::MismatchedPrediction => "mismatched prediction",
            Self::LatePrediction => "late prediction",
            Self::MismatchedTruth => "mismatched truth",
            Self::TruthHalves => "truth halves",
            Self::Truth => "truth",
        }
    }

    pub fn key(self) -> String {
        self.name().replace(' ', "_")
    }
}

/// One of several checkpoints that are evaluated together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NumberedCheckpoint {
    /// Number, starting at 1.
    pub number: usize,
    pub name: String,
}

impl NumberedCheckpoint {
    /// Human-readable name of a predictor; `checkpoint` is given if there are several.
    pub fn name_of(kind: PredictorKind, checkpoint: Option<&Self>) -> String {
        match (kind, checkpoint) {
            (PredictorKind::Prediction, Some(of)) => of.name.clone(),
            (PredictorKind::MismatchedPrediction, Some(of)) => format!("mismatched {}", of.name),
            _ => kind.name().to_owned(),
        }
    }

    /// Key of a predictor in a result file; that of the first checkpoint is the same as for a single one.
    pub fn key_of(kind: PredictorKind, checkpoint: Option<&Self>) -> String {
        match checkpoint {
            Some(of) if of.number > 1 => format!("{}_{}", kind.key(), of.number),
            _ => kind.key(),
        }
    }
}

#[derive(Clone, Debug)]
pub enum ClipMotion {
    Prediction,
    GroundTruth,
    /// Constant pose [49, 3].
    Constant(Array2<f32>),
    /// Joints [T, 49, 3].
    Motion(StoredMotion),
}

#[derive(Clone, Debug)]
pub struct Predictor {
    pub kind: PredictorKind,
    /// Checkpoint that generated the motion, if several are evaluated.
    pub checkpoint: Option<NumberedCheckpoint>,
    /// Description in one sentence.
    pub description: String,
    pub motions: Vec<ClipMotion>,
}

impl Predictor {
    /// Predictor that does not belong to one of several checkpoints.
    pub fn new(kind: PredictorKind, description: String, motions: Vec<ClipMotion>) -> Self {
        Self { kind, checkpoint: None, description, motions }
    }

    /// Motion for a clip, cut or repeated to its length.
    pub fn motion<'a>(&'a self, clips: &'a EvalClips, clip: usize) -> Option<ArrayView3<'a, f32>> {
        let of = clips.clips.get(clip)?;
        match self.motions.get(clip)? {
            ClipMotion::Prediction => Some(of.predicted.view()),
            ClipMotion::GroundTruth => Some(of.ground_truth.view()),
            ClipMotion::Constant(pose) => pose.broadcast((of.n_frames(), pose.nrows(), 3)),
            ClipMotion::Motion(joints) => Some(joints.view()),
        }
    }

    /// Replaces missing values by the constant poses of `fallback`.
    pub fn filled(mut self, fallback: &Self, store: &MotionStore) -> Result<Self> {
        for (predicted, fallback) in self.motions.iter_mut().zip(&fallback.motions) {
            if let (ClipMotion::Motion(motion), ClipMotion::Constant(pose)) = (predicted, fallback)
                && motion.view().iter().any(|v| !v.is_finite())
            {
                let mut joints = motion.view().to_owned();
                for mut frame in joints.outer_iter_mut() {
                    frame.zip_mut_with(pose, |v, fallback| *v = if v.is_finite() { *v } else { *fallback });
                }
                *motion = store.keep(joints)?;
            }
        }
        Ok(self)
    }

    pub fn prediction(clips: &EvalClips, description: &str) -> Self {
        let motions = vec![ClipMotion::Prediction; clips.clips.len()];
        Self::new(PredictorKind::Prediction, description.to_owned(), motions)
    }

    pub fn truth(clips: &EvalClips) -> Self {
        let description = "the ground truth compared with itself, which bounds the values of the others".to_owned();
        Self::new(PredictorKind::Truth, description, vec![ClipMotion::GroundTruth; clips.clips.len()])
    }
}

/// Baselines that can be computed from files, and a note for each that is left out.
pub fn from_files(clips: &EvalClips, store: &MotionStore) -> Result<(Vec<Predictor>, Vec<String>)> {
    let (mut all, mut left_out) = (constant_poses(clips), Vec::new());
    match neighbours(clips, &all[0], store)? {
        Some(predictor) => all.push(predictor),
        None => left_out.push(format!(
            "{}: left out, since {}",
            PredictorKind::NearestNeighbour.name(),
            match (clips.have_sound(), clips.clips.len()) {
                (false, _) => "it needs audio (--audio)",
                (true, 1) => "there is no other clip to copy from",
                (true, _) if clips.clips.iter().any(|clip| clip.features.is_none()) => "not every clip has audio",
                (true, _) => "no other clip is long enough to copy from",
            }
        )),
    }
    for kind in [PredictorKind::MismatchedPrediction, PredictorKind::MismatchedTruth] {
        match mismatched(clips, kind, &all[0], store)? {
            Some(predictor) => all.push(predictor),
            None => left_out.push(too_short(kind)),
        }
        if kind == PredictorKind::MismatchedPrediction && clips.clips.len() > 1 {
            all.push(late_prediction(clips, &all[0], store)?);
        }
    }
    Ok((all, left_out))
}

/// Each clip's own prediction, shifted by half of the clip with wrap-around. Unlike the motion of another clip it has
/// the right posture, and only its timing is wrong.
fn late_prediction(clips: &EvalClips, fallback: &Predictor, store: &MotionStore) -> Result<Predictor> {
    let of = |clip: &EvalClip| {
        let n_frames = clip.n_frames();
        let later = (0..n_frames).map(|t| (t + n_frames / 2) % n_frames);
        Ok(ClipMotion::Motion(store.keep(select_frames(&clip.predicted, later))?))
    };
    let description = "the clip's own prediction, shifted by half of the clip with wrap-around".to_owned();
    let motions = clips.clips.iter().map(of).collect::<Result<_>>()?;
    Predictor::new(PredictorKind::LatePrediction, description, motions).filled(fallback, store)
}

/// Note that a mismatched motion is left out because the only clip is too short.
pub fn too_short(kind: PredictorKind) -> String {
    format!("{}: left out, since the only clip is shorter than {:.0} s", kind.name(), 2.0 * MIN_SHIFT_SECS)
}

/// Mean and median pose of the other clips; for a single clip those of its own ground truth, which no predictor knows.
fn constant_poses(clips: &EvalClips) -> Vec<Predictor> {
    let mut all = ConstantPoses::default();
    clips.clips.iter().for_each(|clip| all.add(clip.ground_truth.view(), clip.mask.view()));
    let is_single = clips.clips.len() == 1;
    let (mut means, mut medians) = (Vec::new(), Vec::new());
    for clip in &clips.clips {
        if !is_single {
            all.subtract(clip.ground_truth.view(), clip.mask.view());
        }
        let (mut mean, mut median) = (all.mean(), all.median());
        if !is_single {
            all.add(clip.ground_truth.view(), clip.mask.view());
            // Joints that are not visible in any other clip come from the clip itself.
            fill_missing(&mut mean, || all.mean());
            fill_missing(&mut median, || all.median());
        }
        means.push(ClipMotion::Constant(mean));
        medians.push(ClipMotion::Constant(median));
    }
    let description = |what: &str| {
        if is_single {
            format!("the {what} of this clip's truth in every frame (an oracle: predictors do not have the truth)")
        } else {
            format!("the {what} of the other clips' truths in every frame")
        }
    };
    vec![
        Predictor::new(PredictorKind::MeanPose, description("mean pose"), means),
        Predictor::new(PredictorKind::MedianPose, description("median pose"), medians),
    ]
}

fn fill_missing(pose: &mut Array2<f32>, from: impl FnOnce() -> Array2<f32>) {
    if pose.iter().any(|v| v.is_nan()) {
        pose.zip_mut_with(&from(), |v, other| *v = if v.is_nan() { *other } else { *v });
    }
}

fn neighbours(clips: &EvalClips, fallback: &Predictor, store: &MotionStore) -> Result<Option<Predictor>> {
    let query: Option<Vec<Query>> = clips
        .clips
        .iter()
        .map(|clip| clip.features.as_ref().map(|features| Query { rows: &features.rows, n_frames: clip.n_frames() }))
        .collect();
    let Some(query) = query.filter(|query| query.len() > 1) else { return Ok(None) };
    let library = Library {
        n: clips.clips.len(),
        excludes_self: true,
        features: &|entry| {
            let clip = &clips.clips[entry];
            Ok(clip.features.as_ref().map(|features| (features.rows.clone(), clip.n_frames())))
        },
        joints: &|entry, frames| Ok(clips.clips[entry].ground_truth.view().slice_move(s![frames, .., ..]).to_owned()),
    };
    let Some(predicted) = predictor::motions(&query, &library, clips.fps, store)? else { return Ok(None) };
    let description = "for each 4 s of audio the motion of the most similar audio in another clip".to_owned();
    let motions = predicted.into_iter().map(ClipMotion::Motion).collect();
    Ok(Some(Predictor::new(PredictorKind::NearestNeighbour, description, motions).filled(fallback, store)?))
}

/// For each clip the motion of another one (predicted, or the ground truth for `MismatchedTruth`), played back and
/// forth if it is shorter; for a single clip its own, shifted by half of it with wrap-around. `None` if a single clip
/// is too short. `fallback` fills missing values.
pub fn mismatched(
    clips: &EvalClips,
    kind: PredictorKind,
    fallback: &Predictor,
    store: &MotionStore,
) -> Result<Option<Predictor>> {
    let of = |clip: usize| match kind {
        PredictorKind::MismatchedTruth => &clips.clips[clip].ground_truth,
        _ => &clips.clips[clip].predicted,
    };
    let n = clips.clips.len();
    let lengths = clips.clips.iter().map(EvalClip::n_frames);
    let (motions, description): (Vec<ClipMotion>, String) = if n > 1 {
        let motions = lengths.enumerate().map(|(i, n_frames)| {
            let from = of((i + n / 2) % n);
            let motion = select_frames(from, (0..n_frames).map(|t| back_and_forth(t, from.n_frames())));
            Ok(ClipMotion::Motion(store.keep(motion)?))
        });
        (
            motions.collect::<Result<_>>()?,
            "the motion of another clip, played back and forth where it is shorter".to_owned(),
        )
    } else {
        let n_frames = lengths.sum::<usize>();
        let shift = n_frames / 2;
        if clips.fps.secs(shift) < MIN_SHIFT_SECS {
            return Ok(None);
        }
        let description = format!("the same motion, shifted by {:.1} s with wrap-around", clips.fps.secs(shift));
        let motion = store.keep(select_frames(of(0), (0..n_frames).map(|t| (t + shift) % n_frames)))?;
        (vec![ClipMotion::Motion(motion)], description)
    };
    Ok(Some(Predictor::new(kind, description, motions).filled(fallback, store)?))
}

fn select_frames(from: &StoredMotion, frames: impl Iterator<Item = usize>) -> Array3<f32> {
    let from = from.view();
    let frames: Vec<usize> = frames.collect();
    let mut to = Array3::zeros((frames.len(), from.shape()[1], 3));
    for (mut to, frame) in to.outer_iter_mut().zip(frames) {
        to.assign(&from.slice(s![frame, .., ..]));
    }
    to
}

/// Frame index at step `t` of `n` frames played back and forth: 0 1 2 1 0 1 2 ...
pub fn back_and_forth(t: usize, n: usize) -> usize {
    if n < 2 {
        return 0;
    }
    let at = t % (2 * n - 2);
    if at < n { at } else { 2 * n - 2 - at }
}
