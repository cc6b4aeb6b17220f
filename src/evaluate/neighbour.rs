//! Nearest neighbour by sound: what a predictor reaches that copies. For each 4 s of sound the stretch of the training
//! split whose log-mel spectrogram is nearest, and the poses that the speaker made there.

use super::held_out::HeldOut;
use crate::audio::mel;
use crate::dataset::{Dataset, Split};
use crate::train::examples::mel_frames;
use crate::train::poses::Normalisation;
use crate::types::pose3d::Motion;
use crate::types::time::FrameRate;
use anyhow::Result;
use ndarray::s;
use rayon::prelude::*;

/// Length of a stretch that is looked for.
const WINDOW_SECS: f64 = 4.0;
/// Frames of motion whose spectrogram is averaged into one row, and rows between two places looked at.
const POOLED: usize = 2;
const STRIDE: usize = 2;

/// A stretch to find poses for.
struct Wanted {
    interval: usize,
    first_frame: usize,
    n_frames: usize,
    /// Rows of 64 numbers.
    sound: Vec<f32>,
}

/// The best place so far: squared distance, interval of the training split, first frame.
type Found = (f32, usize, usize);

/// Motion for each of `held_out`; `None` where a stretch is longer than every interval of the training split.
pub fn motions(dataset: &Dataset, normal: &Normalisation, held_out: &[HeldOut]) -> Result<Option<Vec<Motion>>> {
    let fps = dataset.info().fps;
    let wanted: Vec<Wanted> = held_out.iter().enumerate().flat_map(|(i, interval)| wanted(i, interval, fps)).collect();
    let training = super::held_out::read(dataset, &dataset.samples(Split::Train), normal)?;
    let best = training
        .par_iter()
        .enumerate()
        .map(|(i, interval)| {
            let rows = pooled(&interval.sound.samples, fps, interval.real.n_frames());
            wanted.iter().map(|wanted| nearest(&rows, interval.real.n_frames(), wanted, i)).collect::<Vec<_>>()
        })
        .reduce(|| vec![None; wanted.len()], |a, b| a.into_iter().zip(b).map(|(a, b)| nearer(a, b)).collect());
    let mut motions: Vec<Motion> = held_out.iter().map(|interval| interval.real.clone()).collect();
    for (wanted, found) in wanted.iter().zip(best) {
        let Some((_, interval, first)) = found else { return Ok(None) };
        let from = training[interval].real.joints.slice(s![first..first + wanted.n_frames, .., ..]);
        let to = wanted.first_frame..wanted.first_frame + wanted.n_frames;
        motions[wanted.interval].joints.slice_mut(s![to, .., ..]).assign(&from);
    }
    // what is missing where it copies from is the mean there
    for motion in &mut motions {
        motion.joints = normal.joints(normal.numbers(motion).0.view());
    }
    Ok(Some(motions))
}

/// The interval cut into stretches, the last one shorter.
fn wanted(interval: usize, held_out: &HeldOut, fps: FrameRate) -> Vec<Wanted> {
    let n_frames = held_out.real.n_frames();
    let window = (((WINDOW_SECS * fps.per_sec()) as usize) / POOLED * POOLED).max(POOLED);
    let rows = pooled(&held_out.sound.samples, fps, n_frames);
    let stretch = |first_frame: usize| {
        let n = window.min(n_frames - first_frame);
        let from = first_frame / POOLED * mel::N_MELS;
        let sound = rows[from..from + n.div_ceil(POOLED) * mel::N_MELS].to_vec();
        Wanted { interval, first_frame, n_frames: n, sound }
    };
    (0..n_frames).step_by(window).map(stretch).collect()
}

/// The spectrogram's mean over every `POOLED` frames of motion: rows of 64 numbers, one begun counts.
fn pooled(samples: &[f32], fps: FrameRate, n_frames: usize) -> Vec<f32> {
    let n_rows = n_frames.div_ceil(POOLED);
    let mut samples = samples.to_vec();
    samples.resize(samples.len().max(mel::n_samples(mel_frames(fps, n_rows * POOLED) + 1)), 0.0);
    let mels = mel::log_mel(&samples);
    let row = |row: usize| {
        let frames = mel_frames(fps, row * POOLED)..mel_frames(fps, (row + 1) * POOLED);
        let n = frames.len().max(1) as f32;
        mels.slice(s![frames, ..]).sum_axis(ndarray::Axis(0)).into_iter().map(move |sum| sum / n)
    };
    (0..n_rows).flat_map(row).collect()
}

/// The place in an interval of the training split whose sound is nearest.
fn nearest(rows: &[f32], n_frames: usize, wanted: &Wanted, interval: usize) -> Option<Found> {
    let places = (0..).step_by(STRIDE).take_while(|row| row * POOLED + wanted.n_frames <= n_frames);
    let of_place = |row: usize| {
        let sound = &rows[row * mel::N_MELS..][..wanted.sound.len()];
        let distance = sound.iter().zip(&wanted.sound).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
        (distance, interval, row * POOLED)
    };
    places.map(of_place).map(Some).fold(None, nearer)
}

/// The nearer of two; of equals the one that comes first in the dataset.
fn nearer(a: Option<Found>, b: Option<Found>) -> Option<Found> {
    let order = |a: &Found, b: &Found| a.0.total_cmp(&b.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2)));
    a.into_iter().chain(b).min_by(order)
}
