//! What is learnt from: a dataset of this program, or a folder of captures; both become sequences of poses.

use super::captures::CaptureFolder;
use super::sequence::{PoseSequence, SequenceSplits};
use crate::generate::representation::Representation;
use crate::generate::seq2seq::architecture;
use crate::generate::seq2seq::poses::PoseNumbers;
use crate::train::gan::begin::normalisation;
use anyhow::{Result, bail, ensure};
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_dataset::index::SampleRef;
use orator_dataset::{Dataset, Split};
use orator_formats::bvh::exponential_maps::FPS;
use rayon::prelude::*;

/// Data to learn from.
#[derive(Clone, Copy)]
pub enum TrainingSource<'a> {
    Dataset(&'a Dataset),
    Captures(&'a CaptureFolder),
}

impl TrainingSource<'_> {
    /// Name of the speaker, or of the folder.
    pub fn name(&self) -> String {
        match self {
            Self::Dataset(dataset) => dataset.info().speaker.clone(),
            Self::Captures(captures) => captures.name(),
        }
    }

    /// The folder, as a text.
    pub fn place(&self) -> String {
        match self {
            Self::Dataset(dataset) => dataset.dir().display().to_string(),
            Self::Captures(captures) => captures.dir().display().to_string(),
        }
    }

    /// Poses a second.
    pub fn fps(&self) -> FrameRate {
        match self {
            Self::Dataset(dataset) => dataset.info().fps,
            Self::Captures(_) => FPS,
        }
    }

    /// Samples of sound a second.
    pub fn rate(&self) -> u32 {
        match self {
            Self::Dataset(_) => SAMPLE_RATE,
            Self::Captures(captures) => captures.rate,
        }
    }

    /// Hash of the data.
    pub fn hash(&self) -> Result<String> {
        match self {
            Self::Dataset(dataset) => dataset.hash(),
            Self::Captures(captures) => captures.hash(),
        }
    }

    /// Meaning of the numbers of a pose, with means and scales of the data to train on. Errors name the file.
    pub fn pose_numbers(&self) -> Result<PoseNumbers> {
        match self {
            Self::Dataset(dataset) => {
                ensure!(
                    !dataset.info().no_sound,
                    "{} was imported without sound, so that there is no speech to learn from",
                    dataset.dir().display()
                );
                let normalisation = normalisation(dataset)?;
                let features = |sample: &SampleRef| Ok(normalisation.features(&dataset.read(sample)?.motion));
                let samples = dataset.samples(Split::Train);
                let all = samples.par_iter().map(features).collect::<Result<Vec<_>>>()?;
                let poses = all.into_iter().map(Ok);
                let representation = Representation::bones(&normalisation, poses)?;
                Ok(PoseNumbers::Joints { normalisation, representation })
            }
            Self::Captures(captures) => Ok(PoseNumbers::Captured(captures.exponential_maps()?)),
        }
    }

    /// All sequences in these numbers, heard in contexts of so many frames. Errors name the file.
    pub fn sequences(&self, numbers: &PoseNumbers, context: usize) -> Result<SequenceSplits> {
        match (self, numbers) {
            (Self::Dataset(dataset), PoseNumbers::Joints { representation, .. }) => {
                let of_split = |split| of_split(dataset, split, representation, context);
                Ok(SequenceSplits {
                    train: of_split(Split::Train)?,
                    held_out: of_split(Split::Validation)?,
                    notes: Vec::new(),
                })
            }
            (Self::Captures(captures), PoseNumbers::Captured(maps)) => captures.sequences(maps, context),
            _ => bail!("the checkpoint is of the other kind of data; choose another --out"),
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
        let (numbers, known) = representation.directions(&sample.motion);
        let n = sample.motion.n_frames();
        let audio = architecture::audio_features(&sample.sound, sample.motion.fps, n, n, context);
        Ok(PoseSequence::new(numbers, known, audio, sample.words.unwrap_or_default()))
    };
    dataset.samples(split).par_iter().map(read).collect()
}
