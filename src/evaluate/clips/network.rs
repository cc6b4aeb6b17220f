//! Checkpoints under evaluation: a trained network of either kind, its name in the table, and its motion of the 49
//! joints for the sound and the words of an interval.

use crate::evaluate::baseline::predictor;
use crate::external::ffmpeg::audio;
use crate::formats::checkpoint;
use crate::formats::transcript::Word;
use crate::generate::GestureGenerator;
use crate::generate::normalisation::Normalisation;
use crate::generate::seq2seq::SequenceGenerator;
use crate::generate::seq2seq::metadata::is_sequence_kind;
use crate::mocap::bvh;
use crate::motion::resample;
use crate::pipeline::batch::motion_files::checkpoint_file;
use crate::types::pose3d::Motion;
use crate::types::skeleton::{L_HAND, N_JOINTS, is_duplicate};
use crate::types::sound::{SAMPLE_RATE, Sound};
use crate::types::sync;
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use ndarray::s;
use std::path::{Path, PathBuf};

/// Frames of silence behind the sound of a captured skeleton, so that its motion covers the interval at another rate.
const SPARE_FRAMES: usize = 2;

/// Network of a checkpoint.
pub enum TrainedNetwork {
    /// Of `orator train gan`.
    Gan(Box<GestureGenerator>),
    /// Of `orator train seq2seq`.
    Sequence(Box<SequenceGenerator>),
}

/// Checkpoint to be measured.
pub struct EvaluatedCheckpoint {
    /// Name in a table of several.
    pub name: String,
    pub network: TrainedNetwork,
}

impl EvaluatedCheckpoint {
    /// Opens checkpoints of `orator train gan` and `orator train seq2seq`: files, or folders of trainings (the best
    /// checkpoint, else the newest). Each is named by its kind, and where several are of one kind by its folder too.
    ///
    /// # Errors
    /// A path that is not there, a checkpoint of another kind, one that is given twice.
    pub fn open_all(paths: &[PathBuf]) -> Result<Vec<Self>> {
        let files: Vec<PathBuf> = paths.iter().map(|path| checkpoint_file(path)).collect::<Result<_>>()?;
        let places: Vec<PathBuf> = files.iter().map(std::fs::canonicalize).collect::<std::io::Result<_>>()?;
        for (at, place) in places.iter().enumerate() {
            let earlier = places[..at].iter().position(|other| other == place);
            ensure!(earlier.is_none(), "{} is given twice: give each checkpoint once", paths[at].display());
        }
        let networks: Vec<TrainedNetwork> =
            files.iter().map(|file| TrainedNetwork::open(file)).collect::<Result<_>>()?;
        let names = networks.iter().zip(&places).map(|(network, place)| network.names(place)).collect::<Vec<_>>();
        let opened = networks.into_iter().enumerate().map(|(at, network)| {
            let is_alone = |level: &usize| names.iter().filter(|of| of[*level] == names[at][*level]).count() == 1;
            let last = names[at].len() - 1;
            let name = match (0..=last).find(is_alone) {
                Some(level) => names[at][level].clone(),
                None => format!("{} {}", names[at][last], at + 1),
            };
            Self { name, network }
        });
        Ok(opened.collect())
    }
}

impl From<GestureGenerator> for EvaluatedCheckpoint {
    fn from(generator: GestureGenerator) -> Self {
        Self { name: "gan".to_owned(), network: TrainedNetwork::Gan(Box::new(generator)) }
    }
}

impl From<SequenceGenerator> for EvaluatedCheckpoint {
    fn from(generator: SequenceGenerator) -> Self {
        Self { name: "seq2seq".to_owned(), network: TrainedNetwork::Sequence(Box::new(generator)) }
    }
}

impl TrainedNetwork {
    fn open(file: &Path) -> Result<Self> {
        let kind = &checkpoint::facts(file)?["speaker"]["kind"];
        ensure!(
            kind.is_string(),
            "{} is a checkpoint of neither `orator train gan` nor `orator train seq2seq`",
            file.display()
        );
        Ok(match is_sequence_kind(kind) {
            true => Self::Sequence(Box::new(SequenceGenerator::open(file)?)),
            false => Self::Gan(Box::new(GestureGenerator::open(file)?)),
        })
    }

    /// Names from the shortest to the most exact.
    fn names(&self, place: &Path) -> [String; 4] {
        let name = |path: Option<&Path>| {
            path.and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
        };
        let (folder, file) = (name(place.parent()), place.with_extension(""));
        let (kind, network) = match self {
            Self::Gan(_) => ("gan", "gan".to_owned()),
            Self::Sequence(of) => {
                ("seq2seq", format!("seq2seq {}", format!("{:?}", of.metadata.architecture).to_lowercase()))
            }
        };
        let of_folder = format!("{network} {folder}");
        [kind.to_owned(), network, of_folder.clone(), format!("{of_folder}/{}", name(Some(&file)))]
    }

    /// Speaker, or folder of captures.
    pub fn speaker(&self) -> &str {
        match self {
            Self::Gan(of) => of.name(),
            Self::Sequence(of) => &of.metadata.name,
        }
    }

    /// Rate of its motion.
    pub fn fps(&self) -> FrameRate {
        match self {
            Self::Gan(of) => of.fps(),
            Self::Sequence(of) => of.fps(),
        }
    }

    /// Samples a second of the sound that it hears.
    pub fn rate(&self) -> u32 {
        match self {
            Self::Gan(_) => SAMPLE_RATE,
            Self::Sequence(of) => of.metadata.rate,
        }
    }

    /// Number of the words that it knows; 0: it reads none.
    pub fn n_words(&self) -> usize {
        match self {
            Self::Gan(_) => 0,
            Self::Sequence(of) => of.metadata.vocabulary.words().len(),
        }
    }

    /// Normalisation of the dataset that it learnt from; `None`: it learnt a captured skeleton.
    pub fn normalisation(&self) -> Option<&Normalisation> {
        match self {
            Self::Gan(of) => Some(&of.metadata.normalisation),
            Self::Sequence(of) => of.metadata.poses.normalisation(),
        }
    }

    /// Motion for the sound of an interval, `n_frames` at `fps`, which is its own rate but for a captured skeleton. That one
    /// is read as its captures are imported, and has no fingers (NaN): it holds them as in its first file.
    ///
    /// # Errors
    /// Numbers that are not finite; a captured skeleton that is no speaker's.
    pub fn motion(&self, sound: &Sound, words: &[Word], n_frames: usize, fps: FrameRate) -> Result<Motion> {
        let network = match self {
            Self::Gan(of) => return predictor::motion(of, sound, n_frames),
            Self::Sequence(network) => network,
        };
        let rate = network.metadata.rate;
        let spare = if network.is_captured() { SPARE_FRAMES } else { 0 };
        let wanted = sync::sample_at(fps, rate, n_frames) + sync::sample_at(network.fps(), rate, spare) + 1;
        let mut sound = audio::at_rate(sound, rate)?;
        sound.samples.resize(sound.samples.len().max(wanted), 0.0);
        let poses = network.poses(&sound, words)?;
        let motion = match network.is_captured() {
            true => {
                let captured = bvh::of_text(&network.bvh(&poses)?).context("its skeleton is no speaker's")?;
                resample::at_rate(&without_fingers(captured.motion), fps)
            }
            false => network.motion(&poses)?,
        };
        let n_made = motion.n_frames();
        ensure!(n_made >= n_frames, "{n_made} frames of motion for {n_frames} of sound");
        Ok(Motion::from_joints(fps, motion.joints.slice_move(s![..n_frames, .., ..])))
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
