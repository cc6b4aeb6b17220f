//! Checkpoints under evaluation: a trained network of either kind, its name in the table, and its motion of the 49
//! joints for the sound and the words of an interval.

use crate::evaluate::baseline::predictor;
use crate::generate::GestureGenerator;
use crate::generate::model::checkpoint_file;
use crate::generate::seq2seq::SequenceGenerator;
use crate::generate::trained::TrainedSpeaker;
use anyhow::{Context, Result, ensure};
use ndarray::s;
use orator_base::motion::resample;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, is_duplicate};
use orator_base::types::sound::{Sound, sample_at};
use orator_base::types::time::FrameRate;
use orator_formats::mocap::bvh;
use orator_formats::transcript::Word;
use orator_media::ffmpeg::audio;
use std::path::{Path, PathBuf};

/// Frames of silence behind the sound of a captured skeleton, so that its motion covers the interval at another rate.
const SPARE_FRAMES: usize = 2;

/// Checkpoint to be measured.
pub struct EvaluatedCheckpoint {
    /// Name in a table of several.
    pub name: String,
    pub speaker: TrainedSpeaker,
}

impl EvaluatedCheckpoint {
    /// Opens checkpoints of `orator train gan` and `orator train seq2seq`: files, or folders of trainings (the best
    /// checkpoint, else the newest); of networks of several speakers the one of this name. Each is named by its kind, and
    /// where several are of one kind by its folder too.
    ///
    /// # Errors
    /// A path that is not there, a checkpoint of another kind, one that is given twice.
    pub fn open_all(paths: &[PathBuf], speaker: &str) -> Result<Vec<Self>> {
        let files: Vec<PathBuf> = paths.iter().map(|path| checkpoint_file(path)).collect::<Result<_>>()?;
        let places: Vec<PathBuf> = files.iter().map(std::fs::canonicalize).collect::<std::io::Result<_>>()?;
        for (at, place) in places.iter().enumerate() {
            let earlier = places[..at].iter().position(|other| other == place);
            ensure!(earlier.is_none(), "{} is given twice: give each checkpoint once", paths[at].display());
        }
        let speakers: Vec<TrainedSpeaker> =
            files.iter().map(|file| TrainedSpeaker::open_for(file, speaker)).collect::<Result<_>>()?;
        let names = speakers.iter().zip(&places).map(|(speaker, place)| names(speaker, place)).collect::<Vec<_>>();
        let opened = speakers.into_iter().enumerate().map(|(at, speaker)| {
            let is_alone = |level: &usize| names.iter().filter(|of| of[*level] == names[at][*level]).count() == 1;
            let last = names[at].len() - 1;
            let name = match (0..=last).find(is_alone) {
                Some(level) => names[at][level].clone(),
                None => format!("{} {}", names[at][last], at + 1),
            };
            Self { name, speaker }
        });
        Ok(opened.collect())
    }
}

impl From<GestureGenerator> for EvaluatedCheckpoint {
    fn from(generator: GestureGenerator) -> Self {
        Self { name: "gan".to_owned(), speaker: TrainedSpeaker::Gan(Box::new(generator)) }
    }
}

impl From<SequenceGenerator> for EvaluatedCheckpoint {
    fn from(generator: SequenceGenerator) -> Self {
        Self { name: "seq2seq".to_owned(), speaker: TrainedSpeaker::Sequence(Box::new(generator)) }
    }
}

/// Names from the shortest to the most exact.
fn names(speaker: &TrainedSpeaker, place: &Path) -> [String; 4] {
    let name = |path: Option<&Path>| {
        path.and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let (folder, file) = (name(place.parent()), place.with_extension(""));
    let (kind, network) = match speaker.architecture() {
        None => ("gan", "gan".to_owned()),
        Some(architecture) => ("seq2seq", format!("seq2seq {}", format!("{architecture:?}").to_lowercase())),
    };
    let of_folder = format!("{network} {folder}");
    [kind.to_owned(), network, of_folder.clone(), format!("{of_folder}/{}", name(Some(&file)))]
}

impl EvaluatedCheckpoint {
    /// Motion and, where it is learnt, posture for the sound of an interval, `n_frames` at `fps`, which is its own rate but for a captured skeleton. That one
    /// is read as its captures are imported, and has no fingers (NaN): it holds them as in its first file.
    ///
    /// # Errors
    /// Numbers that are not finite; a captured skeleton that is no speaker's.
    pub fn motion(
        &self,
        sound: &Sound,
        words: &[Word],
        n_frames: usize,
        fps: FrameRate,
    ) -> Result<(Motion, Option<Posture>)> {
        let network = match &self.speaker {
            TrainedSpeaker::Gan(of) => return predictor::motion(of, sound, n_frames),
            TrainedSpeaker::Sequence(network) => network,
        };
        let rate = network.metadata.rate;
        let spare = if network.is_captured() { SPARE_FRAMES } else { 0 };
        let wanted = sample_at(fps, rate, n_frames) + sample_at(network.fps(), rate, spare) + 1;
        let mut sound = audio::at_rate(sound, rate)?;
        sound.samples.resize(sound.samples.len().max(wanted), 0.0);
        let poses = network.poses(&sound, words)?;
        let motion = if network.is_captured() {
            let captured = bvh::from_text(&network.bvh(&poses)?).context("its skeleton is no speaker's")?;
            resample::at_rate(&without_fingers(captured.motion), fps)
        } else {
            network.motion(&poses)?
        };
        let n_made = motion.n_frames();
        ensure!(n_made >= n_frames, "{n_made} frames of motion for {n_frames} of sound");
        Ok((Motion::from_joints(fps, motion.joints.slice_move(s![..n_frames, .., ..])), None))
    }
}

/// Motion whose fingers are missing.
fn without_fingers(mut motion: Motion) -> Motion {
    for joint in (L_HAND..N_JOINTS).filter(|joint| !is_duplicate(*joint)) {
        motion.joints.slice_mut(s![.., joint, ..]).fill(f32::NAN);
        motion.mask.column_mut(joint).fill(false);
    }
    motion
}
