//! Motion of every condition for the clips of one speaker, made comparable between conditions, so that films differ in
//! the movement only: same bone lengths, a joint is visible only where it is in all conditions, head and trunk only
//! where all conditions have them, same smoothing.

use super::cut::StudyClip;
use super::speaker_source::{SpeakerSource, SpeechSegment};
use crate::file::{ConditionSource, StudyCondition, fill_pattern};
use anyhow::{Context, Result, ensure};
use ndarray::{Array2, Array3, Axis, Zip, s};
use orator_avatar::animate::performance::perform_on;
use orator_avatar::animate::rig::rig::Rig;
use orator_avatar::animate::{AnimationOptions, Performance};
use orator_base::motion::{bones, resample, units};
use orator_base::text::counted;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::{Posture, PostureChannel};
use orator_base::types::skeleton::{N_BONES, N_JOINTS};
use orator_base::types::sound::samples_of;
use orator_base::types::time::FrameRate;
use orator_dataset::Dataset;
use orator_formats::mocap::motion_file::{self, DEFAULT_FPS};
use orator_formats::word_vectors::WordVectors;
use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Tolerance for the length of another system's motion file, frames.
const LENGTH_TOLERANCE_FRAMES: usize = 2;

#[derive(Clone, Debug)]
pub struct ShownMotion {
    /// Index of the clip to which the motion belongs; another clip in mismatched conditions.
    pub of: usize,
    pub motion: Motion,
    pub posture: Option<Posture>,
}

pub struct ConditionModels(BTreeMap<String, EvaluatedCheckpoint>);

impl ConditionModels {
    /// Opens the checkpoints of a speaker.
    ///
    /// # Errors
    /// A checkpoint cannot be opened, or does not support a key of its condition; the error names the condition.
    pub fn open(conditions: &[StudyCondition], speaker: &str) -> Result<Self> {
        let mut models = BTreeMap::new();
        for condition in conditions {
            let ConditionSource::Checkpoint(path) = &condition.source else { continue };
            let opened = open(condition, path, speaker);
            let opened = opened.with_context(|| format!("condition {} of the speaker {speaker}", condition.name))?;
            models.extend(opened.into_iter().map(|model| (condition.name.clone(), model)));
        }
        Ok(Self(models))
    }

    pub fn fps(&self) -> Option<FrameRate> {
        self.0.values().next().map(|model| model.speaker.fps())
    }
}

fn open(condition: &StudyCondition, path: &Path, speaker: &str) -> Result<Vec<EvaluatedCheckpoint>> {
    let mut opened = EvaluatedCheckpoint::open_all(&[fill_pattern(path, speaker, "")], speaker)?;
    for EvaluatedCheckpoint { speaker, .. } in &opened {
        let (name, reads_words) = (speaker.name(), speaker.reads_words());
        ensure!(
            condition.words.is_none() || reads_words,
            "the model of {name} does not read words: remove the key words"
        );
        ensure!(
            !condition.carry_state || speaker.has_state(),
            "the model of {name} has no decoder state: remove the key carry_state"
        );
    }
    let words = condition.words.as_ref().map(|path| WordVectors::open(&fill_pattern(path, speaker, "")));
    EvaluatedCheckpoint::set_options(&mut opened, words.transpose()?.map(Arc::new).as_ref(), condition.carry_state)?;
    Ok(opened)
}

/// Motions by condition, then by clip. `tick` is called after each segment of speech.
///
/// # Errors
/// A model fails, a file of another system is missing or has the wrong length, or there are too few clips to mismatch.
pub fn motions(
    source: &SpeakerSource,
    clips: &[StudyClip],
    conditions: &[StudyCondition],
    models: &ConditionModels,
    tick: &dyn Fn(),
) -> Result<BTreeMap<String, Vec<ShownMotion>>> {
    let mut shown: BTreeMap<String, Vec<ShownMotion>> = BTreeMap::new();
    let own = || conditions.iter().filter(|condition| condition.source.mismatch_of().is_none());
    // Clips are sorted by segment, so each segment is read, and processed by each model, only once.
    for of_segment in clips.chunk_by(|a, b| a.segment == b.segment) {
        let segment = source.read(of_segment[0].segment)?;
        for condition in own() {
            let of_condition = shown.entry(condition.name.clone()).or_default();
            let context = || format!("condition {}, speaker {}, {}", condition.name, source.name, segment.name);
            let whole = whole_motion(source, &segment, condition, models).with_context(context)?;
            for clip in of_segment {
                let of = of_condition.len();
                of_condition.push(match (&whole, &condition.source) {
                    (Some((motion, posture)), _) => cut(of, motion, posture.as_ref(), clip),
                    (None, ConditionSource::Files(pattern)) => {
                        let path = fill_pattern(pattern, &source.name, &clip.name);
                        let motion = of_file(&path, source.fps, clip.frames.len()).with_context(context)?;
                        ShownMotion { of, motion, posture: None }
                    }
                    (None, _) => constant(of, source, clip.frames.len()).with_context(context)?,
                });
            }
        }
        tick();
    }
    let others = mismatched_clips(clips);
    for condition in conditions {
        let Some(of) = condition.source.mismatch_of() else { continue };
        let (name, n) = (&source.name, clips.len());
        ensure!(
            n > 1,
            "the speaker {name} has {}, but the mismatched condition {} needs at least 2",
            counted(n, "clip"),
            condition.name
        );
        let matched = shown.get(of).with_context(|| format!("condition {}: unknown condition {of}", condition.name))?;
        let mismatched = others.iter().map(|other| matched[*other].clone()).collect();
        shown.insert(condition.name.clone(), mismatched);
    }
    Ok(shown)
}

/// Motion of a condition for an entire segment; `None` for conditions whose motion is created per clip.
fn whole_motion(
    source: &SpeakerSource,
    segment: &SpeechSegment,
    condition: &StudyCondition,
    models: &ConditionModels,
) -> Result<Option<(Motion, Option<Posture>)>> {
    match &condition.source {
        ConditionSource::Natural => {
            let natural = segment.natural.clone().context("no natural motion: expected a speaker with a dataset")?;
            Ok(Some(natural))
        }
        ConditionSource::Checkpoint(_) => {
            let model = models.0.get(&condition.name).context("the model is not loaded")?;
            Ok(Some(generated(model, segment, source.fps)?))
        }
        ConditionSource::MeanPose | ConditionSource::Files(_) | ConditionSource::Mismatched(_) => Ok(None),
    }
}

/// Motion generated by a model for a segment of speech, at `fps`.
fn generated(
    model: &EvaluatedCheckpoint,
    segment: &SpeechSegment,
    fps: FrameRate,
) -> Result<(Motion, Option<Posture>)> {
    let (own, n_frames) = (model.speaker.fps(), segment.n_frames);
    if own == fps || model.speaker.is_captured() {
        return model.motion(&segment.sound, &segment.words, n_frames, fps);
    }
    let n_own = own.frames_in(fps.secs(n_frames.saturating_sub(1))) + 1;
    let (motion, posture) = model.motion(&segment.sound, &segment.words, n_own, own)?;
    let nearest = |frame: usize| ((fps.secs(frame) * own.per_sec()).round() as usize).min(n_own - 1);
    let posture = posture.map(|posture| {
        let frames: Vec<usize> = (0..n_frames).map(nearest).collect();
        Posture { head: posture.head.select(Axis(0), &frames), trunk: posture.trunk.select(Axis(0), &frames) }
    });
    Ok((resample::at_rate(&motion, fps), posture))
}

fn cut(of: usize, motion: &Motion, posture: Option<&Posture>, clip: &StudyClip) -> ShownMotion {
    let frames = clip.frames.clone();
    let motion = Motion {
        fps: motion.fps,
        joints: motion.joints.slice(s![frames.clone(), .., ..]).to_owned(),
        mask: motion.mask.slice(s![frames.clone(), ..]).to_owned(),
    };
    ShownMotion { of, motion, posture: posture.map(|posture| posture.slice(frames)) }
}

/// Static mean pose of the training split.
fn constant(of: usize, source: &SpeakerSource, n_frames: usize) -> Result<ShownMotion> {
    let dataset: &Dataset = source.dataset.as_ref().context("no mean pose: expected a speaker with a dataset")?;
    let stats = dataset.stats();
    let mean = stats.mean();
    let pose = |joint: usize, k: usize| if stats.n_visible[joint] > 0 { mean[[joint, k]] } else { f32::NAN };
    let (n_joints, of_axes) = mean.dim();
    let joints = Array3::from_shape_fn((n_frames, n_joints, of_axes), |(_, joint, k)| pose(joint, k));
    let angles = |channel: PostureChannel| {
        let stats = stats.posture.as_ref().and_then(|posture| posture.get(&channel));
        let angle =
            |k: usize| stats.filter(|stats| stats.n_visible[k] > 0).map_or(f32::NAN, |stats| stats.mean[k] as f32);
        Array2::from_shape_fn((n_frames, 3), |(_, k)| angle(k))
    };
    let posture = stats.posture.as_ref().map(|_| {
        let [head, trunk] = PostureChannel::ALL.map(angles);
        Posture { head, trunk }
    });
    Ok(ShownMotion { of, motion: Motion::from_joints(source.fps, joints), posture })
}

/// Reads the motion file of another system, which must be as long as its clip up to [`LENGTH_TOLERANCE_FRAMES`].
fn of_file(path: &Path, fps: FrameRate, n_frames: usize) -> Result<Motion> {
    let read = motion_file::read(path, Some(fps))?.motion;
    units::check(&read).with_context(|| path.display().to_string())?;
    let motion = resample::at_rate(&read, fps);
    let (n, path) = (motion.n_frames(), path.display());
    ensure!(
        n.abs_diff(n_frames) <= LENGTH_TOLERANCE_FRAMES,
        "{path} lasts {:.2} s, but its clip lasts {:.2} s: generate the motion from the audio of the clip in the \
         folder clips",
        fps.secs(n),
        fps.secs(n_frames)
    );
    let frames: Vec<usize> = (0..n_frames).map(|frame| frame.min(n - 1)).collect();
    let (joints, mask) = (motion.joints.select(Axis(0), &frames), motion.mask.select(Axis(0), &frames));
    Ok(Motion { fps, joints, mask })
}

/// For each clip the index of a different one, from another segment if possible; a permutation (a rotation).
pub fn mismatched_clips(clips: &[StudyClip]) -> Vec<usize> {
    let n = clips.len();
    let n_near = |shift: &usize| (0..n).filter(|at| clips[*at].segment == clips[(at + shift) % n].segment).count();
    let shift = (1..n).min_by_key(n_near).unwrap_or(0);
    (0..n).map(|at| (at + shift) % n.max(1)).collect()
}

/// Sound samples of a clip, zero-padded at the end of the segment.
pub fn sound_of(segment: &SpeechSegment, clip: &StudyClip, fps: FrameRate) -> Vec<f32> {
    let range = samples_of(fps, segment.sound.rate, clip.frames.clone());
    let mut samples = segment.sound.samples.get(range.start..).unwrap_or_default().to_vec();
    samples.resize(range.len(), 0.0);
    samples
}

/// Visibility shared by all films of one clip.
#[derive(Clone, Debug)]
pub struct CommonVisibility {
    /// Mask [T, 49] of the joints that are visible in every condition.
    joints: Array2<bool>,
    /// Masks [T, 3] of the angles of head and trunk that every condition has.
    angles: [Array2<bool>; 2],
}

impl CommonVisibility {
    /// Intersection of the visibility of these motions, which must have equal lengths; `None` without motions.
    pub fn of(shown: &[&ShownMotion]) -> Option<Self> {
        let (n_frames, n_joints) = shown.first()?.motion.mask.dim();
        let mut joints = Array2::from_elem((n_frames, n_joints), true);
        let mut angles = [(); 2].map(|()| Array2::from_elem((n_frames, 3), true));
        let unseen = Posture::missing(n_frames);
        for ShownMotion { motion, posture, .. } in shown {
            let finite = motion.joints.map_axis(Axis(2), |coordinates| coordinates.iter().all(|v| v.is_finite()));
            Zip::from(&mut joints)
                .and(&motion.mask)
                .and(&finite)
                .for_each(|all, seen, finite| *all &= *seen && *finite);
            let posture = posture.as_ref().unwrap_or(&unseen);
            for (all, channel) in angles.iter_mut().zip(PostureChannel::ALL) {
                all.zip_mut_with(posture.channel(channel), |all, angle| *all &= angle.is_finite());
            }
        }
        Some(Self { joints, angles })
    }

    pub fn n_visible(&self) -> usize {
        self.joints.iter().filter(|seen| **seen).count()
    }

    /// Performance of a motion at its own rate, restricted to the common visibility and on the common body.
    pub fn performance(&self, shown: &ShownMotion, body: &CommonBody) -> Performance {
        let mut motion = shown.motion.clone();
        for ((frame, joint), seen) in self.joints.indexed_iter() {
            if !seen {
                motion.joints.slice_mut(s![frame, joint, ..]).fill(f32::NAN);
                motion.mask[[frame, joint]] = false;
            }
        }
        bones::with_lengths(&mut motion, &body.lengths);
        let posture = shown.posture.clone().map(|mut posture| {
            for (seen, channel) in self.angles.iter().zip(PostureChannel::ALL) {
                let angles = posture.channel_mut(channel);
                angles.zip_mut_with(seen, |angle, seen| *angle = if *seen { *angle } else { f32::NAN });
            }
            posture
        });
        let is_posed = self.angles.iter().flatten().any(|seen| *seen);
        let posture = posture.filter(|_| is_posed);
        perform_on(body.rig.clone(), &motion, posture.as_ref(), &AnimationOptions::default())
    }
}

/// Body shared by all films of a speaker.
#[derive(Clone, Debug)]
pub struct CommonBody {
    /// Bone lengths, metres; 0 keeps the length of the motion.
    lengths: [f32; N_BONES],
    rig: Rig,
}

impl CommonBody {
    /// Body with the stated bone lengths (metres), or, if none is known, those of the motion with the most measured
    /// bones; rig from all motions together.
    pub fn of(stated: &[f32], shown: &[&ShownMotion]) -> Self {
        let known = |lengths: &[f32; N_BONES]| lengths.iter().filter(|length| **length > 0.0).count();
        let stated = std::array::from_fn(|bone| stated.get(bone).copied().unwrap_or(0.0));
        let measured = shown.iter().map(|shown| bones::measure(&shown.motion)).filter(|_| known(&stated) == 0);
        let lengths =
            measured.fold(stated, |best, lengths| if known(&lengths) > known(&best) { lengths } else { best });
        let mut all = Array3::zeros((0, N_JOINTS, 3));
        let mut fps = DEFAULT_FPS;
        for shown in shown {
            let mut motion = shown.motion.clone();
            bones::with_lengths(&mut motion, &lengths);
            fps = motion.fps;
            // Cannot fail: the shapes match.
            let _ = all.append(Axis(0), motion.joints.view());
        }
        Self { lengths, rig: Rig::from_motion(&Motion::from_joints(fps, all)) }
    }
}
