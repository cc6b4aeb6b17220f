//! Data of the sequence networks: a dataset of this program, or a folder of captures. Both become pose sequences.

use super::captures::CaptureFolder;
use super::segments::{PoseSequence, SequenceSplits};
use crate::generate::representation::Representation;
use crate::generate::seq2seq::architecture;
use crate::generate::seq2seq::poses::PoseFormat;
use crate::train::gan::speakers::normalisation;
use anyhow::{Result, bail, ensure};
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_dataset::index::SampleRef;
use orator_dataset::{Dataset, Split};
use orator_formats::bvh::exponential_maps::FPS;
use rayon::prelude::*;

#[derive(Clone, Copy)]
pub enum TrainingSource<'a> {
    Dataset(&'a Dataset),
    Captures(&'a CaptureFolder),
}

impl TrainingSource<'_> {
    /// Name of the speaker, or of the folder of captures.
    pub fn name(&self) -> String {
        match self {
            Self::Dataset(dataset) => dataset.info().speaker.clone(),
            Self::Captures(captures) => captures.name(),
        }
    }

    pub fn path(&self) -> String {
        match self {
            Self::Dataset(dataset) => dataset.dir().display().to_string(),
            Self::Captures(captures) => captures.dir().display().to_string(),
        }
    }

    pub fn fps(&self) -> FrameRate {
        match self {
            Self::Dataset(dataset) => dataset.info().fps,
            Self::Captures(_) => FPS,
        }
    }

    /// Sample rate of the sound, Hz.
    pub fn rate(&self) -> u32 {
        match self {
            Self::Dataset(_) => SAMPLE_RATE,
            Self::Captures(captures) => captures.rate,
        }
    }

    pub fn hash(&self) -> Result<String> {
        match self {
            Self::Dataset(dataset) => dataset.hash(),
            Self::Captures(captures) => captures.hash(),
        }
    }

    /// Format of the pose features, with means and scales of the training data. Errors name the file.
    pub fn pose_format(&self) -> Result<PoseFormat> {
        match self {
            Self::Dataset(dataset) => {
                ensure!(
                    !dataset.info().no_sound,
                    "{} was imported without audio, but training needs speech; import it with its audio files",
                    dataset.dir().display()
                );
                let normalisation = normalisation(dataset)?;
                let features = |sample: &SampleRef| Ok(normalisation.features(&dataset.read(sample)?.motion));
                let samples = dataset.samples(Split::Train);
                let all = samples.par_iter().map(features).collect::<Result<Vec<_>>>()?;
                let poses = all.into_iter().map(Ok);
                let representation = Representation::bones(&normalisation, poses)?;
                Ok(PoseFormat::Joints { normalisation, representation })
            }
            Self::Captures(captures) => Ok(PoseFormat::Captured(captures.exponential_maps()?)),
        }
    }

    /// All sequences in this format, with audio features for contexts of `context` frames.
    ///
    /// # Errors
    /// A file that cannot be read, with its name; a format of the other kind of data.
    pub fn sequences(&self, format: &PoseFormat, context: usize) -> Result<SequenceSplits> {
        match (self, format) {
            (Self::Dataset(dataset), PoseFormat::Joints { representation, .. }) => {
                let of_split = |split| of_split(dataset, split, representation, context);
                Ok(SequenceSplits {
                    train: of_split(Split::Train)?,
                    held_out: of_split(Split::Validation)?,
                    notes: Vec::new(),
                })
            }
            (Self::Captures(captures), PoseFormat::Captured(maps)) => captures.sequences(maps, context),
            _ => {
                bail!("the checkpoint was trained on another kind of data (dataset or captures); choose another --out")
            }
        }
    }
}

fn of_split(
    dataset: &Dataset,
    split: Split,
    representation: &Representation,
    context: usize,
) -> Result<Vec<PoseSequence>> {
    let read = |sample: &SampleRef| -> Result<PoseSequence> {
        let sample = dataset.read(sample)?;
        let (directions, known) = representation.directions(&sample.motion);
        let n = sample.motion.n_frames();
        let audio = architecture::audio_features(&sample.sound, sample.motion.fps, n, n, context);
        Ok(PoseSequence::new(directions, known, audio, sample.words.unwrap_or_default()))
    };
    dataset.samples(split).par_iter().map(read).collect()
}
