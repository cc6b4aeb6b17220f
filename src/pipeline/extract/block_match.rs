//! Whether two pictures show the same place, whatever the light and however the camera has moved: normalised
//! correlation of gray blocks, searched for nearby. Thumbnails come in; when they are compared is not known here.

use super::thumbnail::{THUMBNAIL, Thumbnail};

/// Side of a block, px.
const BLOCK: usize = 16;
/// How far a block is looked for, px to each side.
const REACH: usize = 8;
/// A block whose gray deviates less than this, in 8-bit steps, has nothing to be recognised by.
const FLAT: f32 = 3.0;
/// Correlation from which on a block has moved there, and what moving must gain over staying.
const MOVED: f32 = 0.8;
const MOVE_GAIN: f32 = 0.03;
/// Blocks to be recognised by that are needed to say anything.
const LEAST: usize = 3;

/// Share of the blocks of `picture` that are not in each of `others` nearby, a correlation of `least` taken for being
/// there; 1 where there is nothing to recognise.
pub fn missing(picture: &Thumbnail, others: &[&Thumbnail], least: f32) -> f64 {
    let (mut n, mut n_missing) = (0, 0);
    for block in blocks(picture) {
        n += 1;
        n_missing += usize::from(others.iter().any(|other| block.search(other).best < least));
    }
    if n < LEAST { 1.0 } else { n_missing as f64 / n as f64 }
}

/// Share of the blocks of `from` that are elsewhere in `to`: near 1 for a moving camera, small for moving people.
pub fn moved(from: &Thumbnail, to: &Thumbnail) -> f64 {
    let (mut n, mut n_moved) = (0, 0);
    for block in blocks(from) {
        let BlockMatch { best, there } = block.search(to);
        n += 1;
        n_moved += usize::from(best >= MOVED && best - there > MOVE_GAIN);
    }
    if n < LEAST { 0.0 } else { n_moved as f64 / n as f64 }
}

/// Correlation of the edges of two pictures, place by place, -1..1: near 1 for one scene in another light, near 0 for
/// two scenes.
pub fn same_edges(a: &Thumbnail, b: &Thumbnail) -> f64 {
    let [width, height] = THUMBNAIL;
    let (mut ab, mut aa, mut bb) = (0.0f64, 0.0f64, 0.0f64);
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            let at = y * width + x;
            for next in [at + 1, at + width] {
                let [da, db] = [a, b].map(|one| f64::from(one.gray[next] - one.gray[at]));
                ab += da * db;
                aa += da * da;
                bb += db * db;
            }
        }
    }
    ab / (aa * bb).sqrt().max(1e-9)
}

/// A block of a picture without its mean.
struct PictureBlock {
    x: usize,
    y: usize,
    values: Vec<f32>,
    /// Root of the sum of squares.
    norm: f32,
}

/// Correlation at the best place and at the same place.
struct BlockMatch {
    best: f32,
    there: f32,
}

fn blocks(picture: &Thumbnail) -> impl Iterator<Item = PictureBlock> {
    let [width, height] = THUMBNAIL;
    let corners =
        (0..height / BLOCK).flat_map(move |row| (0..width / BLOCK).map(move |col| (col * BLOCK, row * BLOCK)));
    corners.filter_map(|(x, y)| {
        let mut values: Vec<f32> = rows(picture, x, y).flatten().copied().collect();
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        for value in &mut values {
            *value -= mean;
        }
        let norm = values.iter().map(|value| value * value).sum::<f32>().sqrt();
        (norm >= FLAT * BLOCK as f32).then_some(PictureBlock { x, y, values, norm })
    })
}

/// The rows of the block whose corner is `x`, `y`.
fn rows(picture: &Thumbnail, x: usize, y: usize) -> impl Iterator<Item = &[f32]> {
    (y..y + BLOCK).map(move |row| &picture.gray[row * THUMBNAIL[0] + x..row * THUMBNAIL[0] + x + BLOCK])
}

impl PictureBlock {
    fn search(&self, other: &Thumbnail) -> BlockMatch {
        let around = |at: usize, side: usize| at.saturating_sub(REACH)..=(at + REACH).min(side - BLOCK);
        let mut found = BlockMatch { best: -1.0, there: -1.0 };
        for y in around(self.y, THUMBNAIL[1]) {
            for x in around(self.x, THUMBNAIL[0]) {
                let correlation = self.correlation(other, x, y);
                found.best = found.best.max(correlation);
                if (x, y) == (self.x, self.y) {
                    found.there = correlation;
                }
            }
        }
        found
    }

    fn correlation(&self, other: &Thumbnail, x: usize, y: usize) -> f32 {
        let (mut product, mut sum, mut squares) = (0.0f32, 0.0f32, 0.0f32);
        for (mine, theirs) in self.values.chunks_exact(BLOCK).zip(rows(other, x, y)) {
            for (a, b) in mine.iter().zip(theirs) {
                product += a * b;
                sum += b;
                squares += b * b;
            }
        }
        let n = (BLOCK * BLOCK) as f32;
        let norm = (squares - sum * sum / n).max(0.0).sqrt();
        product / (self.norm * norm.max(FLAT * BLOCK as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::thumbnail;

    fn scene(seed: usize, shift: usize, light: f64) -> Thumbnail {
        Thumbnail::new(thumbnail::scene(seed, shift, light))
    }

    #[test]
    fn light_changes_nothing_and_a_moved_camera_is_known() {
        let a = scene(1, 0, 1.0);
        assert!(missing(&a, &[&scene(1, 0, 0.4)], 0.75) == 0.0 && same_edges(&a, &scene(1, 0, 0.4)) > 0.99);
        assert!(missing(&a, &[&scene(1, 6, 1.0)], 0.75) < 0.3 && moved(&a, &scene(1, 6, 1.0)) > 0.7);
        assert_eq!(moved(&a, &scene(1, 0, 0.7)), 0.0);
    }

    #[test]
    fn another_scene_is_missing_and_a_flat_one_too() {
        let (a, b) = (scene(1, 0, 1.0), scene(2, 0, 1.0));
        assert!(missing(&a, &[&b], 0.75) > 0.9 && same_edges(&a, &b) < 0.2 && moved(&a, &b) < 0.1);
        let black = scene(1, 0, 0.0);
        assert!(missing(&a, &[&black], 0.75) == 1.0 && missing(&black, &[&a], 0.75) == 1.0);
        assert_eq!((same_edges(&a, &black), moved(&black, &a)), (0.0, 0.0));
    }
}
