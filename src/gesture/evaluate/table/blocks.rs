//! Metric sums in blocks, which are the units of the bootstrap and of tests, since neighbouring frames are correlated.
//! The blocks add up to the total, and none extends beyond the end of a clip.

use crate::evaluate::baseline::baselines::Predictor;
use crate::evaluate::clips::clips::EvalClips;
use crate::metrics::catalogue::{Catalogue, IntervalSums, MetricSums, MotionPair, n_blocks};
use ndarray::s;
use rayon::prelude::*;
use std::ops::Range;

/// Length of the blocks in the comparison of the ground-truth halves, seconds.
const HALVES_SECS: f64 = 4.0;
/// Largest number of pairs of such blocks (one hour) that are kept separately; if there are more, neighbours are
/// summed, which bounds memory.
const MAX_PAIRS: usize = 450;
/// Length, seconds, of the pieces in which longer clips are measured, in parallel and with bounded memory; differences
/// across a boundary are not counted.
const PIECE_SECS: f64 = 600.0;

/// Metric sums of a predictor over all clips and their blocks of about `length` frames. The result does not depend on
/// the number of threads.
pub fn measure(catalogue: &Catalogue, clips: &EvalClips, predictor: &Predictor, length: usize) -> IntervalSums {
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
                ground_truth: of.ground_truth.view().slice_move(s![frames.clone(), .., ..]),
                mask: of.mask.slice(s![frames, ..]),
                fps: clips.fps,
                onsets: onsets.as_deref(),
            };
            catalogue.measure_blocks(&interval, length)
        })
        .collect();
    total(all)
}

/// Clip indices and frame ranges; long clips are split into equal pieces.
fn pieces(clips: &EvalClips) -> Vec<(usize, Range<usize>)> {
    let of_clip = |clip: usize| {
        let n_frames = clips.clips[clip].n_frames();
        let n = (clips.fps.secs(n_frames) / PIECE_SECS).ceil().max(1.0) as usize;
        (0..n).map(move |i| (clip, i * n_frames / n..(i + 1) * n_frames / n))
    };
    (0..clips.clips.len()).flat_map(of_clip).collect()
}

/// Number of frames of each block of about `length` frames.
pub fn frames(clips: &EvalClips, length: usize) -> Vec<usize> {
    let of_piece = |(_, frames): (usize, Range<usize>)| {
        let (n, n_frames) = (n_blocks(frames.len(), length), frames.len());
        let first = move |block: usize| (block * n_frames).div_ceil(n);
        (0..n).map(move |block| first(block + 1) - first(block))
    };
    pieces(clips).into_iter().flat_map(of_piece).collect()
}

/// Mean distance between predicted and ground-truth joints, metres, for every frame of every clip, over the visible
/// joints; NaN if no joint is visible.
pub fn frame_errors(clips: &EvalClips, predictor: &Predictor) -> Vec<Vec<f64>> {
    let of_clip = |clip: usize| {
        let (of, Some(predicted)) = (&clips.clips[clip], predictor.motion(clips, clip)) else { return Vec::new() };
        let of_frame = |t: usize| {
            let distance = |joint: usize| {
                let squares =
                    (0..3).map(|k| f64::from(predicted[[t, joint, k]] - of.ground_truth[[t, joint, k]]).powi(2));
                squares.sum::<f64>().sqrt()
            };
            let seen: Vec<usize> = (0..of.mask.ncols()).filter(|joint| of.mask[[t, *joint]]).collect();
            seen.iter().map(|joint| distance(*joint)).sum::<f64>() / seen.len() as f64
        };
        (0..of.n_frames().min(predicted.shape()[0])).map(of_frame).collect()
    };
    (0..clips.clips.len()).into_par_iter().map(of_clip).collect()
}

/// Compares one half of the ground truth with the other: every second block is treated as the prediction of the
/// previous block.
pub fn halves(catalogue: &Catalogue, clips: &EvalClips) -> IntervalSums {
    let length = ((HALVES_SECS * clips.fps.per_sec()).round() as usize).max(1);
    let stretches = |clip: usize| (0..clips.clips[clip].n_frames() / length).map(move |i| (clip, i * length));
    let all: Vec<(usize, usize)> = (0..clips.clips.len()).flat_map(stretches).collect();
    let measure_pair = |pair: &[(usize, usize)]| {
        let part = |(clip, start): (usize, usize)| {
            let (clip, frames) = (&clips.clips[clip], start..start + length);
            (clip.ground_truth.view().slice_move(s![frames.clone(), .., ..]), clip.mask.slice(s![frames, ..]))
        };
        let ((ground_truth, seen), (predicted, also)) = (part(pair[0]), part(pair[1]));
        let mut mask = seen.to_owned();
        mask.zip_mut_with(&also, |seen, also| *seen &= also);
        catalogue.measure(&MotionPair { predicted, ground_truth, mask: mask.view(), fps: clips.fps, onsets: None })
    };
    let n_merged = (all.len() / 2).div_ceil(MAX_PAIRS).max(1);
    let merged = |neighbours: &[(usize, usize)]| {
        let mut total = MetricSums::default();
        neighbours.chunks_exact(2).for_each(|pair| total += &measure_pair(pair));
        IntervalSums { blocks: vec![total.clone().into_block()], total }
    };
    total(all[..all.len() / 2 * 2].par_chunks(2 * n_merged).map(merged).collect())
}

/// Sum of measurements, with the blocks in order.
fn total(all: Vec<IntervalSums>) -> IntervalSums {
    let mut sum = IntervalSums::default();
    for one in all {
        sum.total += &one.total;
        sum.blocks.extend(one.blocks);
    }
    sum
}
