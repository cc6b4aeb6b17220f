//! Validation of the generator on held-out intervals, in comparison with a constant mean pose. Each interval is
//! generated as a whole, as in `generate`, and evaluated in blocks of the window length.

use super::block_metrics::{
    AngleSums, BlockDistance, BlockErrors, BlockSettings, HeldOutBlock, NormalisedBlock, PredictorSums, RunningMean,
    bone_changes, mean_error, reduction,
};
use super::score::{self, Validation};
use super::speakers;
use super::step::GanTrainer;
use super::windows::{WindowBatch, WindowLoader, needed};
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::generate::seq2seq::architecture::Vocabulary;
use crate::metrics::distribution::frechet;
use crate::train::no_window;
use anyhow::{Context, Result};
use candle_core::Tensor;
use ndarray::{Array2, Array3, ArrayView2};
use orator_base::stage::progress::Progress;
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_WRIST};
use orator_dataset::config::GanSettings;
use orator_dataset::{Dataset, Split};
use orator_nn::gan::generator::FRAMES_MULTIPLE;

/// Largest number of frames in a validation, 18 minutes at 15 fps.
const MAX_FRAMES: usize = 16_384;
/// Largest number of frames generated at once.
const PIECE: usize = 2_048;

pub struct ValidationIntervals {
    split: Split,
    /// Frames per block.
    n_frames: usize,
    /// One interval, or a part of a long one, per batch of size 1; the sound is up to 31 frames longer than the poses.
    pieces: Vec<WindowBatch>,
    settings: BlockSettings,
}

impl ValidationIntervals {
    /// Intervals of the validation splits, evenly spaced if there are many. For a dataset without a validation window
    /// those of its training split are used, which is reported. Speaker indices follow the order of `datasets`; word
    /// indices are those of `vocabulary`.
    pub fn load(
        datasets: &[(&Dataset, Normalisation)],
        vocabulary: Option<&Vocabulary>,
        settings: &GanSettings,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let mut all: Option<Self> = None;
        for (speaker, (dataset, normal)) in (0..).zip(datasets) {
            let max_frames = MAX_FRAMES / datasets.len();
            let mut own = Self::of_speaker((dataset, normal), vocabulary, settings, max_frames, progress)?;
            own.pieces.iter_mut().for_each(|piece| piece.speakers = vec![speaker]);
            all = Some(match all {
                None => own,
                Some(mut all) => {
                    all.pieces.extend(own.pieces);
                    all.settings.joints.retain(|joint| own.settings.joints.contains(joint));
                    all.split = if own.split == Split::Train { own.split } else { all.split };
                    all
                }
            });
        }
        all.context("no speaker to validate on")
    }

    fn of_speaker(
        (dataset, normal): (&Dataset, &Normalisation),
        vocabulary: Option<&Vocabulary>,
        settings: &GanSettings,
        max_frames: usize,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let n_frames = settings.window_frames;
        let mut split = Split::Validation;
        let mut loader = WindowLoader::load(dataset, split, normal, n_frames, n_frames)?;
        if loader.is_empty() {
            let cause = no_window::cause(dataset, split, needed(n_frames)).unwrap_or_default();
            progress.say(&format!("no validation windows, so the metrics are those of training windows: {cause}"));
            split = Split::Train;
            loader = WindowLoader::load(dataset, split, normal, n_frames, n_frames)?;
        }
        let look_ahead = speakers::look_ahead(settings, dataset.info().fps);
        let loader = loader.with_look_ahead(look_ahead).with_words(vocabulary)?;
        let longest = PIECE.max(n_frames);
        let parts: Vec<_> = loader.parts(longest).into_iter().filter(|part| part.1.len() >= n_frames).collect();
        let all: usize = parts.iter().map(|part| part.1.len()).sum();
        let n = (parts.len() * max_frames).div_ceil(all.max(max_frames)).min(parts.len());
        let chosen = (0..n).map(|i| parts[i * parts.len() / n].clone());
        let pieces: Vec<WindowBatch> =
            chosen.map(|(interval, frames)| loader.part(interval, frames)).collect::<Result<_>>()?;
        let mut masks = Vec::new();
        for piece in &pieces {
            masks.push(visible_joints(features(&piece.mask, 0)?.view()));
        }
        let joints = frechet::joints(masks.iter().map(|mask| mask.view()));
        Ok(Self { split, n_frames, pieces, settings: BlockSettings { fps: dataset.info().fps, joints } })
    }

    /// Metrics of the generator and of the mean pose on the same blocks.
    pub fn validate(&self, trainer: &GanTrainer) -> Result<Validation> {
        let (generator, speakers) = (trainer.ema_generator(), trainer.speakers.all());
        let (mut predicted, mut mean_pose, mut ground_truth) =
            (PredictorSums::default(), PredictorSums::default(), PredictorSums::default());
        let (mut change, mut spread) = (RunningMean::default(), BlockDistance::default());
        let mut errors: Vec<BlockErrors> = speakers.iter().map(|_| BlockErrors::default()).collect();
        let channels = &speakers[0].normalisation.channels;
        let mut angles: Vec<AngleSums> = channels.iter().map(|_| AngleSums::default()).collect();
        let mut n_windows = 0;
        for piece in &self.pieces {
            let piece = &piece.on(trainer.device())?;
            let n_padded = piece.poses.dim(2)?.next_multiple_of(FRAMES_MULTIPLE);
            let Some(speaker) = piece.speakers.first().map(|speaker| *speaker as usize) else { continue };
            let normal = &speakers[speaker].normalisation;
            let encoded = generator.frames(&piece.mels, &piece.speakers, piece.words.as_ref(), n_padded, false)?;
            let raw = generator.decode(&encoded, false)?.detach();
            let poses = trainer.speakers.poses(&raw, &piece.speakers)?;
            let batch = &WindowBatch {
                mels: piece.mels.clone(),
                poses: self.blocks(&piece.poses)?,
                mask: self.blocks(&piece.mask)?,
                speakers: piece.speakers.clone(),
                words: None,
            };
            let poses = self.blocks(&poses.narrow(2, 0, piece.poses.dim(2)?)?)?;
            for (n, (of, sums)) in normal.channels.iter().zip(&mut angles).enumerate() {
                sums.add(&poses, batch, N_FEATURES + 3 * n, of.std)?;
            }
            let mean_pose_block = joints(&poses.zeros_like()?, 0, normal)?;
            for i in 0..poses.dim(0)? {
                let block = block(&poses, batch, i, normal)?;
                predicted.add(block.predicted.view(), &block, &self.settings);
                mean_pose.add(mean_pose_block.view(), &block, &self.settings);
                ground_truth.add(block.ground_truth.view(), &block, &self.settings);
                change.add(bone_changes(block.predicted.view()));
                spread.add(&block);
                errors[speaker].push(NormalisedBlock {
                    predicted: features(&poses, i)?,
                    ground_truth: features(&batch.poses, i)?,
                    mask: features(&batch.mask, i)?,
                });
                n_windows += 1;
            }
        }
        // The blocks of a speaker are only compared with mismatched sound of the same speaker.
        let [own, of_mean_pose, mismatched] =
            errors.iter().map(BlockErrors::by_block).fold([const { Vec::new() }; 3], joined);
        let generator = predicted.metrics(&ground_truth, mean_error(&own));
        let mean_pose = mean_pose.metrics(&ground_truth, mean_error(&of_mean_pose));
        let other_sound = mean_error(&mismatched);
        Ok(Validation {
            split: self.split.name().to_owned(),
            n_windows,
            n_poses: ground_truth.poses.n,
            generator,
            mean_pose,
            other_sound,
            below_mean_pose: Some(reduction(&own, &of_mean_pose)),
            below_other_sound: Some(reduction(&own, &mismatched)),
            channels: channels.iter().zip(&angles).map(|(of, sums)| (of.channel, sums.error())).collect(),
            bone_change_mm: 1e3 * change.mean(),
            spread: spread.ratio(),
            score: score::score(&generator, &mean_pose, other_sound),
            alarm: score::alarm(generator.energy, spread.ratio()),
        })
    }

    /// Splits [1, features, T] into blocks [n, features, frames of a block]; an incomplete last block is dropped.
    fn blocks(&self, x: &Tensor) -> Result<Tensor> {
        let (_, n_features, n_frames) = x.dims3()?;
        let n = n_frames / self.n_frames;
        let whole = x.narrow(2, 0, n * self.n_frames)?.reshape((n_features, n, self.n_frames))?;
        Ok(whole.transpose(0, 1)?.contiguous()?)
    }
}

/// Appends the error sums per block of a speaker to those of the others.
fn joined(mut all: [Vec<[f64; 2]>; 3], own: [Vec<[f64; 2]>; 3]) -> [Vec<[f64; 2]>; 3] {
    all.iter_mut().zip(own).for_each(|(all, own)| all.extend(own));
    all
}

fn block(predicted: &Tensor, batch: &WindowBatch, i: usize, normal: &Normalisation) -> Result<HeldOutBlock> {
    let mask = visible_joints(features(&batch.mask, i)?.view());
    Ok(HeldOutBlock { predicted: joints(predicted, i, normal)?, ground_truth: joints(&batch.poses, i, normal)?, mask })
}

fn joints(poses: &Tensor, i: usize, normal: &Normalisation) -> Result<Array3<f32>> {
    Ok(normal.joints(features(poses, i)?.view()))
}

fn features(x: &Tensor, i: usize) -> Result<Array2<f32>> {
    let values = x.get(i)?.flatten_all()?.to_vec1::<f32>()?;
    let n_features = x.dim(1)?;
    Ok(Array2::from_shape_vec((n_features, values.len() / n_features), values)?)
}

/// Mask of features [144 or more, T] to mask of joints [T, 49]; the hand roots are visible where the wrists are.
fn visible_joints(mask: ArrayView2<f32>) -> Array2<bool> {
    Array2::from_shape_fn((mask.ncols(), N_JOINTS), |(t, joint)| match joint {
        NECK => true,
        L_HAND => mask[[3 * (L_WRIST - 1), t]] > 0.0,
        R_HAND => mask[[3 * (R_WRIST - 1), t]] > 0.0,
        _ => mask[[3 * (joint - 1), t]] > 0.0,
    })
}
