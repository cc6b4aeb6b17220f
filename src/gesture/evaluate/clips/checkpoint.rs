//! Checkpoints under evaluation: a trained network of either kind, its name in the table, and the motion of the 49
//! joints that it generates for the sound and the words of an interval; and the notes below the table about checkpoints
//! and compared joints.

use super::clips::EvalClips;
use crate::evaluate::baseline::predictor;
use crate::generate::GestureGenerator;
use crate::generate::model::checkpoint_file;
use crate::generate::seq2seq::SequenceGenerator;
use crate::generate::trained::TrainedSpeaker;
use anyhow::{Context, Result, ensure};
use candle_core::Device;
use ndarray::s;
use orator_base::motion::resample;
use orator_base::text::counted;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::{self, L_HAND, N_JOINTS, NECK, is_duplicate};
use orator_base::types::sound::{SAMPLE_RATE, Sound, sample_at};
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Split};
use orator_formats::mocap::bvh;
use orator_formats::transcript::Word;
use orator_formats::word_vectors::WordVectors;
use orator_media::ffmpeg::audio;
use orator_nn::seq2seq::predict::StateAtSeams;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Frames of silence appended to the sound for a captured skeleton, so that the resampled motion covers the interval.
const EXTRA_FRAMES: usize = 2;

pub struct EvaluatedCheckpoint {
    /// Name in a table of several checkpoints.
    pub name: String,
    pub speaker: TrainedSpeaker,
    /// Whether a sequence-to-sequence network is requested to carry its decoder state across segments.
    pub carry_state: bool,
}

impl EvaluatedCheckpoint {
    /// Opens checkpoints of `orator train gan` and `orator train seq2seq`: files, or folders of trainings (the best
    /// checkpoint, else the newest). `speaker` selects the speaker of networks of several. Each checkpoint is named by
    /// its kind, extended by network, folder and file as far as needed for unique names.
    ///
    /// # Errors
    /// A path that does not exist; a checkpoint of another kind; a checkpoint that is given twice.
    pub fn open_all(paths: &[PathBuf], speaker: &str) -> Result<Vec<Self>> {
        Self::open_all_on(paths, speaker, &Device::Cpu)
    }

    /// Like `open_all`, on `device`.
    pub fn open_all_on(paths: &[PathBuf], speaker: &str, device: &Device) -> Result<Vec<Self>> {
        let files: Vec<PathBuf> = paths.iter().map(|path| checkpoint_file(path)).collect::<Result<_>>()?;
        let paths_on_disk: Vec<PathBuf> = files.iter().map(std::fs::canonicalize).collect::<std::io::Result<_>>()?;
        for (at, path_on_disk) in paths_on_disk.iter().enumerate() {
            let earlier = paths_on_disk[..at].iter().position(|other| other == path_on_disk);
            ensure!(earlier.is_none(), "{} is given twice: give each checkpoint once", paths[at].display());
        }
        let speakers: Vec<TrainedSpeaker> =
            files.iter().map(|file| TrainedSpeaker::open_for(file, speaker, device)).collect::<Result<_>>()?;
        let names = speakers
            .iter()
            .zip(&paths_on_disk)
            .map(|(speaker, path_on_disk)| names(speaker, path_on_disk))
            .collect::<Vec<_>>();
        let opened = speakers.into_iter().enumerate().map(|(at, speaker)| {
            let is_alone = |level: &usize| names.iter().filter(|of| of[*level] == names[at][*level]).count() == 1;
            let last = names[at].len() - 1;
            let name = match (0..=last).find(is_alone) {
                Some(level) => names[at][level].clone(),
                None => format!("{} {}", names[at][last], at + 1),
            };
            Self { name, speaker, carry_state: false }
        });
        Ok(opened.collect())
    }

    /// Options for sequence-to-sequence networks: a table with vectors of words that are not in the vocabulary, for
    /// those that read words, and whether the decoder state is carried across segments. Other networks are unaffected.
    ///
    /// # Errors
    /// An option that applies to none of the checkpoints; word vectors of another dimension than those of a checkpoint.
    pub fn set_options(checkpoints: &mut [Self], words: Option<&Arc<WordVectors>>, carry_state: bool) -> Result<()> {
        ensure!(
            words.is_none() || checkpoints.iter().any(|of| of.speaker.reads_words()),
            "none of the checkpoints is of a network that reads words: omit --words"
        );
        ensure!(
            !carry_state || checkpoints.iter().any(|of| of.speaker.has_state()),
            "none of the checkpoints is of a network with a decoder state: omit --carry-state"
        );
        for of in checkpoints {
            if let Some(words) = words.filter(|_| of.speaker.reads_words()) {
                of.speaker.set_word_vectors(words.clone())?;
            }
            of.carry_state = carry_state && of.speaker.has_state();
        }
        Ok(())
    }

    /// Initial decoder state of the segments; `None` for a GAN.
    pub fn seams(&self) -> Option<StateAtSeams> {
        match &self.speaker {
            TrainedSpeaker::Gan(_) => None,
            TrainedSpeaker::Sequence(network) => Some(network.seams(self.carry_state)),
        }
    }
}

impl From<GestureGenerator> for EvaluatedCheckpoint {
    fn from(generator: GestureGenerator) -> Self {
        Self { name: "gan".to_owned(), speaker: TrainedSpeaker::Gan(Box::new(generator)), carry_state: false }
    }
}

impl From<SequenceGenerator> for EvaluatedCheckpoint {
    fn from(generator: SequenceGenerator) -> Self {
        let speaker = TrainedSpeaker::Sequence(Box::new(generator));
        Self { name: "seq2seq".to_owned(), speaker, carry_state: false }
    }
}

/// Candidate names from the shortest to the most specific.
fn names(speaker: &TrainedSpeaker, path_on_disk: &Path) -> [String; 4] {
    let name = |path: Option<&Path>| {
        path.and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let (folder, file) = (name(path_on_disk.parent()), path_on_disk.with_extension(""));
    let (kind, network) = match speaker.architecture() {
        None => ("gan", "gan".to_owned()),
        Some(architecture) => ("seq2seq", format!("seq2seq {}", format!("{architecture:?}").to_lowercase())),
    };
    let of_folder = format!("{network} {folder}");
    [kind.to_owned(), network, of_folder.clone(), format!("{of_folder}/{}", name(Some(&file)))]
}

impl EvaluatedCheckpoint {
    /// Generates motion and, if the network was trained on it, posture for the sound of an interval: `n_frames` at
    /// `fps`, the network's own frame rate except for captured skeletons, which are resampled. Motion of a captured
    /// skeleton is converted like imported captures; its fingers, which are constant, are missing (NaN).
    ///
    /// # Errors
    /// Network output that is not finite; a captured skeleton that cannot be imported.
    pub fn motion(
        &self,
        sound: &Sound,
        words: &[Word],
        n_frames: usize,
        fps: FrameRate,
    ) -> Result<(Motion, Option<Posture>)> {
        let network = match &self.speaker {
            TrainedSpeaker::Gan(of) => return predictor::motion(of, sound, words, n_frames),
            TrainedSpeaker::Sequence(network) => network,
        };
        let rate = network.metadata.rate;
        let extra = if network.is_captured() { EXTRA_FRAMES } else { 0 };
        let n_needed = sample_at(fps, rate, n_frames) + sample_at(network.fps(), rate, extra) + 1;
        let mut sound = audio::at_rate(sound, rate)?;
        sound.samples.resize(sound.samples.len().max(n_needed), 0.0);
        let poses = network.generate(&network.prepare(&sound, words)?, network.seams(self.carry_state))?;
        let motion = if network.is_captured() {
            let captured = bvh::from_text(&network.bvh(&poses)?).context("cannot convert its skeleton to 49 joints")?;
            resample::at_rate(&without_fingers(captured.motion), fps)
        } else {
            network.motion(&poses)?
        };
        let n_generated = motion.n_frames();
        ensure!(
            n_generated >= n_frames,
            "{n_generated} frames of motion were generated for {n_frames} frames of audio"
        );
        Ok((Motion::from_joints(fps, motion.joints.slice_move(s![..n_frames, .., ..])), None))
    }
}

fn without_fingers(mut motion: Motion) -> Motion {
    for joint in (L_HAND..N_JOINTS).filter(|joint| !is_duplicate(*joint)) {
        motion.joints.slice_mut(s![.., joint, ..]).fill(f32::NAN);
        motion.mask.column_mut(joint).fill(false);
    }
    motion
}

/// Notes on how the training data of the checkpoints differ from the evaluated split with these `words`, and on the
/// options of the sequence-to-sequence networks.
pub fn of_checkpoints(
    dataset: &Dataset,
    checkpoints: &[EvaluatedCheckpoint],
    words: &[Word],
    split: Split,
) -> Vec<String> {
    let mut notes = Vec::new();
    if split == Split::Train {
        notes
            .push("warning: the checkpoint was trained on this split, and its metrics measure memorisation".to_owned());
    }
    let (host, fps) = (&dataset.info().speaker, dataset.info().fps);
    let first_of_dataset = checkpoints.iter().position(|of| of.speaker.normalisation().is_some());
    for (at, checkpoint) in checkpoints.iter().enumerate() {
        let EvaluatedCheckpoint { name, speaker, .. } = checkpoint;
        let (model_speaker, is_first) = (speaker.name(), first_of_dataset == Some(at));
        if speaker.normalisation().is_none() {
            notes.push(format!(
                "{name} was trained on the captures {model_speaker}, not on this dataset: the takes of this split must be held out \
                 there. Its motion was imported like captures and has the bone lengths of the other predictors"
            ));
            if speaker.fps() != fps {
                notes.push(format!("the motion of {name} was resampled from {} to {fps}", speaker.fps()));
            }
        } else if host != model_speaker && is_first {
            notes.push(format!(
                "the dataset is of {host}, the checkpoint of {model_speaker}: the truth has the checkpoint's bone lengths"
            ));
        } else if host != model_speaker {
            notes.push(format!(
                "{name} is a model of {model_speaker}, not of {host}: it has the bone lengths of the other predictors"
            ));
        }
        if speaker.rate() != SAMPLE_RATE {
            notes.push(format!(
                "{name} was trained on audio at {} Hz; the dataset has audio at {SAMPLE_RATE} Hz, without frequencies above {} Hz, \
                 which may degrade its motion",
                speaker.rate(),
                SAMPLE_RATE / 2
            ));
        }
        if checkpoint.seams() == Some(StateAtSeams::Carried) {
            notes.push(format!("{name} carries its decoder state across segments"));
        }
        if let Some(known_words) = speaker.known_words()
            && let Some(n_from_table) = known_words.n_from_table(words)
        {
            let n_known = known_words.vocabulary.n_known(words);
            let n_words = counted(words.len(), "word");
            notes.push(format!(
                "{n_known} of {n_words} of this split are in the vocabulary of {name}, {n_from_table} of the others in \
                 the table of word vectors"
            ));
        }
        if speaker.n_words() > 0 && words.is_empty() {
            notes.push(format!(
                "{name} uses words, and this split has none: its motion is generated from the audio only"
            ));
        }
    }
    notes
}

/// Note on the joints that are compared, if not all are, and on how often all of these are visible.
pub fn of_joints(clips: &EvalClips, common: &[usize]) -> String {
    let missing = || (NECK + 1..N_JOINTS).filter(|joint| !common.contains(joint));
    let is_finger = |joint: &usize| *joint > L_HAND && !is_duplicate(*joint);
    let n_fingers = missing().filter(is_finger).count();
    let fingers = (n_fingers > 0).then(|| counted(n_fingers, "finger joint"));
    let others = missing().filter(|joint| !is_finger(joint)).map(skeleton::name);
    let left_out: Vec<String> = fingers.into_iter().chain(others).collect();
    let is_complete =
        |seen: ndarray::ArrayView1<bool>| common.iter().filter(|joint| **joint != NECK).all(|joint| seen[*joint]);
    let n_whole: usize =
        clips.clips.iter().map(|clip| clip.mask.outer_iter().filter(|seen| is_complete(*seen)).count()).sum();
    let share = 100.0 * n_whole as f64 / clips.n_frames().max(1) as f64;
    format!(
        "all rows, including the truth, are measured on the joints that all predictors have, {} of {}; left out: {}. These \
         joints are all visible in {share:.1} % of the frames",
        counted(common.iter().filter(|joint| **joint != NECK).count(), "joint"),
        N_JOINTS - 1,
        left_out.join(", ")
    )
}
