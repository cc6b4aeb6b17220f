//! Shot boundary detection. Consumes thumbnails frame by frame, retains the last few seconds, and scores how likely
//! each frame is the first of a shot.

use super::block_match;
use super::dissolves::{self, MIN_TURNED, WINDOWS, ramp};
use super::thumbnail::Thumbnail;
use orator_base::types::image::Image;
use orator_base::types::time::FrameRate;
use std::collections::VecDeque;

/// Score from which tracking restarts, whatever threshold is used for shots later.
pub const RESTART: f64 = 0.1;
/// Frames on either side of a cut whose changes are subtracted from its own.
const NEIGHBOURS: usize = 2;
/// Frames at 15 fps within which a reappearing picture means a flash.
const FLASH_FRAMES: usize = 5;
/// Least correlation for a block to count as present after a cut.
const MIN_CORRELATION: f32 = 0.75;

/// Shot boundary detector. With `change(n)` the share of cells that differ between frames n - 1 and n (repeated frames
/// left out), the score of a cut is `max(0, change(n) - max(change(n-2), change(n-1), change(n+1), change(n+2)))`, if
/// the pictures before and after do not match (`block_match`). Gestures, pans and noise last for several frames and
/// cancel out; after a flash the picture reappears. A gradual transition (`dissolves`) scores at its first frame and
/// at the first frame after it.
pub struct ShotFinder {
    /// Frames at the dataset rate per frame at 15 fps.
    frame_step: usize,
    /// Most recent non-repeated frames, oldest first.
    recent: VecDeque<RecentFrame>,
    /// Frame indices of the non-repeated frames.
    frames: Vec<usize>,
    n_frames: usize,
    /// Share of cells that changed since the previous non-repeated frame, per non-repeated frame.
    changes: Vec<f64>,
    /// Cut scores of the non-repeated frames, as far as they are known.
    cuts: Vec<f64>,
    windows: Vec<Transition>,
}

/// A frame with the path length of each cell's colour since the start of the video, modulo 2^32.
struct RecentFrame {
    thumbnail: Thumbnail,
    path_length: Vec<[u32; 3]>,
}

/// A gradual transition; `start` and `end` are indices of non-repeated frames.
#[derive(Clone, Copy)]
struct Transition {
    start: usize,
    end: usize,
    score: f64,
}

impl ShotFinder {
    /// Creates a detector for frames at `rate`.
    pub fn new(rate: FrameRate) -> Self {
        Self {
            frame_step: ((rate.per_sec() / 15.0).round() as usize).max(1),
            recent: VecDeque::new(),
            frames: Vec::new(),
            n_frames: 0,
            changes: Vec::new(),
            cuts: Vec::new(),
            windows: Vec::new(),
        }
    }

    /// Adds the thumbnail of the next frame; `None` if it repeats the previous one.
    pub fn push(&mut self, thumbnail: Option<Image>) {
        let frame = self.n_frames;
        self.n_frames += 1;
        let Some(thumbnail) = thumbnail.map(Thumbnail::new) else { return };
        let last = self.recent.back();
        self.changes.push(last.map_or(0.0, |last| last.thumbnail.change(&thumbnail)));
        let mut path_length = last.map_or_else(|| vec![[0; 3]; thumbnail.grid.len()], |last| last.path_length.clone());
        if let Some(last) = last {
            let steps = last.thumbnail.grid.iter().zip(&thumbnail.grid);
            for (path_length, (a, b)) in path_length.iter_mut().zip(steps) {
                (0..3).for_each(|channel| {
                    path_length[channel] =
                        path_length[channel].wrapping_add(u32::from(a[channel].abs_diff(b[channel])));
                });
            }
        }
        self.frames.push(frame);
        self.recent.push_back(RecentFrame { thumbnail, path_length });
        self.judge(FLASH_FRAMES * self.frame_step);
        let longest = WINDOWS.last().map_or(0, |(length, _)| length * self.frame_step);
        while self.recent.len() > longest + 2 * FLASH_FRAMES * self.frame_step + 2 {
            self.recent.pop_front();
        }
    }

    /// Returns the score of every frame, 0..1.
    pub fn finish(mut self) -> Vec<f64> {
        self.judge(0);
        let mut scores = vec![0.0f64; self.n_frames];
        for (cut, frame) in self.cuts.iter().zip(&self.frames) {
            scores[*frame] = *cut;
        }
        for window in suppress_overlaps(self.windows) {
            for edge in [window.start + 1, window.end] {
                let score = &mut scores[self.frames[edge]];
                *score = score.max(window.score);
            }
        }
        scores
    }

    /// Scores the cuts and windows that `after` frames follow; a window may not contain a cut.
    fn judge(&mut self, after: usize) {
        let n = self.frames.len().saturating_sub(after);
        for at in self.cuts.len()..n {
            self.cuts.push(self.cut(at));
            self.windows.extend(self.transition(at));
        }
    }

    /// Non-repeated frame number `at`; `None` if it has been dropped.
    fn recent(&self, at: usize) -> Option<&RecentFrame> {
        let first = self.frames.len() - self.recent.len();
        self.recent.get(at.checked_sub(first)?)
    }

    fn cut(&self, at: usize) -> f64 {
        let around =
            (at.saturating_sub(NEIGHBOURS).max(1)..(at + NEIGHBOURS + 1).min(self.changes.len())).filter(|k| *k != at);
        let score = self.changes[at] - around.map(|k| self.changes[k]).fold(0.0, f64::max);
        let before = at.checked_sub(1).and_then(|before| self.recent(before));
        let (Some(before), Some(after)) = (before, self.recent(at)) else { return 0.0 };
        if score <= 0.0 || self.reappears(at - 1, at, self.changes[at]) {
            return 0.0;
        }
        let (before, after) = (&before.thumbnail, &after.thumbnail);
        let missing = |a, b| block_match::missing(a, &[b], MIN_CORRELATION);
        score * ramp(missing(after, before).min(missing(before, after)), 0.3, 0.6)
    }

    /// Best transition that ends at frame `end`.
    fn transition(&self, end: usize) -> Option<Transition> {
        let last = self.recent(end)?;
        let turned = |length: usize| {
            let first = self.recent(end.checked_sub(length)?)?;
            let path_length = first.path_length.iter().zip(&last.path_length);
            let path_length =
                path_length.map(|(a, b)| std::array::from_fn(|channel| b[channel].wrapping_sub(a[channel])));
            Some(dissolves::turned(&first.thumbnail, &last.thumbnail, path_length))
        };
        let longest = WINDOWS.last().map_or(0, |(length, _)| length * self.frame_step);
        let near = (end.saturating_sub(longest)..=end).rev();
        let cut = near.into_iter().find(|at| self.cuts.get(*at).is_some_and(|cut| *cut >= RESTART));
        let windows = WINDOWS.iter().map(|(length, least)| (length * self.frame_step, *least));
        let open = windows.filter(|(length, _)| cut.is_none_or(|cut| end.saturating_sub(*length) >= cut));
        let open: Vec<_> =
            open.filter_map(|(length, least)| Some((end.checked_sub(length)?, least, turned(length)?))).collect();
        let most = open.iter().map(|(_, _, turned)| *turned).fold(0.0, f64::max);
        let worth = open.into_iter().filter(|(_, _, turned)| *turned >= MIN_TURNED.max(0.8 * most));
        let judged = worth.filter(|(start, _, turned)| !self.reappears(*start, end, *turned));
        let windows = judged.filter_map(|(start, least, turned)| {
            let frames: Option<Vec<_>> = (start..=end).map(|at| Some(&self.recent(at)?.thumbnail)).collect();
            let score = dissolves::score(&frames?, turned, least);
            (score > 0.0).then_some(Transition { start, end, score })
        });
        shortest_good(&windows.collect::<Vec<_>>())
    }

    /// Whether the picture before the change soon reappears, or the one after it was visible shortly before.
    fn reappears(&self, start: usize, end: usize, turned: f64) -> bool {
        let near = FLASH_FRAMES * self.frame_step;
        let like = |a: usize, b: usize| {
            let pair = self.recent(a).zip(self.recent(b));
            pair.is_some_and(|(a, b)| a.thumbnail.change(&b.thumbnail) < 0.5 * turned)
        };
        (end + 1..=end + near).any(|at| like(at, start)) || (start.saturating_sub(near)..start).any(|at| like(at, end))
    }
}

/// Non-maximum suppression: windows that do not overlap a better one.
fn suppress_overlaps(mut windows: Vec<Transition>) -> Vec<Transition> {
    let apart = |a: &Transition, b: &Transition| a.end < b.start || b.end < a.start;
    let mut selected = Vec::new();
    windows.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.start.cmp(&b.start)));
    while let Some(best) = windows.first().copied() {
        let (apart, around): (Vec<_>, Vec<_>) = windows.into_iter().partition(|window| apart(window, &best));
        selected.extend(shortest_good(&around));
        windows = apart;
    }
    selected
}

/// Shortest of the windows that score nearly as well as the best.
fn shortest_good(windows: &[Transition]) -> Option<Transition> {
    let best = windows.iter().map(|window| window.score).fold(0.0, f64::max);
    let good = windows.iter().filter(|window| window.score >= 0.9 * best);
    good.min_by(|a, b| (a.end - a.start).cmp(&(b.end - b.start)).then(b.score.total_cmp(&a.score))).copied()
}
