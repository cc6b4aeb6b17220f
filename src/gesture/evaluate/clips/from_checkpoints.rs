//! Clips and baselines for checkpoints on a split of a dataset. The ground truth is the dataset's motion, the
//! predictions are generated from sound and words only, and the baselines are derived from the training split only.

use super::checkpoint::{self, EvaluatedCheckpoint};
use super::clips::{ClipAudio, EvalClip, EvalClips, compared};
use super::held_out::{self, HeldOutInterval};
use super::motion_store::{MotionStore, StoredMotion};
use super::sound_features::{self, SoundFeatureExtractor};
use crate::evaluate::baseline::baselines::{self, ClipMotion, NumberedCheckpoint, Predictor, PredictorKind};
use crate::evaluate::baseline::constant_pose::ConstantPoses;
use crate::evaluate::baseline::predictor::{self, Library, Query};
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::train::gan::speakers::normalisation;
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3, Axis, s};
use orator_base::motion::bones;
use orator_base::stage::progress::Task;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::Sound;
use orator_dataset::index::SampleRef;
use orator_dataset::{Dataset, Split};
use orator_formats::transcript::Word;

/// Clips and predictors for checkpoints on a split of `dataset`; the predictions of the checkpoints come first. Bone
/// lengths are those of the first checkpoint that was trained on a dataset, or else of this dataset.
///
/// # Errors
/// No checkpoint; a dataset of another frame rate, except for captured skeletons; a split without intervals.
pub fn prepare(
    dataset: &Dataset,
    checkpoints: &[EvaluatedCheckpoint],
    split: Split,
    store: &MotionStore,
    task: &dyn Task,
) -> Result<(EvalClips, Vec<Predictor>)> {
    let fps = dataset.info().fps;
    for EvaluatedCheckpoint { speaker, .. } in checkpoints {
        let of_network = speaker.fps();
        ensure!(
            speaker.normalisation().is_none() || fps == of_network,
            "{} has {fps}, the checkpoint {of_network}: it was trained on another dataset",
            dataset.dir().display()
        );
    }
    let trained_normal = checkpoints.iter().find_map(|of| of.speaker.normalisation());
    let own_normal = if trained_normal.is_none() { Some(normalisation(dataset)?) } else { None };
    let normal = trained_normal.or(own_normal.as_ref()).context("no checkpoint to evaluate")?;
    task.detail("reading the intervals");
    let samples = held_out::samples(dataset, split)?;
    let channels = channels(dataset, &samples, checkpoints)?;
    let held_out = HeldOutSplit::new(dataset, samples, normal, !channels.is_empty())?;
    task.detail("generating motion");
    let mut generated = checkpoints
        .iter()
        .map(|of| held_out.generate(of, store).with_context(|| of.name.clone()))
        .collect::<Result<Vec<GeneratedIntervals>>>()?;
    task.detail("computing audio features");
    let notes = checkpoint::of_checkpoints(dataset, checkpoints, &held_out.words.concat(), split);
    let first = std::mem::take(&mut generated.first_mut().context("no checkpoint to evaluate")?.matched);
    let clips = first
        .into_iter()
        .enumerate()
        .map(|(at, generated_motion)| held_out.clip(at, &generated_motion, store))
        .collect::<Result<Vec<_>>>()?;
    let channels = &channels;
    let mut clips = EvalClips { fps, clips, notes, trained_on: split == Split::Train, channels: channels.clone() };
    if checkpoints.iter().any(|of| of.speaker.normalisation().is_none()) {
        let is_known = |joint: usize| generated.iter().all(|intervals| intervals.joints[joint]);
        let common: Vec<usize> = (0..N_JOINTS).filter(|joint| is_known(*joint)).collect();
        restrict(&mut clips, &common, store)?;
        clips.notes.push(checkpoint::of_joints(&clips, &common));
    }
    task.detail("computing baselines");
    let numbered = |at: usize| {
        let name = checkpoints[at].name.clone();
        (checkpoints.len() > 1).then_some(NumberedCheckpoint { number: at + 1, name })
    };
    let mut all = Vec::new();
    for (at, (of, intervals)) in checkpoints.iter().zip(&mut generated).enumerate() {
        let input = if of.speaker.n_words() > 0 { "audio and the words" } else { "audio" };
        let description =
            format!("the model of {} in the checkpoint, with the {input} of each interval", of.speaker.name());
        let mut predictor = Predictor::prediction(&clips, &description);
        if at > 0 {
            predictor.motions = std::mem::take(&mut intervals.matched).into_iter().map(ClipMotion::Motion).collect();
        }
        all.push(Predictor { checkpoint: numbered(at), ..predictor });
    }
    let mean_pose_index = all.len();
    let mean_posture = checkpoints.iter().filter_map(|of| of.speaker.normalisation()).find_map(mean_posture);
    all.extend(constant_poses(dataset, normal, (clips.clips.len(), mean_posture.filter(|_| !channels.is_empty())))?);
    match nearest_neighbours(dataset, normal, &clips, split, store)? {
        Some(motions) => {
            let description = "for each 4 s of audio the motion of the most similar audio in the training split";
            let nearest_neighbours = Predictor::new(PredictorKind::NearestNeighbour, description.to_owned(), motions);
            let nearest_neighbours = nearest_neighbours.filled(&all[mean_pose_index], store)?;
            all.push(nearest_neighbours);
        }
        None => clips.notes.push(format!(
            "{}: left out, since no interval of the training split is long enough to copy from",
            PredictorKind::NearestNeighbour.name()
        )),
    }
    for (at, (of, intervals)) in checkpoints.iter().zip(generated).enumerate() {
        let with_words = if of.speaker.n_words() > 0 { " and its words" } else { "" };
        let description = format!("the same model with other audio{with_words}, from half a split later");
        let motions = intervals.mismatched.into_iter().map(ClipMotion::Motion).collect();
        let predictor = Predictor::new(PredictorKind::MismatchedPrediction, description, motions);
        all.push(Predictor { checkpoint: numbered(at), ..predictor });
    }
    match baselines::mismatched(&clips, PredictorKind::MismatchedTruth, &all[mean_pose_index], store)? {
        Some(predictor) => all.push(predictor),
        None => clips.notes.push(baselines::too_short(PredictorKind::MismatchedTruth)),
    }
    Ok((clips, all))
}

struct GeneratedIntervals {
    /// For the interval's own sound and words: joints [T, 49, 3] in metres, followed by angles as in [`EvalClip`].
    matched: Vec<StoredMotion>,
    /// For the sound and words half of the split later.
    mismatched: Vec<StoredMotion>,
    /// Whether each of the 49 joints is finite in every frame.
    joints: Vec<bool>,
}

struct HeldOutSplit<'d> {
    dataset: &'d Dataset,
    samples: Vec<SampleRef>,
    normal: &'d Normalisation,
    has_channels: bool,
    n_sound_samples: Vec<usize>,
    words: Vec<Vec<Word>>,
}

impl<'d> HeldOutSplit<'d> {
    fn new(
        dataset: &'d Dataset,
        samples: Vec<SampleRef>,
        normal: &'d Normalisation,
        has_channels: bool,
    ) -> Result<Self> {
        let n_sound_samples = samples.iter().map(SampleRef::n_sound_samples).collect();
        let words = |sample| Ok(dataset.words(sample)?.unwrap_or_default());
        let words = samples.iter().map(words).collect::<Result<_>>()?;
        Ok(Self { dataset, samples, normal, has_channels, n_sound_samples, words })
    }

    fn interval(&self, at: usize) -> Result<HeldOutInterval> {
        held_out::interval(self.dataset, &self.samples[at], self.normal)
    }

    fn generate(&self, checkpoint: &EvaluatedCheckpoint, store: &MotionStore) -> Result<GeneratedIntervals> {
        let (mut matched, mut mismatched, mut joints) = (Vec::new(), Vec::new(), vec![true; N_JOINTS]);
        for at in 0..self.samples.len() {
            let HeldOutInterval { sound, words, .. } = self.interval(at)?;
            let generated_motion = self.motion(checkpoint, at, &sound, &words)?;
            for (joint, is_known) in joints.iter_mut().enumerate() {
                *is_known &= generated_motion.slice(s![.., joint, ..]).iter().all(|v| v.is_finite());
            }
            matched.push(store.keep(generated_motion)?);
            let read = |of: usize, range| Ok(self.dataset.sound(&self.samples[of], range)?.samples);
            let samples = predictor::mismatched_sound(&self.n_sound_samples, at, read)?;
            let words = predictor::mismatched_words(&self.n_sound_samples, sound.rate, &self.words, at);
            let other = Sound { rate: sound.rate, samples };
            mismatched.push(store.keep(self.motion(checkpoint, at, &other, &words)?)?);
        }
        Ok(GeneratedIntervals { matched, mismatched, joints })
    }

    /// Motion that a network generates for a sound and words, with the number of frames of an interval.
    fn motion(
        &self,
        checkpoint: &EvaluatedCheckpoint,
        at: usize,
        sound: &Sound,
        words: &[Word],
    ) -> Result<Array3<f32>> {
        let (sample, own) = (&self.samples[at], checkpoint.speaker.normalisation());
        let generated_motion = checkpoint.motion(sound, words, sample.n_frames, self.dataset.info().fps);
        let (mut generated_motion, posture) =
            generated_motion.with_context(|| format!("cannot generate motion for {}", sample.key))?;
        if own.is_none_or(|own| own.bone_lengths != self.normal.bone_lengths) {
            bones::with_lengths(&mut generated_motion, &self.normal.lengths());
        }
        Ok(if self.has_channels {
            held_out::with_posture(&generated_motion.joints, posture.as_ref())
        } else {
            generated_motion.joints
        })
    }

    fn clip(&self, at: usize, generated_motion: &StoredMotion, store: &MotionStore) -> Result<EvalClip> {
        let HeldOutInterval { key, mut ground_truth, posture, sound, .. } = self.interval(at)?;
        if self.has_channels {
            ground_truth.joints = held_out::with_posture(&ground_truth.joints, posture.as_ref());
        }
        let fps = self.dataset.info().fps;
        let features = Some(sound_features::from_samples(&sound.samples, fps, ground_truth.n_frames()));
        let mut predicted = generated_motion.view().to_owned();
        let (mask, n_missing) = compared(&ground_truth.joints, &ground_truth.mask, &mut predicted);
        let predicted = if n_missing == 0 { generated_motion.clone() } else { store.keep(predicted)? };
        let audio = Some(ClipAudio::of_sample(self.dataset, &self.samples[at]));
        Ok(EvalClip { name: key, ground_truth: store.keep(ground_truth.joints)?, predicted, mask, features, audio })
    }
}

/// Restricts the comparison to the joints `common`; all others are set to missing in the prediction.
fn restrict(clips: &mut EvalClips, common: &[usize], store: &MotionStore) -> Result<()> {
    for clip in &mut clips.clips {
        let mut predicted = clip.predicted.view().to_owned();
        for joint in (0..N_JOINTS).filter(|joint| !common.contains(joint)) {
            clip.mask.column_mut(joint).fill(false);
            predicted.slice_mut(s![.., joint, ..]).fill(f32::NAN);
        }
        clip.predicted = store.keep(predicted)?;
    }
    Ok(())
}

/// Posture channels to measure: those that a checkpoint generates and that are visible in the split.
fn channels(
    dataset: &Dataset,
    samples: &[SampleRef],
    checkpoints: &[EvaluatedCheckpoint],
) -> Result<Vec<PostureChannel>> {
    let generated_channels = |channel: &PostureChannel| {
        let of = |normal: &Normalisation| normal.channels.iter().any(|own| own.channel == *channel);
        checkpoints.iter().filter_map(|of| of.speaker.normalisation()).any(of)
    };
    let generated_channels: Vec<PostureChannel> = PostureChannel::ALL.into_iter().filter(generated_channels).collect();
    let mut visible = Vec::new();
    for sample in samples {
        if visible.len() == generated_channels.len() {
            break;
        }
        let Some(posture) = dataset.posture(sample, 0..sample.n_frames)? else { continue };
        let is_new = |channel: &&PostureChannel| !visible.contains(*channel);
        let new =
            generated_channels.iter().filter(is_new).filter(|of| posture.channel(**of).iter().any(|v| v.is_finite()));
        let new: Vec<PostureChannel> = new.copied().collect();
        visible.extend(new);
    }
    Ok(generated_channels.into_iter().filter(|channel| visible.contains(channel)).collect())
}

/// Mean posture of a checkpoint's training split, one frame; `None` if it has no posture channels.
fn mean_posture(normal: &Normalisation) -> Option<Posture> {
    normal.posture(Array2::zeros((normal.n_features(), 1)).view())
}

/// Baselines of the mean and the median pose of the training split, both with the mean posture.
fn constant_poses(
    dataset: &Dataset,
    normal: &Normalisation,
    (n_clips, mean_posture): (usize, Option<Posture>),
) -> Result<Vec<Predictor>> {
    let mut constant_poses = ConstantPoses::default();
    for sample in dataset.samples(Split::Train) {
        let interval = held_out::interval(dataset, &sample, normal)?;
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
        let description = format!("the {} of the training split in every frame", kind.name());
        Predictor::new(kind, description, vec![ClipMotion::Constant(pose); n_clips])
    };
    Ok(vec![predictor(PredictorKind::MeanPose, mean), predictor(PredictorKind::MedianPose, median)])
}

/// Motion of the nearest neighbours in the training split, whose intervals are read one at a time, so that memory does
/// not grow with their number; NaN where the copied motion is missing.
pub fn nearest_neighbours(
    dataset: &Dataset,
    normal: &Normalisation,
    clips: &EvalClips,
    split: Split,
    store: &MotionStore,
) -> Result<Option<Vec<ClipMotion>>> {
    let mut query = Vec::new();
    for clip in &clips.clips {
        let rows: &[f32] = clip.features.as_ref().map_or(&[], |features| &features.rows);
        query.push(Query { rows, n_frames: clip.n_frames() });
    }
    let samples = dataset.samples(Split::Train);
    let library = Library {
        n: samples.len(),
        excludes_self: split == Split::Train,
        features: &|entry| {
            let interval = held_out::interval(dataset, &samples[entry], normal)?;
            let mut extractor = SoundFeatureExtractor::new(interval.ground_truth.fps, None);
            extractor.push(&interval.sound.samples);
            let n_frames = interval.ground_truth.n_frames();
            Ok(Some((extractor.finish(n_frames).rows, n_frames)))
        },
        joints: &|entry, frames| held_out::joints(dataset, &samples[entry], normal, frames, !clips.channels.is_empty()),
    };
    let predicted = predictor::motions(&query, &library, clips.fps, store)?;
    Ok(predicted.map(|predicted| predicted.into_iter().map(ClipMotion::Motion).collect()))
}
