//! Conversion of one mocap take to a sample (motion at the dataset's rate with constant bone lengths, and sound, both
//! trimmed to their common length), or the reason for rejecting it. A take is one continuous interval.

use super::find::TakeFiles;
use super::genea::{GeneaSpeaker, GeneaTake};
use crate::config::videos::slug;
use crate::file_name;
use crate::sample::{N_KEYPOINTS, Sample};
use crate::words::{self, VideoWords};
use anyhow::{Context, Result};
use ndarray::{Array3, s};
use orator_base::math::order::Ordered;
use orator_base::motion::{bones, resample};
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::ledger::TranscriptReport;
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::text::number;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_BONES, N_HAND_JOINTS, N_JOINTS, R_HAND};
use orator_base::types::sound::{SAMPLE_RATE, Sound, sample_at};
use orator_base::types::time::FrameRate;
use orator_formats::mocap::captured::{self, CapturedMotion, MotionKind};
use orator_formats::mocap::facing::LengthUnit;
use orator_formats::mocap::motion_file;
use orator_formats::transcript::{Transcript, Word};
use orator_media::ffmpeg::audio;
use serde_json::{Value, json};

/// Requirements on a take, and settings for reading it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TakeLimits {
    /// Frame rate of the dataset.
    pub fps: FrameRate,
    /// Minimum length of a take, in frames of the dataset.
    pub min_frames: usize,
    /// Largest difference between the lengths of sound and motion, seconds.
    pub max_difference_secs: f64,
    /// Whether sound files are ignored and every take gets silence.
    pub no_sound: bool,
    /// Unit of length of BVH files; `None`: detected.
    pub units: Option<LengthUnit>,
}

#[derive(Clone, Debug)]
pub struct ImportedTake {
    /// `<slug of the file's name>-<8 hex of its content>`.
    pub name: String,
    /// BLAKE3 of the motion file.
    pub content: String,
    /// Frames of the motion at the dataset's rate, before trimming.
    pub n_frames: usize,
    pub outcome: TakeOutcome,
}

#[derive(Clone, Debug)]
pub enum TakeOutcome {
    Accepted(Box<AcceptedTake>),
    Rejected(TakeRejection),
}

#[derive(Clone, Debug)]
pub struct AcceptedTake {
    /// Median shift of the joints by fixing the bone lengths, mm.
    pub moved_mm: f64,
    pub sample: Sample,
    /// Word counts of the transcript; `None` if there is none, or only text without times.
    pub words: Option<TranscriptReport>,
    /// Problems of the transcript, one sentence each.
    pub notes: Vec<String>,
    /// Number of transcript files that were read.
    pub n_transcripts: usize,
    /// Bone lengths, metres; 0: not measured.
    pub lengths: [f32; N_BONES],
    /// Note on the mix of the sound, if any.
    pub sound_note: Option<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct TakeRejection {
    pub why: FrameRejection,
    /// Sentence shown to the user.
    pub message: String,
}

impl TakeRejection {
    /// Rejection with the standard message of `rejection`.
    pub fn new(rejection: Rejection, measured: f64, threshold: f64) -> Self {
        let message = rejection.message(measured, threshold);
        Self { why: FrameRejection::new(rejection, measured, threshold), message }
    }
}

impl ImportedTake {
    /// Reads the files of a take of `speaker` and converts or rejects it.
    ///
    /// # Errors
    /// Unreadable motion or sound; the message names the file. A transcript that cannot be read is a note.
    pub fn read(found: &TakeFiles, limits: &TakeLimits, speaker: &str) -> Result<Self> {
        let content = hash_file(&found.motion)?;
        let stem = motion_file::stem(&found.motion).to_string_lossy();
        let name = format!("{}-{}", slug(&stem), content.get(..8).unwrap_or(&content));
        let mut captured = captured::read_in(found.kind, &found.motion, limits.units)?;
        if found.genea.as_ref().and_then(|genea| genea.speaker).is_some_and(|speaker| !speaker.has_fingers) {
            remove_fingers(&mut captured.motion);
        }
        let motion = resample::at_rate(&captured.motion, limits.fps);
        let n_frames = motion.n_frames();
        let sound = match &found.sound {
            _ if limits.no_sound => {
                let n_samples = sample_at(limits.fps, SAMPLE_RATE, n_frames);
                Some((Sound { rate: SAMPLE_RATE, samples: vec![0.0; n_samples] }, None))
            }
            Some(path) => audio::read_mono_with_note(path, SAMPLE_RATE)?.filter(|(sound, _)| !sound.samples.is_empty()),
            None => None,
        };
        let (sound, sound_note) = sound.map_or((None, None), |(sound, note)| (Some(sound), note));
        let outcome = match (rejection(n_frames, sound.as_ref(), found, limits), sound) {
            (None, Some(sound)) => {
                let accepted = to_accepted((&name, speaker), found, &captured, motion, sound)?;
                let mut accepted = AcceptedTake { sound_note, ..accepted };
                if let Some(genea) = &found.genea {
                    accepted.add_genea(genea, limits);
                }
                TakeOutcome::Accepted(Box::new(accepted))
            }
            (rejection, _) => TakeOutcome::Rejected(rejection.unwrap_or_else(|| no_sound(found))),
        };
        Ok(Self { name, content, n_frames, outcome })
    }
}

impl AcceptedTake {
    /// Adds what a challenge states about the take, and the interlocutor's sound at the sample's length.
    fn add_genea(&mut self, genea: &GeneaTake, limits: &TakeLimits) {
        if let Some(path) = &genea.missing_from {
            self.notes.push(format!("{} does not list this take: its speaker is unknown", file_name(path)));
        }
        if let (Some(speaker), Some(imported)) = (genea.speaker, self.sample.meta["imported"].as_object_mut()) {
            let GeneaSpeaker { id, has_fingers, interlocutor_id } = speaker;
            let facts = json!({ "speaker_id": id, "has_fingers": has_fingers, "interlocutor_id": interlocutor_id });
            imported.extend(facts.as_object().cloned().unwrap_or_default());
        }
        let Some(path) = genea.interlocutor.as_ref().filter(|_| !limits.no_sound) else { return };
        let Ok(Some((mut sound, _))) = audio::read_mono_with_note(path, SAMPLE_RATE) else {
            self.notes.push(format!("{} holds no readable sound: it is left out", file_name(path)));
            return;
        };
        let difference_secs = sound.secs() - self.sample.sound.secs();
        if difference_secs.abs() > limits.max_difference_secs {
            let differs = number(difference_secs.abs());
            let name = file_name(path);
            self.notes.push(format!("{name} differs by {differs} s from the take's length: it is cut or filled up"));
        }
        sound.samples.resize(self.sample.sound.samples.len(), 0.0);
        self.sample.meta["imported"]["interlocutor"] = file_name(path).into();
        self.sample.interlocutor = Some(sound);
    }
}

/// Masks the joints of the fingers.
fn remove_fingers(motion: &mut Motion) {
    for hand in [L_HAND, R_HAND] {
        let fingers = hand + 1..hand + N_HAND_JOINTS;
        motion.joints.slice_mut(s![.., fingers.clone(), ..]).fill(f32::NAN);
        motion.mask.slice_mut(s![.., fingers]).fill(false);
    }
}

fn rejection(n_frames: usize, sound: Option<&Sound>, found: &TakeFiles, limits: &TakeLimits) -> Option<TakeRejection> {
    let stem = found.motion.file_stem().unwrap_or_default().to_string_lossy();
    if found.kind == MotionKind::Authors && stem.starts_with("prediction") {
        return Some(TakeRejection::new(Rejection::Prediction, 0.0, 0.0));
    }
    let Some(sound) = sound else { return Some(no_sound(found)) };
    let (motion_secs, sound_secs) = (limits.fps.secs(n_frames), sound.secs());
    let difference_secs = sound_secs - motion_secs;
    if difference_secs.abs() > limits.max_difference_secs {
        return Some(TakeRejection {
            why: FrameRejection::new(Rejection::LengthMismatch, difference_secs.abs(), limits.max_difference_secs),
            message: format!(
                "the sound has {sound_secs:.3} s, the motion {motion_secs:.3} s: {:.3} s apart, at most {} s are believed",
                difference_secs.abs(),
                limits.max_difference_secs
            ),
        });
    }
    let n_common = n_common(n_frames, sound, limits.fps);
    (n_common < limits.min_frames)
        .then(|| TakeRejection::new(Rejection::FewFrames, n_common as f64, limits.min_frames as f64))
}

fn no_sound(found: &TakeFiles) -> TakeRejection {
    let message = match &found.sound {
        Some(sound) => format!("{} holds no sound", file_name(sound)),
        None => format!("no sound file has the name of {}", file_name(&found.motion)),
    };
    TakeRejection { why: FrameRejection::new(Rejection::NoSoundFile, 0.0, 0.0), message }
}

/// Number of frames of the motion that lie completely within the sound.
fn n_common(n_frames: usize, sound: &Sound, fps: FrameRate) -> usize {
    n_frames.min((sound.secs() * fps.per_sec() + 1e-6).floor() as usize)
}

fn to_accepted(
    (name, speaker): (&str, &str),
    found: &TakeFiles,
    captured: &CapturedMotion,
    mut motion: Motion,
    mut sound: Sound,
) -> Result<AcceptedTake> {
    let (fps, n_before) = (motion.fps, motion.n_frames());
    let lengths = bones::measure(&captured.motion);
    let n_frames = n_common(n_before, &sound, fps);
    motion.joints = motion.joints.slice(s![..n_frames, .., ..]).to_owned();
    motion.mask = motion.mask.slice(s![..n_frames, ..]).to_owned();
    let before = motion.joints.clone();
    bones::with_lengths(&mut motion, &lengths);
    let moved = moved_mm(&before, &motion.joints);
    let sound_secs = sound.secs();
    sound.samples.resize(sample_at(fps, SAMPLE_RATE, n_frames), 0.0);
    let choice = words::choose(&found.transcripts, speaker, sound_secs);
    let n_transcripts = choice.n_read;
    let transcript = choice.found.as_ref().map(|(_, transcript)| transcript.clone());
    let is_untimed = transcript.as_ref().is_some_and(|transcript| transcript.words.is_empty());
    let transcript = transcript.or_else(|| captured.text.as_deref().map(Transcript::of_text)).unwrap_or_default();
    let end_secs = fps.secs(n_frames);
    let video_words =
        (!found.transcripts.is_empty()).then(|| VideoWords::of(choice, &found.transcripts, sound_secs, 0.0));
    let report = video_words.as_ref().map(|words| words.report([(0.0, end_secs)]));
    let notes = report.as_ref().map(|report| report.notes.clone()).unwrap_or_default();
    let transcript = transcript.until(end_secs);
    let word_json =
        |word: &Word| json!({ "start_secs": word.start_secs, "end_secs": word.end_secs, "word": word.word });
    let visible_share = |root: usize| {
        let hand = motion.mask.slice(s![.., root..root + N_HAND_JOINTS]);
        hand.iter().filter(|&&seen| seen).count() as f64 / hand.len().max(1) as f64
    };
    let mut meta = json!({
        "video": name,
        "first_frame": 0,
        "n_frames": n_frames,
        "fps": fps,
        "start_secs": 0.0,
        "end_secs": fps.secs(n_frames),
        "image_size": null,
        "left_hand_seen": visible_share(L_HAND),
        "right_hand_seen": visible_share(R_HAND),
        "sound_samples_padded": 0,
        "imported": {
            "kind": found.kind.name(),
            "motion": file_name(&found.motion),
            "sound": found.sound.as_deref().map(file_name),
            "source_fps": captured.motion.fps,
            "motion_secs": fps.secs(n_before),
            "sound_secs": sound_secs,
            "bones_moved_mm": { "median": moved[0], "largest": moved[1] },
        },
        "text": transcript.text,
        "words": transcript.words.iter().map(word_json).collect::<Vec<_>>(),
    });
    if let Some(imported) = meta.get_mut("imported").and_then(Value::as_object_mut) {
        imported.extend(captured.facts.clone());
    }
    let pose2d = Array3::zeros((n_frames, N_KEYPOINTS, 3));
    let key = format!("{name}-{:06}", 0);
    let in_sample = video_words.filter(|_| !is_untimed).map(|words| words.within(0.0, end_secs));
    let (words, posture, interlocutor) = (in_sample, None, None);
    let sample = Sample { key, motion, pose2d, sound, words, posture, interlocutor, meta };
    sample.members().with_context(|| format!("cannot create a sample from {}", found.motion.display()))?;
    let words = report.filter(|_| !is_untimed);
    Ok(AcceptedTake { moved_mm: moved[0], sample, words, notes, n_transcripts, lengths, sound_note: None })
}

/// Shift of the joints between `before` and `after`: median and maximum, mm, rounded to 0.01.
fn moved_mm(before: &Array3<f32>, after: &Array3<f32>) -> [f64; 2] {
    let moved = (0..before.shape()[0])
        .flat_map(|t| (1..N_JOINTS).map(move |joint| (t, joint)))
        .map(|(t, joint)| (0..3).map(|k| (after[[t, joint, k]] - before[[t, joint, k]]).powi(2)).sum::<f32>().sqrt());
    let moved = Ordered::new(moved);
    let mm = |metres: Option<f32>| metres.map_or(0.0, |m| (f64::from(m) * 1e5).round() / 100.0);
    [mm(moved.upper_median()), mm(moved.lower_quantile(1.0))]
}
