//! Metrics in blocks of about 4 s, the units of the bootstrap, since neighbouring frames are correlated. The blocks add
//! up to the whole.

use crate::evaluate::baseline::baselines::Predictor;
use crate::evaluate::clips::clips::EvalClips;
use crate::metrics::catalogue::{Catalogue, IntervalSums, MotionPair};
use ndarray::{Array2, s};
use rayon::prelude::*;
use std::ops::Range;

/// Length of a block, seconds; a clip has the number of equal blocks that fits best. Above an hour of motion blocks
/// become longer, which bounds their number.
const BLOCK_SECS: f64 = 4.0;
const MOST_SECS: f64 = 3600.0;
/// Length, seconds, of the pieces in which longer clips are measured in parallel and in bounded memory; differences
/// across a border are not counted.
const PIECE_SECS: f64 = 600.0;

/// Length of the blocks of these clips, seconds.
pub fn block_secs(clips: &EvalClips) -> f64 {
    BLOCK_SECS * (clips.secs() / MOST_SECS).ceil().max(1.0)
}

/// Length of the blocks of these clips, frames.
fn block_frames(clips: &EvalClips) -> usize {
    ((block_secs(clips) * clips.fps.per_sec()).round() as usize).max(1)
}

/// Metric sums of a predictor over all clips and their blocks, independent of the number of threads.
pub fn measure(catalogue: &Catalogue, clips: &EvalClips, predictor: &Predictor) -> IntervalSums {
    let all: Vec<IntervalSums> = pieces(clips)
        .into_par_iter()
        .map(|(clip, frames)| {
            let (of, Some(predicted)) = (&clips.clips[clip], predictor.motion(clips, clip)) else {
                return IntervalSums::default();
            };
            let onsets: Option<Vec<f64>> = of.features.as_ref().map(|features| {
                let (start, end) = (clips.fps.secs(frames.start), clips.fps.secs(frames.end));
                features
                    .onsets
                    .iter()
                    .filter(|onset| (start..end).contains(*onset))
                    .map(|onset| onset - start)
                    .collect()
            });
            let interval = MotionPair {
                predicted: predicted.slice(s![frames.clone(), .., ..]),
                ground_truth: of.ground_truth.slice(s![frames.clone(), .., ..]),
                mask: of.mask.slice(s![frames, ..]),
                fps: clips.fps,
                onsets: onsets.as_deref(),
            };
            catalogue.measure_blocks(&interval, block_frames(clips))
        })
        .collect();
    together(all)
}

/// Clips with their frames, long ones in equal pieces.
fn pieces(clips: &EvalClips) -> Vec<(usize, Range<usize>)> {
    let of_clip = |clip: usize| {
        let n_frames = clips.clips[clip].n_frames();
        let n = (clips.fps.secs(n_frames) / PIECE_SECS).ceil().max(1.0) as usize;
        (0..n).map(move |i| (clip, i * n_frames / n..(i + 1) * n_frames / n))
    };
    (0..clips.clips.len()).flat_map(of_clip).collect()
}

/// One half of the ground truth against the other: every second block is treated as the prediction of the one before
/// it.
pub fn halves(catalogue: &Catalogue, clips: &EvalClips) -> IntervalSums {
    let length = block_frames(clips);
    let stretches = |clip: usize| (0..clips.clips[clip].n_frames() / length).map(move |i| (clip, i * length));
    let all: Vec<(usize, usize)> = (0..clips.clips.len()).flat_map(stretches).collect();
    let beside = |pair: &[(usize, usize)]| {
        let part = |(clip, start): (usize, usize)| {
            let (clip, frames) = (&clips.clips[clip], start..start + length);
            (clip.ground_truth.slice(s![frames.clone(), .., ..]), clip.mask.slice(s![frames, ..]))
        };
        let ((ground_truth, seen), (predicted, also)) = (part(pair[0]), part(pair[1]));
        let mut mask = seen.to_owned();
        mask.zip_mut_with(&also, |seen, also| *seen &= also);
        let interval = MotionPair { predicted, ground_truth, mask: mask.view(), fps: clips.fps, onsets: None };
        catalogue.measure_blocks(&interval, length)
    };
    together(all.par_chunks_exact(2).map(beside).collect())
}

/// Sum of measurements in their order.
fn together(all: Vec<IntervalSums>) -> IntervalSums {
    let mut sum = IntervalSums::default();
    for one in all {
        sum.whole += &one.whole;
        sum.blocks.extend(one.blocks);
    }
    sum
}

/// Number of occurrences of each of `n` blocks in each draw [n_draws, n].
pub fn counts(drawn: &[Vec<usize>], n: usize) -> Array2<f64> {
    let mut counts = Array2::zeros((drawn.len(), n));
    for (mut row, draw) in counts.outer_iter_mut().zip(drawn) {
        draw.iter().filter(|i| **i < n).for_each(|i| row[*i] += 1.0);
    }
    counts
}
