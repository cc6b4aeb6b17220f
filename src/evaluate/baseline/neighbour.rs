//! Nearest-neighbour baseline: for each 4 s of sound the poses of the library window whose log-mel spectrogram is
//! nearest.

use crate::audio::mel;
use crate::evaluate::clips::sound_features::POOLED;
use crate::types::time::FrameRate;
use anyhow::Result;
use ndarray::{Array3, s};
use rayon::prelude::*;
use std::ops::Range;

/// Length of a window, seconds.
const WINDOW_SECS: f64 = 4.0;
/// Rows between two candidate windows.
const STRIDE: usize = 2;

/// Sound to find poses for: rows of pooled spectrogram (`sound_features::SoundFeatures`), and its number of motion
/// frames.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    pub rows: &'a [f32],
    pub n_frames: usize,
}

/// Entries among which neighbours are searched.
pub struct Library<'a> {
    /// Number of entries.
    pub n: usize,
    /// Whether the queries are the entries, in the same order: a clip must not copy itself.
    pub asks_itself: bool,
    /// Pooled spectrogram of an entry and its number of motion frames; `None`: no sound.
    pub features: &'a (dyn Fn(usize) -> Result<Option<(Vec<f32>, usize)>> + Sync),
    /// Joints of an entry [T, 49, 3], angles of head and trunk behind them where they are compared.
    pub joints: &'a dyn Fn(usize) -> Result<Array3<f32>>,
}

/// Window of a query.
struct QueryWindow {
    query: usize,
    frames: Range<usize>,
    rows: Vec<f32>,
}

/// Best match so far: squared distance, entry of the library, first frame.
type NearestMatch = (f32, usize, usize);

/// Motion [T, 49, 3] for each query, NaN where the library's is; `None` where a window finds nothing long enough.
pub fn motions(queries: &[Query], library: &Library, fps: FrameRate) -> Result<Option<Vec<Array3<f32>>>> {
    let windows: Vec<QueryWindow> =
        queries.iter().enumerate().flat_map(|(i, query)| query_windows(i, query, fps)).collect();
    let Library { n, asks_itself, features, joints } = *library;
    let best = (0..n)
        .into_par_iter()
        .map(|entry| -> Result<Vec<Option<NearestMatch>>> {
            let Some((rows, n_frames)) = features(entry)? else { return Ok(vec![None; windows.len()]) };
            let find = |window: &QueryWindow| match asks_itself && window.query == entry {
                true => None,
                false => nearest(&rows, n_frames, window, entry),
            };
            Ok(windows.par_iter().map(find).collect())
        })
        .try_reduce(
            || vec![None; windows.len()],
            |a, b| Ok(a.into_iter().zip(b).map(|(a, b)| nearer(a, b)).collect()),
        )?;
    let mut predicted: Vec<Array3<f32>> = Vec::new();
    // Ordered by entry, so that each is read once.
    let mut places: Vec<(usize, usize, &QueryWindow)> = Vec::with_capacity(windows.len());
    for (window, found) in windows.iter().zip(best) {
        let Some((_, entry, first)) = found else { return Ok(None) };
        places.push((entry, first, window));
    }
    places.sort_by_key(|(entry, _, _)| *entry);
    for of_entry in places.chunk_by(|a, b| a.0 == b.0) {
        let joints = joints(of_entry[0].0)?;
        if predicted.is_empty() {
            let n_rows = joints.shape()[1];
            predicted = queries.iter().map(|query| Array3::zeros((query.n_frames, n_rows, 3))).collect();
        }
        for (_, first, window) in of_entry {
            let from = joints.slice(s![*first..first + window.frames.len(), .., ..]);
            predicted[window.query].slice_mut(s![window.frames.clone(), .., ..]).assign(&from);
        }
    }
    Ok(Some(predicted))
}

/// Windows of a query, the last one shorter.
fn query_windows(query: usize, sound: &Query, fps: FrameRate) -> Vec<QueryWindow> {
    let window = (((WINDOW_SECS * fps.per_sec()) as usize) / POOLED * POOLED).max(POOLED);
    let stretch = |first: usize| {
        let frames = first..(first + window).min(sound.n_frames);
        let from = first / POOLED * mel::N_MELS;
        let to = (from + frames.len().div_ceil(POOLED) * mel::N_MELS).min(sound.rows.len());
        QueryWindow { query, frames, rows: sound.rows.get(from..to).unwrap_or_default().to_vec() }
    };
    (0..sound.n_frames).step_by(window).map(stretch).collect()
}

/// Best match of a window within one entry.
fn nearest(rows: &[f32], n_frames: usize, window: &QueryWindow, entry: usize) -> Option<NearestMatch> {
    let places = (0..).step_by(STRIDE).take_while(|row| row * POOLED + window.frames.len() <= n_frames);
    let of_place = |row: usize| {
        let sound = rows.get(row * mel::N_MELS..)?.get(..window.rows.len())?;
        Some((distance(sound, &window.rows), entry, row * POOLED))
    };
    places.map(of_place).fold(None, nearer)
}

/// Squared distance, summed in eight lanes.
fn distance(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += (a - b) * (a - b);
        }
    }
    sums.iter().sum()
}

/// Nearer of two matches; of equals the one that comes first in the library.
fn nearer(a: Option<NearestMatch>, b: Option<NearestMatch>) -> Option<NearestMatch> {
    let order = |a: &NearestMatch, b: &NearestMatch| a.0.total_cmp(&b.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2)));
    a.into_iter().chain(b).min_by(order)
}
