//! Clips and baselines of trained speakers on a split of a dataset. Ground truth comes from the dataset, predictions
//! from sound and words alone, and baselines know the training split only.

use super::checkpoint::EvaluatedCheckpoint;
use super::clips::{ClipAudio, EvalClip, EvalClips, compared, pcm};
use super::held_out;
use super::held_out::HeldOutInterval;
use super::notes;
use super::sound_features;
use super::sound_features::SoundFeatureExtractor;
use crate::dataset::{Dataset, Split};
use crate::evaluate::baseline::baselines;
use crate::evaluate::baseline::baselines::{ClipMotion, NumberedCheckpoint, Predictor, PredictorKind};
use crate::evaluate::baseline::constant_pose::ConstantPoses;
use crate::evaluate::baseline::neighbour;
use crate::evaluate::baseline::neighbour::{Library, Query};
use crate::evaluate::baseline::predictor;
use crate::formats::transcript::Word;
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::motion::bones;
use crate::stage::progress::Task;
use crate::train::gan::begin::normalisation;
use crate::types::posture::{Posture, PostureChannel};
use crate::types::skeleton::N_JOINTS;
use crate::types::sound::Sound;
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3, Axis, s};
use rayon::prelude::*;

/// Clips and predictors of checkpoints on a split of `dataset`, the motion of the checkpoints first. Bones have the
/// lengths of the first checkpoint that learnt from a dataset, else those of this one.
///
/// # Errors
/// No checkpoint; a dataset of another frame rate, captured skeletons aside; a split without intervals.
pub fn prepare(
    dataset: &Dataset,
    checkpoints: &[EvaluatedCheckpoint],
    split: Split,
    task: &dyn Task,
) -> Result<(EvalClips, Vec<Predictor>)> {
    let fps = dataset.info().fps;
    for EvaluatedCheckpoint { speaker, .. } in checkpoints {
        let of_network = speaker.fps();
        ensure!(
            speaker.normalisation().is_none() || fps == of_network,
            "{} moves at {fps}, the checkpoint's speaker at {of_network}: it was trained on another dataset",
            dataset.dir().display()
        );
    }
    let learnt_with = checkpoints.iter().find_map(|of| of.speaker.normalisation());
    let own_normal = if learnt_with.is_none() { Some(normalisation(dataset)?) } else { None };
    let normal = learnt_with.or(own_normal.as_ref()).context("there is no checkpoint to measure")?;
    task.detail("reading the intervals");
    let held_out = held_out::read(dataset, &held_out::samples(dataset, split)?, normal)?;
    let channels = channels(checkpoints, &held_out);
    task.detail("generating motion");
    let mut generated = checkpoints
        .iter()
        .map(|of| speak(of, &held_out, normal, !channels.is_empty()).with_context(|| of.name.clone()))
        .collect::<Result<Vec<SpokenIntervals>>>()?;
    task.detail("listening");
    let notes = notes::of_checkpoints(dataset, checkpoints, &held_out, split);
    let first = std::mem::take(&mut generated.first_mut().context("there is no checkpoint to measure")?.matched);
    let channels = &channels;
    let clips: Vec<EvalClip> = held_out
        .into_par_iter()
        .zip(first)
        .map(|(held_out, predicted)| clip(held_out, predicted, fps, !channels.is_empty()))
        .collect();
    let mut clips = EvalClips { fps, clips, notes, learnt: split == Split::Train, channels: channels.clone() };
    if checkpoints.iter().any(|of| of.speaker.normalisation().is_none()) {
        let is_known = |joint: usize| generated.iter().all(|spoken| spoken.joints[joint]);
        let common: Vec<usize> = (0..N_JOINTS).filter(|joint| is_known(*joint)).collect();
        restrict(&mut clips, &common);
        clips.notes.push(notes::of_joints(&clips, &common));
    }
    task.detail("what the training split knows");
    let several = |at: usize| {
        let name = checkpoints[at].name.clone();
        (checkpoints.len() > 1).then_some(NumberedCheckpoint { number: at + 1, name })
    };
    let mut all = Vec::new();
    for (at, (of, spoken)) in checkpoints.iter().zip(&mut generated).enumerate() {
        let heard = if of.speaker.n_words() > 0 { "sound and the words" } else { "sound" };
        let description =
            format!("the speaker {} of the checkpoint, hearing the {heard} of each interval", of.speaker.name());
        let mut predictor = Predictor::prediction(&clips, &description);
        if at > 0 {
            predictor.motions = std::mem::take(&mut spoken.matched).into_iter().map(ClipMotion::Motion).collect();
        }
        all.push(Predictor { checkpoint: several(at), ..predictor });
    }
    let still = all.len();
    let mean_posture = checkpoints.iter().filter_map(|of| of.speaker.normalisation()).find_map(mean_posture);
    all.extend(constant_poses(dataset, normal, (clips.clips.len(), mean_posture.filter(|_| !channels.is_empty())))?);
    match copied(dataset, normal, &clips, split)? {
        Some(motions) => {
            let description =
                "for each 4 s of sound the motion of the part of the training split that sounds most alike";
            let copied = Predictor::new(PredictorKind::NearestNeighbour, description.to_owned(), motions);
            all.push(copied.filled(&all[still]));
        }
        None => clips.notes.push(format!(
            "{}: left out, since no interval of the training split is long enough to copy from",
            PredictorKind::NearestNeighbour.name()
        )),
    }
    for (at, (of, spoken)) in checkpoints.iter().zip(generated).enumerate() {
        let said = if of.speaker.n_words() > 0 { " with its words" } else { "" };
        let description = format!("the same speaker hearing another sound{said}: what is said half of the split later");
        let motions = spoken.mismatched.into_iter().map(ClipMotion::Motion).collect();
        let predictor = Predictor::new(PredictorKind::MismatchedPrediction, description, motions);
        all.push(Predictor { checkpoint: several(at), ..predictor });
    }
    match baselines::mismatched(&clips, PredictorKind::MismatchedTruth, &all[still]) {
        Some(predictor) => all.push(predictor),
        None => clips.notes.push(baselines::too_short(PredictorKind::MismatchedTruth)),
    }
    Ok((clips, all))
}

/// Motion of a network for every interval.
struct SpokenIntervals {
    /// For the interval's own sound and words: joints [T, 49, 3], metres, and angles behind them as in a clip.
    matched: Vec<Array3<f32>>,
    /// For those of half of the split later.
    mismatched: Vec<Array3<f32>>,
    /// Whether each of the 49 joints has a number in every frame.
    joints: Vec<bool>,
}

fn speak(
    checkpoint: &EvaluatedCheckpoint,
    held_out: &[HeldOutInterval],
    normal: &Normalisation,
    has_channels: bool,
) -> Result<SpokenIntervals> {
    let sounds: Vec<&Sound> = held_out.iter().map(|interval| &interval.sound).collect();
    let words: Vec<&[Word]> = held_out.iter().map(|interval| interval.words.as_slice()).collect();
    let other_bones = checkpoint.speaker.normalisation().is_none_or(|own| own.bone_lengths != normal.bone_lengths);
    let motion = |at: usize, sound: &Sound, words: &[Word]| -> Result<Array3<f32>> {
        let HeldOutInterval { key, ground_truth, .. } = &held_out[at];
        let made = checkpoint.motion(sound, words, ground_truth.n_frames(), ground_truth.fps);
        let (mut made, posture) = made.with_context(|| format!("no motion for {key}"))?;
        if other_bones {
            bones::with_lengths(&mut made, &held_out::lengths(normal));
        }
        Ok(if has_channels { held_out::with_posture(&made.joints, posture.as_ref()) } else { made.joints })
    };
    let all = 0..held_out.len();
    let matched = all.clone().map(|at| motion(at, sounds[at], words[at])).collect::<Result<Vec<_>>>()?;
    let mismatched = all
        .map(|at| motion(at, &predictor::turned(&sounds, at), &predictor::turned_words(&sounds, &words, at)))
        .collect::<Result<Vec<_>>>()?;
    let is_known =
        |joint: usize| matched.iter().all(|made| made.slice(s![.., joint, ..]).iter().all(|v| v.is_finite()));
    let joints = (0..N_JOINTS).map(is_known).collect();
    Ok(SpokenIntervals { matched, mismatched, joints })
}

/// Leaves the joints `common` to be compared; the others of the prediction are missing.
fn restrict(clips: &mut EvalClips, common: &[usize]) {
    for clip in &mut clips.clips {
        for joint in (0..N_JOINTS).filter(|joint| !common.contains(joint)) {
            clip.mask.column_mut(joint).fill(false);
            clip.predicted.slice_mut(s![.., joint, ..]).fill(f32::NAN);
        }
    }
}

fn clip(held_out: HeldOutInterval, predicted: Array3<f32>, fps: FrameRate, has_channels: bool) -> EvalClip {
    let HeldOutInterval { key, mut ground_truth, posture, sound, .. } = held_out;
    if has_channels {
        ground_truth.joints = held_out::with_posture(&ground_truth.joints, posture.as_ref());
    }
    let features = Some(sound_features::from_samples(&sound.samples, fps, ground_truth.n_frames()));
    let mut predicted = predicted;
    let (mask, _) = compared(&ground_truth.joints, &ground_truth.mask, &mut predicted);
    let audio = Some(ClipAudio::Kept(sound.samples.into_iter().map(pcm).collect()));
    EvalClip { name: key, ground_truth: ground_truth.joints, predicted, mask, features, audio }
}

/// What is measured beside the joints: channels that a checkpoint makes and that the split shows.
fn channels(checkpoints: &[EvaluatedCheckpoint], held_out: &[HeldOutInterval]) -> Vec<PostureChannel> {
    let learnt = |channel: PostureChannel| {
        let of = |normal: &Normalisation| normal.channels.iter().any(|own| own.channel == channel);
        checkpoints.iter().filter_map(|of| of.speaker.normalisation()).any(of)
    };
    let is_seen = |channel: PostureChannel| {
        let mut postures = held_out.iter().filter_map(|interval| interval.posture.as_ref());
        postures.any(|posture| posture.channel(channel).iter().any(|v| v.is_finite()))
    };
    PostureChannel::ALL.into_iter().filter(|channel| learnt(*channel) && is_seen(*channel)).collect()
}

/// The mean posture of a checkpoint's training split, one frame; `None`: it learns none.
fn mean_posture(normal: &Normalisation) -> Option<Posture> {
    normal.posture(Array2::zeros((normal.n_numbers(), 1)).view())
}

/// Mean and median pose of the training split, both with the mean posture.
fn constant_poses(
    dataset: &Dataset,
    normal: &Normalisation,
    (n_clips, mean_posture): (usize, Option<Posture>),
) -> Result<Vec<Predictor>> {
    let mut constant_poses = ConstantPoses::default();
    for sample in dataset.samples(Split::Train) {
        let interval = held_out::read(dataset, &[sample], normal)?.remove(0);
        constant_poses.add(interval.ground_truth.joints.view(), interval.ground_truth.mask.view());
    }
    let mean: Array2<f32> = normal.joints(Array2::zeros((N_FEATURES, 1)).view()).slice(s![0, .., ..]).to_owned();
    let mut median = constant_poses.median();
    median.zip_mut_with(&mean, |v, mean| *v = if v.is_finite() { *v } else { *mean });
    let predictor = |kind: PredictorKind, mut pose: Array2<f32>| {
        if mean_posture.is_some() {
            let frame = held_out::with_posture(&pose.insert_axis(Axis(0)), mean_posture.as_ref());
            pose = frame.index_axis_move(Axis(0), 0);
        }
        let description = format!("the {} of the training split in every frame, which never moves", kind.name());
        Predictor::new(kind, description, vec![ClipMotion::Constant(pose); n_clips])
    };
    Ok(vec![predictor(PredictorKind::MeanPose, mean), predictor(PredictorKind::MedianPose, median)])
}

/// Motion of the nearest neighbours in the training split, which is read again for every query, so that memory does not
/// grow with its length; NaN where the copied motion is missing.
pub fn copied(
    dataset: &Dataset,
    normal: &Normalisation,
    clips: &EvalClips,
    split: Split,
) -> Result<Option<Vec<ClipMotion>>> {
    let rows = |clip: &EvalClip| clip.features.as_ref().map(|features| features.rows.clone()).unwrap_or_default();
    let rows: Vec<Vec<f32>> = clips.clips.iter().map(rows).collect();
    let query: Vec<Query> =
        clips.clips.iter().zip(&rows).map(|(clip, rows)| Query { rows, n_frames: clip.n_frames() }).collect();
    let samples = dataset.samples(Split::Train);
    let read = |entry: usize| -> Result<HeldOutInterval> {
        held_out::read(dataset, &samples[entry..=entry], normal)?.pop().context("no such interval")
    };
    let library = Library {
        n: samples.len(),
        asks_itself: split == Split::Train,
        features: &|entry| {
            let interval = read(entry)?;
            let mut listener = SoundFeatureExtractor::new(interval.ground_truth.fps, None);
            listener.push(&interval.sound.samples);
            let n_frames = interval.ground_truth.n_frames();
            Ok(Some((listener.finish(n_frames).rows, n_frames)))
        },
        joints: &|entry| {
            let HeldOutInterval { ground_truth, posture, .. } = read(entry)?;
            Ok(match clips.channels.is_empty() {
                true => ground_truth.joints,
                false => held_out::with_posture(&ground_truth.joints, posture.as_ref()),
            })
        },
    };
    let predicted = neighbour::motions(&query, &library, clips.fps)?;
    Ok(predicted.map(|predicted| predicted.into_iter().map(ClipMotion::Motion).collect()))
}
