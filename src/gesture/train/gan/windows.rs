//! Training data: windows of the intervals of a split, as batches of normalised poses and log-mels.

use super::augment::{self, WindowChange, WindowRows};
use super::interval_rows::{IntervalRows, TrainingIntervals, between, mirrored, range_of};
use crate::generate::generator::mel_frames;
use crate::generate::normalisation::{N_FEATURES, Normalisation};
use crate::generate::seq2seq::architecture::{NumberedWord, Vocabulary};
use crate::generate::word_input::WordFrameList;
use crate::train::no_window::NeededFrames;
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use ndarray::{Array2, Axis, Slice};
use orator_base::audio::mel;
use orator_base::types::interval::Interval as Span;
use orator_base::types::skeleton::N_BONES;
use orator_base::types::sound::SAMPLE_RATE;
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Split};
use orator_nn::gan::generator::FRAMES_MULTIPLE;
use orator_nn::gan::look_ahead::LookAhead;
use orator_nn::gan::words::WordFrames;
use rayon::prelude::*;
use std::ops::Range;

/// Largest number of spectrogram frames of a window for a limited look-ahead that are mirrored.
const MAX_MIRRORED_MELS: i64 = 20;
/// Largest number of bytes of intervals that are cached in memory.
pub const CACHE_BYTES: usize = 384 << 20;

pub struct WindowLoader<'d> {
    fps: FrameRate,
    n_frames: usize,
    /// Features of a pose.
    n_features: usize,
    normal: Normalisation,
    intervals: TrainingIntervals<'d>,
    /// Interval and first frame of every window.
    starts: Vec<(usize, usize)>,
    /// Words of every interval, for a network with word input.
    words: Option<Vec<Vec<NumberedWord>>>,
    /// Number of spectrogram frames by which the sound is moved to earlier times, see `LookAhead`.
    sound_shift: i64,
}

pub struct WindowBatch {
    /// [B, 64, mel frames]
    pub mels: Tensor,
    /// [B, features, n_frames], normalised; 0 where missing.
    pub poses: Tensor,
    /// [B, features, n_frames], 1 where the feature is known and trained on.
    pub mask: Tensor,
    /// Speaker index of each window, [B].
    pub speakers: Vec<u32>,
    /// Words at the frames, for a network with word input.
    pub words: Option<WordFrames>,
}

/// Description of a window of `n_frames` frames, for messages about missing windows.
pub const fn needed(n_frames: usize) -> NeededFrames {
    NeededFrames { name: "a window", n_frames, key: Some(("gan.window_frames", FRAMES_MULTIPLE)) }
}

impl WindowBatch {
    pub fn on(&self, device: &Device) -> Result<Self> {
        let on = |tensor: &Tensor| tensor.to_device(device);
        let (mels, poses, mask) = (on(&self.mels)?, on(&self.poses)?, on(&self.mask)?);
        let words = self.words.as_ref().map(|words| words.on(device)).transpose()?;
        Ok(Self { mels, poses, mask, speakers: self.speakers.clone(), words })
    }
}

impl<'d> WindowLoader<'d> {
    /// Opens the intervals of `split` of at least `n_frames` frames; a window starts every `stride` frames.
    pub fn load(
        dataset: &'d Dataset,
        split: Split,
        normal: &Normalisation,
        n_frames: usize,
        stride: usize,
    ) -> Result<Self> {
        Self::load_within(CACHE_BYTES, dataset, split, normal, n_frames, stride)
    }

    /// Like `load`, with at most `max_bytes` of intervals cached in memory.
    pub fn load_within(
        max_bytes: usize,
        dataset: &'d Dataset,
        split: Split,
        normal: &Normalisation,
        n_frames: usize,
        stride: usize,
    ) -> Result<Self> {
        ensure!(n_frames > 0 && stride > 0, "window length and stride must be at least 1 frame");
        let fps = dataset.info().fps;
        let long = dataset.samples(split).into_iter().filter(|sample| sample.n_frames >= n_frames).collect();
        let intervals = TrainingIntervals::open(dataset, long, normal, max_bytes)?;
        let of_interval = |i: usize| {
            let n_windows = Span { start: 0, end: intervals.n_frames(i) }.n_windows(n_frames, stride);
            (0..n_windows).map(move |window| (i, window * stride))
        };
        let starts = (0..intervals.n_intervals()).flat_map(of_interval).collect();
        let (n_features, normal, words) = (normal.n_features(), normal.clone(), None);
        Ok(Self { fps, n_frames, n_features, normal, intervals, starts, words, sound_shift: 0 })
    }

    /// Moves the sound of all windows for a network with this look-ahead. Sound beyond an interval is mirrored;
    /// windows that would need more than 0.2 s of mirrored sound are left out.
    pub fn with_look_ahead(mut self, look_ahead: Option<LookAhead>) -> Self {
        self.sound_shift = look_ahead.map_or(0, |of| of.shift);
        let n_beyond = (self.sound_shift - MAX_MIRRORED_MELS).max(0) as usize;
        let mut starts = self.starts.clone();
        let end = |start: usize| mel_frames(self.fps, start + self.n_frames) + n_beyond;
        starts.retain(|(interval, start)| end(*start) <= self.intervals.n_mels(*interval));
        // Intervals of one window each have no others.
        if !starts.is_empty() {
            self.starts = starts;
        }
        self
    }

    /// Adds the words of the intervals to the windows, as indices of `vocabulary`; `None`: no word input.
    pub fn with_words(mut self, vocabulary: Option<&Vocabulary>) -> Result<Self> {
        self.words = vocabulary.map(|vocabulary| self.intervals.words(vocabulary)).transpose()?;
        Ok(self)
    }

    /// Words at `n_frames` frames of windows, each with its interval, first frame and frames per window frame.
    fn words_of(&self, windows: &[(usize, f64, f64)], n_frames: usize) -> Result<Option<WordFrames>> {
        let Some(words) = &self.words else { return Ok(None) };
        let mut frames = WordFrameList::default();
        for (interval, first, speed) in windows {
            let secs = (0..n_frames).map(|t| (first + t as f64 * speed) / self.fps.per_sec());
            frames.push(&words[*interval], self.fps, secs);
        }
        frames.frames(None).map(Some)
    }

    /// Normalised poses [features, T] and masks [48 or more, T] (joints, then angles), in the order of the intervals;
    /// long intervals are split into parts of `longest` frames.
    pub fn poses(&self, longest: usize) -> impl Iterator<Item = Result<(Array2<f32>, Array2<bool>)>> {
        self.parts(longest).into_iter().map(|(interval, frames)| {
            let rows = self.intervals.rows(interval, frames.clone(), 0..0)?;
            let columns = Slice::from(frames.start - rows.first_frame..frames.end - rows.first_frame);
            let features = rows.features.slice_axis(Axis(1), columns).to_owned();
            Ok((features, rows.mask.slice_axis(Axis(1), columns).to_owned()))
        })
    }

    /// Interval indices and frame ranges; long intervals are split into parts of `longest` frames.
    pub fn parts(&self, longest: usize) -> Vec<(usize, Range<usize>)> {
        let of_interval = |i: usize| {
            let n = self.intervals.n_frames(i);
            (0..n).step_by(longest).map(move |start| (i, start..(start + longest).min(n)))
        };
        (0..self.intervals.n_intervals()).flat_map(of_interval).collect()
    }

    /// These frames of an interval as a batch of size 1. The sound is extended to a multiple of 32 frames, and mirrored
    /// at the end of the interval if needed.
    pub fn part(&self, interval: usize, frames: Range<usize>) -> Result<WindowBatch> {
        let (first, n_mels) = (mel_frames(self.fps, frames.start), mel_frames(self.fps, frames.len()));
        let n_padded = mel_frames(self.fps, frames.len().next_multiple_of(FRAMES_MULTIPLE)).max(n_mels);
        let sources = self.mel_sources(interval, first, n_padded);
        let rows = self.intervals.rows(interval, frames.clone(), range_of(&sources))?;
        let IntervalRows { features, mask, mels, first_frame, first_mel } = &*rows;
        let words =
            self.words_of(&[(interval, frames.start as f64, 1.0)], frames.len().next_multiple_of(FRAMES_MULTIPLE))?;
        let frames = frames.start - first_frame..frames.end - first_frame;
        let sound = Array2::from_shape_fn((mel::N_MELS, n_padded), |(band, k)| mels[[band, sources[k] - first_mel]]);
        let shape = (self.n_features, frames.len());
        let poses = Array2::from_shape_fn(shape, |(i, t)| features[[i, frames.start + t]]);
        let mask = Array2::from_shape_fn(shape, |(i, t)| f32::from(mask[[mask_row(i), frames.start + t]]));
        let tensor = |of: Array2<f32>| -> Result<Tensor> {
            let (rows, columns) = of.dim();
            Ok(Tensor::from_vec(of.into_raw_vec_and_offset().0, (1, rows, columns), &Device::Cpu)?)
        };
        Ok(WindowBatch { mels: tensor(sound)?, poses: tensor(poses)?, mask: tensor(mask)?, speakers: vec![0], words })
    }

    /// Indices in an interval of the spectrogram frames of a window of `n` frames that begins at frame `first`.
    fn mel_sources(&self, interval: usize, first: usize, n: usize) -> Vec<usize> {
        let last = self.intervals.n_mels(interval) - 1;
        (0..n).map(|k| mirrored((first + k) as f64 + self.sound_shift as f64, last as f64) as usize).collect()
    }

    pub fn fps(&self) -> FrameRate {
        self.fps
    }

    pub fn len(&self) -> usize {
        self.starts.len()
    }

    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// Batch of the windows with these indices (each below `len`), augmented by `changes`, one per window or empty.
    pub fn batch_changed(&self, which: &[usize], changes: &[WindowChange]) -> Result<WindowBatch> {
        if changes.is_empty() {
            return self.batch(which);
        }
        ensure!(
            which.len() == changes.len() && which.iter().all(|i| *i < self.len()),
            "invalid windows {which:?}: expected one change for each window below {}",
            self.len()
        );
        let both: Vec<_> = which.iter().zip(changes).collect();
        let changed = |(i, change): &(&usize, &WindowChange)| self.changed(self.starts[**i], change);
        let window = |(i, change): &(&usize, &WindowChange)| {
            let (interval, start) = self.starts[**i];
            let (first, speed) = self.changed_frames(interval, start, change);
            (interval, first, speed)
        };
        let windows: Vec<(usize, f64, f64)> = both.iter().map(window).collect();
        let rows: Vec<WindowRows> = both.par_iter().map(changed).collect::<Result<_>>()?;
        let tensor = |of: fn(&WindowRows) -> &Array2<f32>| {
            let values: Vec<f32> = rows.iter().flat_map(|rows| of(rows).iter().copied()).collect();
            let (n_rows, n_columns) = of(&rows[0]).dim();
            Tensor::from_vec(values, (rows.len(), n_rows, n_columns), &Device::Cpu)
        };
        Ok(WindowBatch {
            mels: tensor(|r| &r.mels)?,
            poses: tensor(|r| &r.poses)?,
            mask: tensor(|r| &r.mask)?,
            speakers: vec![0; which.len()],
            words: self.words_of(&windows, self.n_frames)?,
        })
    }

    /// First frame of an augmented window that starts near frame `start` of an interval, and frames per window frame.
    fn changed_frames(&self, interval: usize, start: usize, change: &WindowChange) -> (f64, f64) {
        let (last, n) = (self.intervals.n_frames(interval) - 1, self.n_frames);
        // The window must not be longer than the interval.
        let speed = change.speed.min(last as f64 / (n - 1).max(1) as f64);
        let latest = last as f64 - (n - 1) as f64 * speed;
        ((start as f64 + change.shift_secs * self.fps.per_sec()).clamp(0.0, latest), speed)
    }

    /// Augmented window that starts near frame `start` of an interval.
    fn changed(&self, (interval, start): (usize, usize), change: &WindowChange) -> Result<WindowRows> {
        let (last, last_mel) = (self.intervals.n_frames(interval) - 1, self.intervals.n_mels(interval) - 1);
        let n = self.n_frames;
        let (first, speed) = self.changed_frames(interval, start, change);
        let at = |t: usize| first + t as f64 * speed;
        let first_mel = first * (f64::from(SAMPLE_RATE) / mel::HOP as f64) / self.fps.per_sec();
        let n_mels = mel_frames(self.fps, n);
        let mel_at = |t: usize| match self.sound_shift {
            0 => first_mel + t as f64 * speed,
            shift => mirrored(first_mel + (t as f64 + shift as f64) * speed, last_mel as f64),
        };
        let frames = between(at(0), last).0..between(at(n - 1), last).1 + 1;
        let ends: Vec<usize> = (0..n_mels).map(|t| between(mel_at(t), last_mel)).flat_map(|(a, b, _)| [a, b]).collect();
        let mel_range = range_of(&ends);
        let rows = self.intervals.rows(interval, frames, mel_range)?;
        let IntervalRows { features, mask, mels, .. } = &*rows;
        let mut poses = Array2::zeros((self.n_features, n));
        let mut known = Array2::zeros((self.n_features, n));
        for t in 0..n {
            let (low, high, share) = between(at(t), last);
            let (low, high) = (low - rows.first_frame, high - rows.first_frame);
            for feature in 0..self.n_features {
                let row = mask_row(feature);
                if mask[[row, low]] && (share == 0.0 || mask[[row, high]]) {
                    let (before, after) = (features[[feature, low]], features[[feature, high]]);
                    poses[[feature, t]] = before + share * (after - before);
                    known[[feature, t]] = 1.0;
                }
            }
        }
        let mut sound = Array2::zeros((mel::N_MELS, n_mels));
        for t in 0..n_mels {
            let (low, high, share) = between(mel_at(t), last_mel);
            let (low, high) = (low - rows.first_mel, high - rows.first_mel);
            for band in 0..mel::N_MELS {
                sound[[band, t]] = mels[[band, low]] + share * (mels[[band, high]] - mels[[band, low]]);
            }
        }
        change.change_sound(&mut sound);
        if change.is_mirrored {
            augment::mirror(&mut poses, &mut known, &self.normal);
        }
        Ok(WindowRows { mels: sound, poses, mask: known })
    }

    /// Batch of the windows with these indices (each below `len`).
    pub fn batch(&self, which: &[usize]) -> Result<WindowBatch> {
        ensure!(
            !which.is_empty() && which.iter().all(|i| *i < self.len()),
            "invalid windows {which:?}: expected indices below {}",
            self.len()
        );
        let window = |i: &usize| (self.starts[*i].0, self.starts[*i].1 as f64, 1.0);
        let windows: Vec<(usize, f64, f64)> = which.iter().map(window).collect();
        let n_mels = mel_frames(self.fps, self.n_frames);
        let (mut mels, mut poses, mut mask) = (Vec::new(), Vec::new(), Vec::new());
        let read = |i: &usize| {
            let (interval, start) = self.starts[*i];
            let sources = self.mel_sources(interval, mel_frames(self.fps, start), n_mels);
            let rows = self.intervals.rows(interval, start..start + self.n_frames, range_of(&sources))?;
            anyhow::Ok((rows, start, sources))
        };
        for (rows, start, sources) in which.par_iter().map(read).collect::<Result<Vec<_>>>()? {
            let start = start - rows.first_frame;
            for band in rows.mels.outer_iter() {
                mels.extend(sources.iter().map(|source| band[source - rows.first_mel]));
            }
            let columns = Slice::from(start..start + self.n_frames);
            poses.extend(rows.features.slice_axis(Axis(1), columns).iter());
            let known = rows.mask.slice_axis(Axis(1), Slice::from(start..start + self.n_frames));
            for (row, known) in known.outer_iter().enumerate() {
                let n_features = if row < N_BONES { 3 } else { 1 };
                (0..n_features).for_each(|_| mask.extend(known.iter().map(|known| f32::from(*known))));
            }
        }
        let tensor = |values, rows, columns| Tensor::from_vec(values, (which.len(), rows, columns), &Device::Cpu);
        Ok(WindowBatch {
            mels: tensor(mels, mel::N_MELS, n_mels)?,
            poses: tensor(poses, self.n_features, self.n_frames)?,
            mask: tensor(mask, self.n_features, self.n_frames)?,
            speakers: vec![0; which.len()],
            words: self.words_of(&windows, self.n_frames)?,
        })
    }
}

/// Windows of all speakers of a training, ordered by speaker.
pub struct JoinedWindows<'d>(Vec<WindowLoader<'d>>);

impl<'d> JoinedWindows<'d> {
    /// Joins the loaders of all speakers, in the order of the speaker indices; at least one.
    pub fn new(loaders: Vec<WindowLoader<'d>>) -> Self {
        Self(loaders)
    }

    pub fn len(&self) -> usize {
        self.0.iter().map(WindowLoader::len).sum()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub fn fps(&self) -> FrameRate {
        self.0[0].fps()
    }

    /// Batch of the windows with these indices (each below `len`), augmented by `changes`, one per window or empty. The
    /// windows of the batch are ordered by speaker.
    pub fn batch_changed(&self, which: &[usize], changes: &[WindowChange]) -> Result<WindowBatch> {
        if let [only] = &self.0[..] {
            return only.batch_changed(which, changes);
        }
        let mut first = 0;
        let mut parts = Vec::new();
        for (speaker, loader) in (0u32..).zip(&self.0) {
            let own = |i: &usize| (first..first + loader.len()).contains(i);
            let positions: Vec<usize> = (0..which.len()).filter(|n| own(&which[*n])).collect();
            let windows: Vec<usize> = positions.iter().map(|n| which[*n] - first).collect();
            let changes: Vec<WindowChange> = positions.iter().filter_map(|n| changes.get(*n).cloned()).collect();
            first += loader.len();
            if !windows.is_empty() {
                parts.push(WindowBatch {
                    speakers: vec![speaker; windows.len()],
                    ..loader.batch_changed(&windows, &changes)?
                });
            }
        }
        joined(&parts).context("no windows requested")
    }
}

fn joined(parts: &[WindowBatch]) -> Result<WindowBatch> {
    let of = |tensor: fn(&WindowBatch) -> &Tensor| Tensor::cat(&parts.iter().map(tensor).collect::<Vec<_>>(), 0);
    let words: Option<Vec<&WordFrames>> = parts.iter().map(|part| part.words.as_ref()).collect();
    let words = words.map(|words| -> Result<WordFrames> {
        let of =
            |tensor: fn(&WordFrames) -> &Tensor| Tensor::cat(&words.iter().map(|of| tensor(of)).collect::<Vec<_>>(), 0);
        Ok(WordFrames { numbers: of(|words| &words.numbers)?, times: of(|words| &words.times)?, added: None })
    });
    Ok(WindowBatch {
        mels: of(|part| &part.mels)?,
        poses: of(|part| &part.poses)?,
        mask: of(|part| &part.mask)?,
        speakers: parts.iter().flat_map(|part| part.speakers.iter().copied()).collect(),
        words: words.transpose()?,
    })
}

fn mask_row(feature: usize) -> usize {
    if feature < N_FEATURES { feature / 3 } else { feature - N_FEATURES + N_BONES }
}
