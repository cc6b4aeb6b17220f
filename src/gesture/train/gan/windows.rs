//! What training reads: windows of the intervals of a split as batches of normalised poses and log-mels.

use super::augment::{self, WindowChange, WindowRows};
use super::interval_rows::{IntervalRows, TrainingIntervals};
use crate::generate::mel_stream::mel_frames;
use crate::generate::normalisation::{N_FEATURES, Normalisation};
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
use rayon::prelude::*;
use std::ops::Range;

/// Bytes of intervals that are held in memory.
pub const HELD_BYTES: usize = 384 << 20;

/// All windows of a split.
pub struct WindowLoader<'d> {
    fps: FrameRate,
    n_frames: usize,
    /// Numbers of a pose.
    n_numbers: usize,
    normal: Normalisation,
    intervals: TrainingIntervals<'d>,
    /// Interval and first frame of every window.
    starts: Vec<(usize, usize)>,
}

/// Windows side by side, f32.
pub struct WindowBatch {
    /// [B, 64, mel frames]
    pub mels: Tensor,
    /// [B, numbers, n_frames], normalised; 0 where missing.
    pub poses: Tensor,
    /// [B, numbers, n_frames], 1 where the number is to be learnt.
    pub mask: Tensor,
    /// Number of each window's speaker, [B].
    pub speakers: Vec<u32>,
}

/// A window of so many frames, as it is cut out of an interval.
pub const fn needed(n_frames: usize) -> NeededFrames {
    NeededFrames { name: "a window", n_frames, key: Some(("gan.window_frames", FRAMES_MULTIPLE)) }
}

impl WindowBatch {
    /// Copy of the batch on this device.
    pub fn on(&self, device: &Device) -> Result<Self> {
        let on = |tensor: &Tensor| tensor.to_device(device);
        let (mels, poses, mask) = (on(&self.mels)?, on(&self.poses)?, on(&self.mask)?);
        Ok(Self { mels, poses, mask, speakers: self.speakers.clone() })
    }
}

impl<'d> WindowLoader<'d> {
    /// Opens the intervals of `split` that hold a window of `n_frames`; one begins every `stride` frames.
    pub fn load(
        dataset: &'d Dataset,
        split: Split,
        normal: &Normalisation,
        n_frames: usize,
        stride: usize,
    ) -> Result<Self> {
        Self::load_within(HELD_BYTES, dataset, split, normal, n_frames, stride)
    }

    /// `load`, which holds no more than so many bytes of intervals in memory.
    pub fn load_within(
        most_bytes: usize,
        dataset: &'d Dataset,
        split: Split,
        normal: &Normalisation,
        n_frames: usize,
        stride: usize,
    ) -> Result<Self> {
        ensure!(n_frames > 0 && stride > 0, "a window needs at least one frame, and a stride of at least one");
        let fps = dataset.info().fps;
        let long = dataset.samples(split).into_iter().filter(|sample| sample.n_frames >= n_frames).collect();
        let intervals = TrainingIntervals::open(dataset, long, normal, most_bytes)?;
        let of_interval = |i: usize| {
            let n_windows = Span { start: 0, end: intervals.n_frames(i) }.n_windows(n_frames, stride);
            (0..n_windows).map(move |window| (i, window * stride))
        };
        let starts = (0..intervals.n_intervals()).flat_map(of_interval).collect();
        Ok(Self { fps, n_frames, n_numbers: normal.n_numbers(), normal: normal.clone(), intervals, starts })
    }

    /// Poses as normalised numbers [144 or more, T] with the joints seen [48 or more, T], in the order of the intervals, the
    /// long ones in parts of `longest` frames.
    pub fn poses(&self, longest: usize) -> impl Iterator<Item = Result<(Array2<f32>, Array2<bool>)>> {
        self.parts(longest).into_iter().map(|(interval, frames)| {
            let rows = self.intervals.rows(interval, frames.clone(), 0..0)?;
            let columns = Slice::from(frames.start - rows.first_frame..frames.end - rows.first_frame);
            let features = rows.features.slice_axis(Axis(1), columns).to_owned();
            Ok((features, rows.mask.slice_axis(Axis(1), columns).to_owned()))
        })
    }

    /// Intervals, each with its frames, the long ones in parts of `longest` frames.
    pub fn parts(&self, longest: usize) -> Vec<(usize, Range<usize>)> {
        let of_interval = |i: usize| {
            let n = self.intervals.n_frames(i);
            (0..n).step_by(longest).map(move |start| (i, start..(start + longest).min(n)))
        };
        (0..self.intervals.n_intervals()).flat_map(of_interval).collect()
    }

    /// These frames of an interval as a batch of one. The sound goes on to a multiple of 32 frames, behind the interval's
    /// end by its mirror image.
    pub fn part(&self, interval: usize, frames: Range<usize>) -> Result<WindowBatch> {
        let (first, n_mels) = (mel_frames(self.fps, frames.start), mel_frames(self.fps, frames.len()));
        let n_heard = mel_frames(self.fps, frames.len().next_multiple_of(FRAMES_MULTIPLE)).max(n_mels);
        let last = self.intervals.n_mels(interval) - 1;
        let heard = |k: usize| if first + k <= last { first + k } else { (2 * last).saturating_sub(first + k) };
        let lowest = (0..n_heard).map(heard).min().unwrap_or(first);
        let rows = self.intervals.rows(interval, frames.clone(), lowest..(first + n_heard).min(last + 1))?;
        let IntervalRows { features, mask, mels, first_frame, first_mel } = &*rows;
        let heard = |k: usize| heard(k) - first_mel;
        let frames = frames.start - first_frame..frames.end - first_frame;
        let sound = Array2::from_shape_fn((mel::N_MELS, n_heard), |(band, k)| mels[[band, heard(k)]]);
        let shape = (self.n_numbers, frames.len());
        let poses = Array2::from_shape_fn(shape, |(number, t)| features[[number, frames.start + t]]);
        let mask = Array2::from_shape_fn(shape, |(number, t)| f32::from(mask[[row_of(number), frames.start + t]]));
        let tensor = |of: Array2<f32>| -> Result<Tensor> {
            let (rows, columns) = of.dim();
            Ok(Tensor::from_vec(of.into_raw_vec_and_offset().0, (1, rows, columns), &Device::Cpu)?)
        };
        Ok(WindowBatch { mels: tensor(sound)?, poses: tensor(poses)?, mask: tensor(mask)?, speakers: vec![0] })
    }

    /// Rate of the poses.
    pub fn fps(&self) -> FrameRate {
        self.fps
    }

    /// Number of windows.
    pub fn len(&self) -> usize {
        self.starts.len()
    }

    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// The windows of these numbers (each below `len`) as one batch, each with its change.
    pub fn batch_changed(&self, which: &[usize], changes: &[WindowChange]) -> Result<WindowBatch> {
        if changes.is_empty() {
            return self.batch(which);
        }
        ensure!(which.len() == changes.len() && which.iter().all(|i| *i < self.len()), "windows {which:?}");
        let both: Vec<_> = which.iter().zip(changes).collect();
        let changed = |(i, change): &(&usize, &WindowChange)| self.changed(self.starts[**i], change);
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
        })
    }

    /// A window that begins about frame `start` of an interval, changed.
    fn changed(&self, (interval, start): (usize, usize), change: &WindowChange) -> Result<WindowRows> {
        let (last, last_mel) = (self.intervals.n_frames(interval) - 1, self.intervals.n_mels(interval) - 1);
        let n = self.n_frames;
        // As much of the interval as it has.
        let speed = change.speed.min(last as f64 / (n - 1).max(1) as f64);
        let latest = last as f64 - (n - 1) as f64 * speed;
        let first = (start as f64 + change.shift_secs * self.fps.per_sec()).clamp(0.0, latest);
        let at = |t: usize| first + t as f64 * speed;
        let first_mel = first * (f64::from(SAMPLE_RATE) / mel::HOP as f64) / self.fps.per_sec();
        let n_mels = mel_frames(self.fps, n);
        let mel_at = |t: usize| first_mel + t as f64 * speed;
        let frames = between(at(0), last).0..between(at(n - 1), last).1 + 1;
        let heard = between(mel_at(0), last_mel).0..between(mel_at(n_mels.max(1) - 1), last_mel).1 + 1;
        let rows = self.intervals.rows(interval, frames, heard)?;
        let IntervalRows { features, mask, mels, .. } = &*rows;
        let mut poses = Array2::zeros((self.n_numbers, n));
        let mut seen = Array2::zeros((self.n_numbers, n));
        for t in 0..n {
            let (low, high, share) = between(at(t), last);
            let (low, high) = (low - rows.first_frame, high - rows.first_frame);
            for number in 0..self.n_numbers {
                let row = row_of(number);
                if mask[[row, low]] && (share == 0.0 || mask[[row, high]]) {
                    let (before, after) = (features[[number, low]], features[[number, high]]);
                    poses[[number, t]] = before + share * (after - before);
                    seen[[number, t]] = 1.0;
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
            augment::mirror(&mut poses, &mut seen, &self.normal);
        }
        Ok(WindowRows { mels: sound, poses, mask: seen })
    }

    /// The windows of these numbers (each below `len`) as one batch.
    pub fn batch(&self, which: &[usize]) -> Result<WindowBatch> {
        ensure!(!which.is_empty() && which.iter().all(|i| *i < self.len()), "windows {which:?} of {}", self.len());
        let n_mels = mel_frames(self.fps, self.n_frames);
        let (mut mels, mut poses, mut mask) = (Vec::new(), Vec::new(), Vec::new());
        let read = |i: &usize| {
            let (interval, start) = self.starts[*i];
            let first_mel = mel_frames(self.fps, start);
            let rows = self.intervals.rows(interval, start..start + self.n_frames, first_mel..first_mel + n_mels)?;
            anyhow::Ok((rows, start, first_mel))
        };
        for (rows, start, first_mel) in which.par_iter().map(read).collect::<Result<Vec<_>>>()? {
            let start = start - rows.first_frame;
            take(&mut mels, &rows.mels, first_mel - rows.first_mel, n_mels);
            take(&mut poses, &rows.features, start, self.n_frames);
            let seen = rows.mask.slice_axis(Axis(1), Slice::from(start..start + self.n_frames));
            for (row, seen) in seen.outer_iter().enumerate() {
                let n_numbers = if row < N_BONES { 3 } else { 1 };
                (0..n_numbers).for_each(|_| mask.extend(seen.iter().map(|seen| f32::from(*seen))));
            }
        }
        let tensor = |values, rows, columns| Tensor::from_vec(values, (which.len(), rows, columns), &Device::Cpu);
        Ok(WindowBatch {
            mels: tensor(mels, mel::N_MELS, n_mels)?,
            poses: tensor(poses, self.n_numbers, self.n_frames)?,
            mask: tensor(mask, self.n_numbers, self.n_frames)?,
            speakers: vec![0; which.len()],
        })
    }
}

/// The windows of all speakers of a training, those of one speaker after those of the other.
pub struct JoinedWindows<'d>(Vec<WindowLoader<'d>>);

impl<'d> JoinedWindows<'d> {
    /// Loaders by the numbers of their speakers, one at least.
    pub fn new(loaders: Vec<WindowLoader<'d>>) -> Self {
        Self(loaders)
    }

    /// Number of the windows.
    pub fn len(&self) -> usize {
        self.0.iter().map(WindowLoader::len).sum()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Rate of the poses.
    pub fn fps(&self) -> FrameRate {
        self.0[0].fps()
    }

    /// The windows of these numbers (each below `len`) as one batch, each with its change; `changes` may be empty. The
    /// windows of a batch stand in order of their speakers.
    pub fn batch_changed(&self, which: &[usize], changes: &[WindowChange]) -> Result<WindowBatch> {
        if let [only] = &self.0[..] {
            return only.batch_changed(which, changes);
        }
        let mut first = 0;
        let mut parts = Vec::new();
        for (speaker, loader) in (0u32..).zip(&self.0) {
            let own = |i: &usize| (first..first + loader.len()).contains(i);
            let places: Vec<usize> = (0..which.len()).filter(|n| own(&which[*n])).collect();
            let windows: Vec<usize> = places.iter().map(|n| which[*n] - first).collect();
            let changes: Vec<WindowChange> = places.iter().filter_map(|n| changes.get(*n).cloned()).collect();
            first += loader.len();
            if !windows.is_empty() {
                parts.push(WindowBatch {
                    speakers: vec![speaker; windows.len()],
                    ..loader.batch_changed(&windows, &changes)?
                });
            }
        }
        joined(&parts).context("no window was asked for")
    }
}

fn joined(parts: &[WindowBatch]) -> Result<WindowBatch> {
    let of = |tensor: fn(&WindowBatch) -> &Tensor| Tensor::cat(&parts.iter().map(tensor).collect::<Vec<_>>(), 0);
    Ok(WindowBatch {
        mels: of(|part| &part.mels)?,
        poses: of(|part| &part.poses)?,
        mask: of(|part| &part.mask)?,
        speakers: parts.iter().flat_map(|part| part.speakers.iter().copied()).collect(),
    })
}

/// Row of a number in the mask of joints and angles.
fn row_of(number: usize) -> usize {
    if number < N_FEATURES { number / 3 } else { number - N_FEATURES + N_BONES }
}

/// Neighbours of a moment between frames, none behind `last`, and how far it is on the way to the second, 0..1.
fn between(at: f64, last: usize) -> (usize, usize, f32) {
    let low = (at.max(0.0) as usize).min(last);
    (low, (low + 1).min(last), if low < last { (at - low as f64) as f32 } else { 0.0 })
}

fn take(to: &mut Vec<f32>, from: &Array2<f32>, first: usize, n: usize) {
    to.extend(from.slice_axis(Axis(1), Slice::from(first..first + n)).iter());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mel_frames_keep_step_with_the_motion() {
        let fps = FrameRate::new(15, 1);
        assert_eq!(mel_frames(fps, 64), 427);
        assert_eq!(mel_frames(fps, 1_500), 10_000);
        for (start, n) in [(0, 64), (5, 64), (7, 96), (1_001, 64)] {
            let total = mel_frames(fps, start + n) + 1;
            assert!(mel_frames(fps, start) + mel_frames(fps, n) <= total);
        }
    }
}
