//! Generation of motion of a given length, and mismatched sounds and words as inputs for comparison. Nearest-neighbour
//! baseline: for each 4 s of sound the poses of the library window with the nearest log-mel spectrogram.

use crate::evaluate::clips::motion_store::{MotionStore, StoredMotion};
use crate::evaluate::clips::sound_features::POOLED;
use crate::generate::GestureGenerator;
use anyhow::{Result, ensure};
use ndarray::{Array3, s};
use orator_base::audio::mel;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::sound::{SAMPLE_RATE, Sound, sample_at};
use orator_base::types::time::FrameRate;
use orator_formats::transcript::Word;
use rayon::prelude::*;
use std::ops::Range;

/// Generates motion of exactly `n_frames` frames for a sound and its words, with posture if the network was trained on
/// it.
pub fn motion(
    speaker: &GestureGenerator,
    sound: &Sound,
    words: &[Word],
    n_frames: usize,
) -> Result<(Motion, Option<Posture>)> {
    let n_needed = sample_at(speaker.fps(), SAMPLE_RATE, n_frames) + 1;
    let mut sound = sound.clone();
    sound.samples.resize(sound.samples.len().max(n_needed), 0.0);
    let (predicted, posture) = speaker.motion_and_posture(&sound, words)?;
    ensure!(
        predicted.n_frames() >= n_frames,
        "{} frames of motion were generated for {n_frames} frames of audio",
        predicted.n_frames()
    );
    let motion = Motion::from_joints(predicted.fps, predicted.joints.slice(s![..n_frames, .., ..]).to_owned());
    Ok((motion, posture.map(|posture| posture.slice(0..n_frames))))
}

/// Mismatched sound for sound `which` of the same length: the concatenation of all sounds, shifted by half of its
/// length with wrap-around, so that it mostly comes from another video.
///
/// `lengths` are the numbers of samples of all sounds; `read` returns a range of samples of a sound.
pub fn mismatched_sound(
    lengths: &[usize],
    which: usize,
    read: impl Fn(usize, Range<usize>) -> Result<Vec<f32>>,
) -> Result<Vec<f32>> {
    let parts = mismatched_parts(lengths, which).into_iter();
    Ok(parts.map(|(sound, range)| read(sound, range)).collect::<Result<Vec<_>>>()?.concat())
}

/// Words of the mismatched sound for sound `which`, with times in that sound; the times in `words` are relative to the
/// start of each sound. Words that are cut by a seam are dropped.
pub fn mismatched_words(lengths: &[usize], rate: u32, words: &[Vec<Word>], which: usize) -> Vec<Word> {
    let secs = |n_samples: usize| n_samples as f64 / f64::from(rate);
    let (mut shifted, mut n_before) = (Vec::new(), 0);
    for (of, range) in mismatched_parts(lengths, which) {
        let (start, end, later) = (secs(range.start), secs(range.end), secs(n_before));
        let inside = words[of].iter().filter(|word| word.start_secs >= start && word.end_secs <= end);
        let moved = |secs: f64| secs - start + later;
        shifted.extend(inside.map(|word| Word {
            start_secs: moved(word.start_secs),
            end_secs: moved(word.end_secs),
            ..word.clone()
        }));
        n_before += range.len();
    }
    shifted
}

/// Sounds and sample ranges that make up the mismatched sound for sound `which`.
fn mismatched_parts(lengths: &[usize], which: usize) -> Vec<(usize, Range<usize>)> {
    let (all, before) = (lengths.iter().sum::<usize>(), lengths[..which].iter().sum::<usize>());
    let mut n_missing = lengths[which];
    let mut skipped = (before + all / 2) % all.max(1);
    let mut parts = Vec::new();
    if n_missing == 0 {
        return parts;
    }
    for (at, &n) in lengths.iter().enumerate().cycle() {
        let start = skipped.min(n);
        let end = n.min(start + n_missing);
        skipped -= start;
        n_missing -= end - start;
        if end > start {
            parts.push((at, start..end));
        }
        if n_missing == 0 {
            break;
        }
    }
    parts
}

const WINDOW_SECS: f64 = 4.0;
/// Spectrogram rows between two candidate windows.
const STRIDE: usize = 2;

/// Sound to find poses for: rows of pooled spectrogram (`sound_features::SoundFeatures`), its number of motion frames.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    pub rows: &'a [f32],
    pub n_frames: usize,
}

/// Entries among which neighbours are searched.
pub struct Library<'a> {
    pub n: usize,
    /// Whether the queries are the entries in the same order, so that an entry must not match itself.
    pub excludes_self: bool,
    /// Pooled spectrogram of an entry and its number of motion frames; `None`: no sound.
    pub features: &'a (dyn Fn(usize) -> Result<Option<(Vec<f32>, usize)>> + Sync),
    /// Joints of these frames of an entry [T, 49, 3], followed by the angles of head and trunk if they are compared.
    pub joints: &'a dyn Fn(usize, Range<usize>) -> Result<Array3<f32>>,
}

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
