//! Block matching of two thumbnails, invariant to lighting and small camera movement: normalised cross-correlation of
//! gray blocks within a search range.

use super::thumbnail::{THUMBNAIL, Thumbnail};

/// Block size, px.
const BLOCK: usize = 16;
/// Search range, px to each side.
const SEARCH_RANGE: usize = 8;
/// Least standard deviation of a block in 8-bit steps; flatter blocks have no texture to match.
const MIN_DEVIATION: f32 = 3.0;
/// Least correlation of a moved block, and least gain over the correlation at its original position.
const MIN_MOVED_CORRELATION: f32 = 0.8;
const MIN_MOVE_GAIN: f32 = 0.03;
/// Least number of textured blocks for a result.
const MIN_BLOCKS: usize = 3;

/// Share of the blocks of `picture` that are missing in any of `others`, i.e. whose best correlation is below `least`;
/// 1 if there are too few textured blocks.
pub fn missing(picture: &Thumbnail, others: &[&Thumbnail], least: f32) -> f64 {
    let (mut n, mut n_missing) = (0, 0);
    for block in blocks(picture) {
        n += 1;
        n_missing += usize::from(others.iter().any(|other| block.search(other).best < least));
    }
    if n < MIN_BLOCKS { 1.0 } else { n_missing as f64 / n as f64 }
}

/// Share of the blocks of `from` that have moved in `to`: near 1 for a moving camera, small for moving people.
pub fn moved(from: &Thumbnail, to: &Thumbnail) -> f64 {
    let (mut n, mut n_moved) = (0, 0);
    for block in blocks(from) {
        let BlockMatch { best, at_origin } = block.search(to);
        n += 1;
        n_moved += usize::from(best >= MIN_MOVED_CORRELATION && best - at_origin > MIN_MOVE_GAIN);
    }
    if n < MIN_BLOCKS { 0.0 } else { n_moved as f64 / n as f64 }
}

/// Correlation of two pictures' gradients at equal positions: near 1 for a scene in other light, near 0 for two scenes.
pub fn edge_correlation(a: &Thumbnail, b: &Thumbnail) -> f64 {
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

/// A block of a picture, mean subtracted.
struct PictureBlock {
    x: usize,
    y: usize,
    values: Vec<f32>,
    /// L2 norm of `values`.
    norm: f32,
}

/// Largest correlation within the search range, and the correlation at the original position.
struct BlockMatch {
    best: f32,
    at_origin: f32,
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
        (norm >= MIN_DEVIATION * BLOCK as f32).then_some(PictureBlock { x, y, values, norm })
    })
}

/// Rows of the block with corner `x`, `y`.
fn rows(picture: &Thumbnail, x: usize, y: usize) -> impl Iterator<Item = &[f32]> {
    (y..y + BLOCK).map(move |row| &picture.gray[row * THUMBNAIL[0] + x..row * THUMBNAIL[0] + x + BLOCK])
}

impl PictureBlock {
    fn search(&self, other: &Thumbnail) -> BlockMatch {
        let around = |at: usize, side: usize| at.saturating_sub(SEARCH_RANGE)..=(at + SEARCH_RANGE).min(side - BLOCK);
        let mut found = BlockMatch { best: -1.0, at_origin: -1.0 };
        for y in around(self.y, THUMBNAIL[1]) {
            for x in around(self.x, THUMBNAIL[0]) {
                let correlation = self.correlation(other, x, y);
                found.best = found.best.max(correlation);
                if (x, y) == (self.x, self.y) {
                    found.at_origin = correlation;
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
        product / (self.norm * norm.max(MIN_DEVIATION * BLOCK as f32))
    }
}
