//! Where the camera cuts. Pictures come in as thumbnails of `THUMBNAIL` cells; only the differences between neighbours
//! are kept, one number a frame. How pictures are decoded and where the answer is written is not known here.
//!
//! `change(n)` is the share of cells whose colour differs by more than `CELL_STEP` in any channel between frames n - 1
//! and n (repeated frames left out). The score of frame n is what `change(n)` has beyond its surroundings:
//!
//! `score(n) = max(0, change(n) - max(change(n-2), change(n-1), change(n+1), change(n+2)))`
//!
//! A hard cut is a single step between still surroundings and scores its whole change; gestures, pans and noise go on
//! for several frames and cancel out; a flash changes twice and cancels itself. Fades and dissolves are no cuts here.

use crate::types::image::Image;

/// Width and height of the pictures to compare, in cells.
pub const THUMBNAIL: [usize; 2] = [16, 16];

/// Steps of 8-bit colour that count as a change: above what compression and soft light do to a cell's mean.
const CELL_STEP: u8 = 20;

/// Collects the changes from frame to frame.
#[derive(Default)]
pub struct ShotFinder {
    last: Option<Image>,
    /// Share of changed cells against the frame before; `None` for the first frame and for repeated ones.
    changes: Vec<Option<f64>>,
}

/// The shots of a video, a value for each frame.
#[derive(Debug, PartialEq)]
pub struct Shots {
    /// Scene change score, 0..1.
    pub scores: Vec<f64>,
    /// Number of the shot, from 0; the first frame of a shot has its number.
    pub numbers: Vec<i64>,
}

impl ShotFinder {
    /// The next frame's thumbnail; `None` when it repeats the frame before.
    pub fn push(&mut self, thumbnail: Option<Image>) {
        let Some(thumbnail) = thumbnail else {
            self.changes.push(None);
            return;
        };
        self.changes.push(self.last.as_ref().map(|last| change(last, &thumbnail)));
        self.last = Some(thumbnail);
    }

    /// The shots, each beginning where the score reaches `threshold`.
    pub fn finish(self, threshold: f64) -> Shots {
        let steps: Vec<f64> = self.changes.iter().flatten().copied().collect();
        let mut step_scores = (0..steps.len()).map(|n| score(&steps, n));
        let mut number = 0;
        let (mut scores, mut numbers) = (Vec::new(), Vec::new());
        for step in &self.changes {
            let score = step.and_then(|_| step_scores.next()).unwrap_or(0.0);
            if score > 0.0 && score >= threshold {
                number += 1;
            }
            scores.push(score);
            numbers.push(number);
        }
        Shots { scores, numbers }
    }
}

fn change(a: &Image, b: &Image) -> f64 {
    let cells = a.data.as_chunks::<3>().0.iter().zip(b.data.as_chunks::<3>().0);
    let n_cells = a.data.len() / 3;
    let n_changed = cells.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > CELL_STEP)).count();
    n_changed as f64 / n_cells.max(1) as f64
}

fn score(steps: &[f64], n: usize) -> f64 {
    let around = (n.saturating_sub(2)..(n + 3).min(steps.len())).filter(|k| *k != n).map(|k| steps[k]);
    (steps[n] - around.fold(0.0, f64::max)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shots(levels: &[Option<u8>], threshold: f64) -> Shots {
        let mut finder = ShotFinder::default();
        for level in levels {
            finder.push(level.map(|level| Image::filled(THUMBNAIL[0], THUMBNAIL[1], [level; 3])));
        }
        finder.finish(threshold)
    }

    #[test]
    fn a_cut_begins_a_shot_at_its_first_frame() {
        let found = shots(&[9, 9, 9, 90, 90, 90, 90, 9, 9].map(Some), 0.2);
        assert_eq!(found.numbers, [0, 0, 0, 1, 1, 1, 1, 2, 2]);
        assert_eq!(found.scores, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn repeated_frames_do_not_hide_a_cut() {
        let found = shots(&[Some(9), None, Some(9), None, Some(90), None, Some(90), None], 0.2);
        assert_eq!(found.numbers, [0, 0, 0, 0, 1, 1, 1, 1]);
    }

    #[test]
    fn flashes_and_steady_change_are_no_cuts() {
        assert_eq!(shots(&[9, 9, 9, 200, 9, 9, 9].map(Some), 0.2).numbers, [0; 7]);
        assert_eq!(shots(&[0, 30, 60, 90, 120, 150, 180].map(Some), 0.2).numbers, [0; 7]);
    }

    #[test]
    fn short_videos_have_one_shot() {
        assert_eq!(shots(&[], 0.2), Shots { scores: vec![], numbers: vec![] });
        assert_eq!(shots(&[Some(9)], 0.0).numbers, [0]);
        assert_eq!(shots(&[Some(9), Some(9)], 0.0).numbers, [0, 0]);
    }
}
