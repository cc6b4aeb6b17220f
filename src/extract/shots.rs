//! Where the camera cuts. Pictures come in as thumbnails and are compared cell by cell; only the differences between neighbours
//! are kept, one number a frame. How pictures are decoded and where the answer is written is not known here.
//!
//! `change(n)` is the share of cells whose colour differs by more than `CELL_STEP` in any channel between frames n - 1
//! and n (repeated frames left out). The score of frame n is what `change(n)` has beyond its surroundings:
//!
//! `score(n) = max(0, change(n) - max(change(n-2), change(n-1), change(n+1), change(n+2)))`
//!
//! A hard cut is a single step between still surroundings and scores its whole change; gestures, pans and noise go on
//! for several frames and cancel out; a flash changes twice and cancels itself. Fades and dissolves are no cuts here.

use super::still::THUMBNAIL;
use crate::types::image::Image;

/// From this score on what was followed before is not followed further, whatever counts as a shot later on.
pub const RESTART: f64 = 0.1;

/// Cells a side of the picture that is compared: each the mean of a block of the thumbnail.
const CELLS: usize = 16;

/// Steps of 8-bit colour that count as a change: above what compression and soft light do to a cell's mean.
const CELL_STEP: u8 = 20;

/// A thumbnail made `CELLS` by `CELLS`, RGB.
type Grid = Vec<[u8; 3]>;

/// Collects the changes from frame to frame.
#[derive(Default)]
pub struct ShotFinder {
    last: Option<Grid>,
    /// Share of changed cells against the frame before; `None` for the first frame and for repeated ones.
    changes: Vec<Option<f64>>,
}

impl ShotFinder {
    /// The next frame's thumbnail; `None` when it repeats the frame before.
    pub fn push(&mut self, thumbnail: Option<&Image>) {
        let Some(grid) = thumbnail.map(grid) else {
            self.changes.push(None);
            return;
        };
        self.changes.push(self.last.as_ref().map(|last| change(last, &grid)));
        self.last = Some(grid);
    }

    /// The score of every frame, 0..1.
    pub fn finish(self) -> Vec<f64> {
        let steps: Vec<f64> = self.changes.iter().flatten().copied().collect();
        let mut scores = (0..steps.len()).map(|n| score(&steps, n));
        self.changes.iter().map(|step| step.and_then(|_| scores.next()).unwrap_or(0.0)).collect()
    }
}

fn grid(thumbnail: &Image) -> Grid {
    let block = THUMBNAIL.map(|side| side / CELLS);
    let mut sums = vec![[0u32; 3]; CELLS * CELLS];
    for (y, row) in thumbnail.data.chunks_exact(3 * thumbnail.width).enumerate() {
        for (x, pixel) in row.as_chunks::<3>().0.iter().enumerate() {
            let cell = (y / block[1]).min(CELLS - 1) * CELLS + (x / block[0]).min(CELLS - 1);
            (0..3).for_each(|channel| sums[cell][channel] += u32::from(pixel[channel]));
        }
    }
    let n_pixels = (block[0] * block[1]) as u32;
    sums.into_iter().map(|sum| sum.map(|sum| (sum / n_pixels).min(255) as u8)).collect()
}

fn change(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    let n_changed = a.iter().zip(b).filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > CELL_STEP)).count();
    n_changed as f64 / a.len().max(1) as f64
}

fn score(steps: &[f64], n: usize) -> f64 {
    let around = (n.saturating_sub(2)..(n + 3).min(steps.len())).filter(|k| *k != n).map(|k| steps[k]);
    (steps[n] - around.fold(0.0, f64::max)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(levels: &[Option<u8>]) -> Vec<f64> {
        let mut finder = ShotFinder::default();
        for level in levels {
            finder.push(level.map(|level| Image::filled(THUMBNAIL[0], THUMBNAIL[1], [level; 3])).as_ref());
        }
        finder.finish()
    }

    #[test]
    fn a_cut_begins_a_shot_at_its_first_frame() {
        let found = scores(&[9, 9, 9, 90, 90, 90, 90, 9, 9].map(Some));
        assert_eq!(found, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn repeated_frames_do_not_hide_a_cut() {
        let found = scores(&[Some(9), None, Some(9), None, Some(90), None, Some(90), None]);
        assert_eq!(found, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn flashes_and_steady_change_are_no_cuts() {
        assert_eq!(scores(&[9, 9, 9, 200, 9, 9, 9].map(Some)), [0.0; 7]);
        assert_eq!(scores(&[0, 30, 60, 90, 120, 150, 180].map(Some)), [0.0; 7]);
    }

    #[test]
    fn short_videos_have_one_shot() {
        assert_eq!(scores(&[]), [0.0; 0]);
        assert_eq!(scores(&[Some(9)]), [0.0]);
        assert_eq!(scores(&[Some(9), Some(9)]), [0.0; 2]);
    }
}
