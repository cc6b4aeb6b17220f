//! Nearest-neighbour baseline: for each 4 s of sound the poses of the library window with the nearest log-mel
//! spectrogram.

use crate::evaluate::clips::motion_store::{MotionStore, StoredMotion};
use crate::evaluate::clips::sound_features::POOLED;
use anyhow::Result;
use ndarray::{Array3, s};
use orator_base::audio::mel;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use rayon::prelude::*;
use std::ops::Range;

/// Length of a window, seconds.
const WINDOW_SECS: f64 = 4.0;
/// Spectrogram rows between two candidate windows.
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
    /// Whether the queries are the entries in the same order, so that an entry must not match itself.
    pub excludes_self: bool,
    /// Pooled spectrogram of an entry and its number of motion frames; `None`: no sound.
    pub features: &'a (dyn Fn(usize) -> Result<Option<(Vec<f32>, usize)>> + Sync),
    /// Joints of these frames of an entry [T, 49, 3], followed by the angles of head and trunk if they are compared.
    pub joints: &'a dyn Fn(usize, Range<usize>) -> Result<Array3<f32>>,
}

/// Window of a query.
struct QueryWindow<'a> {
    query: usize,
    frames: Range<usize>,
    rows: &'a [f32],
}

/// Best match so far: squared distance, entry of the library, first frame.
type NearestMatch = (f32, usize, usize);

/// Motion [T, 49, 3] for each query, NaN where that of the library is; `None` if no entry is long enough for a window.
pub fn motions(
    queries: &[Query],
    library: &Library,
    fps: FrameRate,
    store: &MotionStore,
) -> Result<Option<Vec<StoredMotion>>> {
    let windows: Vec<QueryWindow> =
        queries.iter().enumerate().flat_map(|(i, query)| query_windows(i, query, fps)).collect();
    let Library { n, excludes_self, features, joints } = *library;
    let best = (0..n)
        .into_par_iter()
        .map(|entry| -> Result<Vec<Option<NearestMatch>>> {
            let Some((rows, n_frames)) = features(entry)? else { return Ok(vec![None; windows.len()]) };
            let find = |window: &QueryWindow| {
                if excludes_self && window.query == entry { None } else { nearest(&rows, n_frames, window, entry) }
            };
            Ok(windows.par_iter().map(find).collect())
        })
        .try_reduce(
            || vec![None; windows.len()],
            |a, b| Ok(a.into_iter().zip(b).map(|(a, b)| nearer(a, b)).collect()),
        )?;
    let mut predicted = Vec::new();
    // The windows are in the order of the queries.
    let mut found = windows.iter().zip(best).peekable();
    for (number, query) in queries.iter().enumerate() {
        let mut motion: Option<Array3<f32>> = None;
        while let Some((window, best)) = found.next_if(|(window, _)| window.query == number) {
            let Some((_, entry, first)) = best else { return Ok(None) };
            let from = joints(entry, first..first + window.frames.len())?;
            let to = motion.get_or_insert_with(|| Array3::zeros((query.n_frames, from.shape()[1], 3)));
            to.slice_mut(s![window.frames.clone(), .., ..]).assign(&from);
        }
        predicted.push(store.keep(motion.unwrap_or_else(|| Array3::zeros((0, N_JOINTS, 3))))?);
    }
    Ok(Some(predicted))
}

/// Windows of a query, the last one shorter.
fn query_windows<'a>(query: usize, sound: &Query<'a>, fps: FrameRate) -> Vec<QueryWindow<'a>> {
    let window = (((WINDOW_SECS * fps.per_sec()) as usize) / POOLED * POOLED).max(POOLED);
    let window_at = |first: usize| {
        let frames = first..(first + window).min(sound.n_frames);
        let from = first / POOLED * mel::N_MELS;
        let to = (from + frames.len().div_ceil(POOLED) * mel::N_MELS).min(sound.rows.len());
        QueryWindow { query, frames, rows: sound.rows.get(from..to).unwrap_or_default() }
    };
    (0..sound.n_frames).step_by(window).map(window_at).collect()
}

/// Best match of a window within one entry.
fn nearest(rows: &[f32], n_frames: usize, window: &QueryWindow, entry: usize) -> Option<NearestMatch> {
    let rows_of_windows = (0..).step_by(STRIDE).take_while(|row| row * POOLED + window.frames.len() <= n_frames);
    let match_at = |row: usize| {
        let sound = rows.get(row * mel::N_MELS..)?.get(..window.rows.len())?;
        Some((distance(sound, window.rows), entry, row * POOLED))
    };
    rows_of_windows.map(match_at).fold(None, nearer)
}

/// Squared Euclidean distance, summed in eight lanes; elements beyond a multiple of eight are ignored.
fn distance(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += (a - b) * (a - b);
        }
    }
    sums.iter().sum()
}

/// Nearer of two matches; equally near ones are ordered by entry and frame, so that results are deterministic.
fn nearer(a: Option<NearestMatch>, b: Option<NearestMatch>) -> Option<NearestMatch> {
    let order = |a: &NearestMatch, b: &NearestMatch| a.0.total_cmp(&b.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2)));
    a.into_iter().chain(b).min_by(order)
}
