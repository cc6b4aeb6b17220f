//! Downsampled part of a picture: mean colours of the cells of a grid over a box. Used by `liveness` and `appearance`.

use orator_base::types::image::Image;

/// Sampled points per side of each cell.
const POINTS_PER_SIDE: usize = 4;

/// Mean colours, 0..255 per channel, of `columns` x `rows` cells over the box (x, y, width, height in px), row-major.
/// Outside the picture, edge pixels are repeated; an empty picture is black.
pub fn colours(image: &Image, [x, y, width, height]: [f64; 4], [columns, rows]: [usize; 2]) -> Vec<[f32; 3]> {
    if image.width == 0 || image.height == 0 {
        return vec![[0.0; 3]; columns * rows];
    }
    let sample_positions = |start: f64, size: f64, n: usize, side: usize| -> Vec<usize> {
        let n = n * POINTS_PER_SIDE;
        let position = |at: usize| start + size * (at as f64 + 0.5) / n as f64;
        (0..n).map(|at| (position(at).max(0.0) as usize).min(side - 1)).collect()
    };
    let xs = sample_positions(x, width, columns, image.width);
    let ys = sample_positions(y, height, rows, image.height);
    let cell = |at: usize| {
        let (column, row) = (at % columns * POINTS_PER_SIDE, at / columns * POINTS_PER_SIDE);
        let mut sum = [0.0f32; 3];
        for &y in &ys[row..row + POINTS_PER_SIDE] {
            for &x in &xs[column..column + POINTS_PER_SIDE] {
                let pixel = image.pixel(x, y);
                (0..3).for_each(|channel| sum[channel] += f32::from(pixel[channel]));
            }
        }
        sum.map(|sum| sum / (POINTS_PER_SIDE * POINTS_PER_SIDE) as f32)
    };
    (0..columns * rows).map(cell).collect()
}
