//! Metric sums in blocks, which are the units of the bootstrap and of tests, since neighbouring frames are correlated.
//! The blocks add up to the total, and none extends beyond the end of a clip. They are long enough that the errors of
//! neighbouring blocks are almost independent, and otherwise short enough that there are several; dependence is
//! measured by the integrated autocorrelation time with an automatic window (Sokal 1997, Monte Carlo Methods in
//! Statistical Mechanics, section 3).

use crate::evaluate::baseline::baselines::Predictor;
use crate::evaluate::clips::clips::EvalClips;
use crate::metrics::catalogue::{Catalogue, IntervalSums, MetricSums, MotionPair, n_blocks};
use ndarray::s;
use rayon::prelude::*;
use std::ops::Range;

/// Length of the blocks in the comparison of the ground-truth halves, seconds.
const HALVES_SECS: f64 = 4.0;
/// Most pairs of such blocks (one hour) kept apart; if there are more, neighbours are summed, which bounds memory.
const MAX_PAIRS: usize = 450;
/// Length, seconds, of the pieces in which longer clips are measured, in parallel and with bounded memory; differences
/// across a boundary are not counted.
const PIECE_SECS: f64 = 600.0;

/// Metric sums of a predictor over clips and blocks of about `length` frames. Equal for any number of threads.
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

/// Compares one half of the ground truth with the other: every second block is the prediction of the previous one.
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

fn total(all: Vec<IntervalSums>) -> IntervalSums {
    let mut sum = IntervalSums::default();
    for one in all {
        sum.total += &one.total;
        sum.blocks.extend(one.blocks);
    }
    sum
}

/// Smallest block length in decorrelation times.
const MIN_TIMES: f64 = 1.5;
/// Number of blocks of short motion, if the decorrelation time allows it.
const N_BLOCKS: f64 = 16.0;
/// Range of the usual block length, seconds; movements of one second must fit.
const BLOCK_SECS: [f64; 2] = [2.0, 4.0];
/// Duration of motion, seconds, above which blocks become longer, which bounds their number.
const MAX_SECS: f64 = 3600.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockLength {
    pub secs: f64,
    /// Integrated autocorrelation time of the differences between two predictors' errors, seconds.
    pub decorrelation_secs: f64,
}

impl BlockLength {
    /// Block length for `secs` of motion at `fps`. `differences`: the compared error series, each in pieces with one
    /// value per frame; the one with the longest decorrelation time counts.
    pub fn new(secs: f64, fps: f64, differences: &[Vec<Vec<f64>>]) -> Self {
        let times = differences.iter().map(|pieces| integrated_time(pieces));
        let decorrelation_secs = times.fold(1.0, f64::max) / fps;
        let [least, most] = BLOCK_SECS;
        let usual = (secs / N_BLOCKS).clamp(least, most) * (secs / MAX_SECS).ceil().max(1.0);
        Self { secs: usual.max(MIN_TIMES * decorrelation_secs), decorrelation_secs }
    }

    /// Length in frames, at least 1.
    pub fn frames(&self, fps: f64) -> usize {
        ((self.secs * fps).round() as usize).max(1)
    }

    /// Variance of the mean of blocks of `block_secs` relative to independent blocks: `1 + 2 r` with the correlation r
    /// of the means of neighbouring blocks of a first-order autoregressive process with this decorrelation time.
    pub fn variance_inflation(&self, block_secs: f64) -> f64 {
        // Length of a block in time constants of the exponential decay.
        let length = 2.0 * block_secs / self.decorrelation_secs;
        if length.is_nan() || length <= 1e-3 {
            return 3.0;
        }
        let decay = 1.0 - (-length).exp();
        1.0 + decay * decay / (length - decay)
    }
}

/// Sokal's window constant c: the window ends at c times half of the time so far (Sokal's times are half of these).
const WINDOW: f64 = 5.0;
/// Smallest assumed share of the time that remains after subtracting the sample mean.
const MIN_REMAINING: f64 = 0.1;

/// Integrated autocorrelation time in frames, `1 + 2 * (sum of the autocorrelations)`, of a series in pieces: the mean
/// of N frames has the variance of that of N / time independent frames. It is 1 to the number of frames; 1 for a
/// constant series. Lags do not cross pieces, but the mean is that of all pieces, so that pieces of different level
/// give a long time. Frames that are not finite are ignored. The result is corrected for the use of the sample mean.
pub fn integrated_time(pieces: &[Vec<f64>]) -> f64 {
    let (time, window, n) = windowed(pieces);
    if window == 0 {
        return 1.0;
    }
    let remaining = 1.0 - (2.0 * window as f64 + 1.0) / n.max(1) as f64;
    (time.max(1.0) / remaining.max(MIN_REMAINING)).min(n.max(1) as f64)
}

/// Uncorrected time, its window (last lag), and the number of frames.
pub fn windowed(pieces: &[Vec<f64>]) -> (f64, usize, usize) {
    let all = || pieces.iter().flatten().filter(|value| value.is_finite());
    let n = all().count();
    let mean = all().sum::<f64>() / n.max(1) as f64;
    // Missing values are set to 0, so that they add nothing to the products.
    let centred = |piece: &Vec<f64>| -> Vec<f64> {
        piece.iter().map(|value| if value.is_finite() { value - mean } else { 0.0 }).collect()
    };
    let pieces: Vec<Vec<f64>> = pieces.iter().map(centred).collect();
    let product = |lag: usize| -> f64 {
        pieces.iter().flat_map(|piece| piece.iter().zip(piece.iter().skip(lag))).map(|(a, b)| a * b).sum()
    };
    let variance = product(0);
    let longest = pieces.iter().map(Vec::len).max().unwrap_or(0);
    let mut time = 1.0;
    if variance.is_nan() || variance <= 1e-24 * n as f64 * mean * mean {
        return (time, 0, n);
    }
    for lag in 1..longest {
        time += 2.0 * product(lag) / variance;
        if lag as f64 >= WINDOW / 2.0 * time {
            return (time, lag, n);
        }
    }
    (time, longest.saturating_sub(1), n)
}
