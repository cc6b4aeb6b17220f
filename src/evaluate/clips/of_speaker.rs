//! Clips and baselines of a trained speaker on a split of a dataset. Ground truth comes from the dataset, predictions
//! from the sound alone, and baselines know the training split only.

use super::clips::{ClipAudio, EvalClip, EvalClips, compared, pcm};
use super::held_out;
use super::held_out::HeldOutInterval;
use super::sound_features;
use super::sound_features::SoundFeatureExtractor;
use crate::dataset::{Dataset, Split};
use crate::evaluate::baseline::baselines;
use crate::evaluate::baseline::baselines::{ClipMotion, Predictor, PredictorKind};
use crate::evaluate::baseline::constant_pose::ConstantPoses;
use crate::evaluate::baseline::neighbour;
use crate::evaluate::baseline::neighbour::{Library, Query};
use crate::evaluate::baseline::predictor;
use crate::generate::GestureGenerator;
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::stage::progress::Task;
use crate::types::skeleton::N_JOINTS;
use crate::types::sound::Sound;
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3, s};
use rayon::prelude::*;

/// Clips and predictors of the speaker of a checkpoint on a split of `dataset`, the speaker's own motion first.
///
/// # Errors
/// A dataset of another frame rate; a split without intervals.
pub fn prepare(
    dataset: &Dataset,
    speaker: &GestureGenerator,
    split: Split,
    task: &dyn Task,
) -> Result<(EvalClips, Vec<Predictor>)> {
    let (of_dataset, of_speaker) = (dataset.info().fps, speaker.fps());
    ensure!(
        of_dataset == of_speaker,
        "{} moves at {of_dataset}, the checkpoint's speaker at {of_speaker}: it was trained on another dataset",
        dataset.dir().display()
    );
    let normal = &speaker.metadata.normalisation;
    task.detail("reading the intervals");
    let held_out = held_out::read(dataset, &held_out::samples(dataset, split)?, normal)?;
    task.detail("generating motion");
    let predicted = generated(speaker, &held_out, |sounds, i| sounds[i].clone())?;
    let other = generated(speaker, &held_out, predictor::turned)?;
    task.detail("listening");
    let clips: Vec<EvalClip> = held_out
        .into_par_iter()
        .zip(predicted)
        .map(|(held_out, predicted)| clip(held_out, predicted, of_dataset))
        .collect();
    let mut clips = EvalClips { fps: of_dataset, clips, notes: Vec::new(), learnt: split == Split::Train };
    if clips.learnt {
        clips
            .notes
            .push("THE CHECKPOINT WAS TRAINED ON THIS SPLIT: its figures say what it learnt by heart".to_owned());
    }
    if dataset.info().speaker != speaker.name() {
        clips.notes.push(format!(
            "the dataset is of {}, the checkpoint of {}: its bones were put on the checkpoint's lengths",
            dataset.info().speaker,
            speaker.name()
        ));
    }
    task.detail("what the training split knows");
    let prediction = format!("the speaker {} of the checkpoint, hearing the sound of each interval", speaker.name());
    let mut all = vec![Predictor::prediction(&clips, &prediction)];
    all.extend(constant_poses(dataset, normal, clips.clips.len())?);
    match copied(dataset, normal, &clips, split)? {
        Some(motions) => {
            let description =
                "for each 4 s of sound the motion of the part of the training split that sounds most alike";
            let copied =
                Predictor { kind: PredictorKind::NearestNeighbour, description: description.to_owned(), motions };
            all.push(copied.filled(&all[1]));
        }
        None => clips.notes.push(format!(
            "{}: left out, since no interval of the training split is long enough to copy from",
            PredictorKind::NearestNeighbour.name()
        )),
    }
    let description = "the same speaker hearing another sound: what is said half of the split later".to_owned();
    let motions = other.into_iter().map(ClipMotion::Motion).collect();
    all.push(Predictor { kind: PredictorKind::MismatchedPrediction, description, motions });
    match baselines::mismatched(&clips, PredictorKind::MismatchedTruth, &all[1]) {
        Some(predictor) => all.push(predictor),
        None => clips.notes.push(baselines::too_short(PredictorKind::MismatchedTruth)),
    }
    Ok((clips, all))
}

fn generated(
    speaker: &GestureGenerator,
    held_out: &[HeldOutInterval],
    features: impl Fn(&[&Sound], usize) -> Sound,
) -> Result<Vec<Array3<f32>>> {
    let sounds: Vec<&Sound> = held_out.iter().map(|interval| &interval.sound).collect();
    let predicted = held_out.iter().enumerate().map(|(i, interval)| {
        let predicted = predictor::motion(speaker, &features(&sounds, i), interval.ground_truth.n_frames());
        Ok(predicted.with_context(|| format!("no motion for {}", interval.key))?.joints)
    });
    predicted.collect()
}

fn clip(held_out: HeldOutInterval, predicted: Array3<f32>, fps: FrameRate) -> EvalClip {
    let HeldOutInterval { key, ground_truth, sound } = held_out;
    let features = Some(sound_features::from_samples(&sound.samples, fps, ground_truth.n_frames()));
    let mut predicted = predicted;
    let (mask, _) = compared(&ground_truth.joints, &ground_truth.mask, &mut predicted);
    let audio = Some(ClipAudio::Kept(sound.samples.into_iter().map(pcm).collect()));
    EvalClip { name: key, ground_truth: ground_truth.joints, predicted, mask, features, audio }
}

/// Mean and median pose of the training split.
fn constant_poses(dataset: &Dataset, normal: &Normalisation, n_clips: usize) -> Result<Vec<Predictor>> {
    let mut constant_poses = ConstantPoses::default();
    for sample in dataset.samples(Split::Train) {
        let interval = held_out::read(dataset, &[sample], normal)?.remove(0);
        constant_poses.add(interval.ground_truth.joints.view(), interval.ground_truth.mask.view());
    }
    let mean: Array2<f32> = normal.joints(Array2::zeros((N_FEATURES, 1)).view()).slice(s![0, .., ..]).to_owned();
    let mut median = constant_poses.median();
    median.zip_mut_with(&mean, |v, mean| *v = if v.is_finite() { *v } else { *mean });
    let predictor = |kind: PredictorKind, pose: Array2<f32>| Predictor {
        kind,
        description: format!("the {} of the training split in every frame, which never moves", kind.name()),
        motions: vec![ClipMotion::Constant(pose); n_clips],
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
        joints: &|entry| Ok(read(entry)?.ground_truth.joints),
    };
    let predicted = neighbour::motions(&query, &library, clips.fps)?;
    debug_assert!(predicted.iter().flatten().all(|joints| joints.shape()[1..] == [N_JOINTS, 3]));
    Ok(predicted.map(|predicted| predicted.into_iter().map(ClipMotion::Motion).collect()))
}
