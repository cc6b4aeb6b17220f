//! Frontmost triangle at four samples of each pixel, one band of rows at a time, which fits into the cache.

/// Subpixels per pixel, to which vertices are rounded: integers leave no gaps between triangles that share an edge.
pub const SUBPIXELS: i32 = 16;
/// Maximum extent of a triangle whose edge functions fit into i32, subpixels.
const MAX_I32_EXTENT: i32 = 512 * SUBPIXELS;
/// Offsets of the samples from the centre of their pixel, subpixels: a rotated grid.
pub const SAMPLE_OFFSETS: [[i32; 2]; 4] = [[-2, -6], [6, -2], [-6, 2], [2, 6]];
const MAX_SAMPLE_OFFSET: i32 = 6;
/// Marks a sample that no triangle covers.
pub const NO_TRIANGLE: u32 = u32::MAX;
/// Width of the cells of the hierarchical depth test, px.
const CELL: usize = 8;
pub const BAND_ROWS: usize = 16;

/// Pixels that may have a sample within a triangle: half-open ranges of columns and rows.
pub type Extent = [[u16; 2]; 2];

#[derive(Clone, Copy, Debug)]
pub struct FlatTriangle {
    /// Corners, in subpixels from the centre of the top left pixel.
    pub corners: [[i32; 2]; 3],
    /// Inverse depth of the corners, 1/cm.
    pub inverse_depth: [f32; 3],
}

impl FlatTriangle {
    /// Twice the signed area; negative if the corners run counter-clockwise in the image.
    #[inline(always)]
    pub fn area(&self) -> i64 {
        let [a, b, c] = self.corners;
        let across = |p: [i32; 2], q: [i32; 2], k: usize| i64::from(q[k]) - i64::from(p[k]);
        across(a, b, 0) * across(a, c, 1) - across(a, c, 0) * across(a, b, 1)
    }

    /// Pixels in an image of `size` that may have a sample within the triangle.
    #[inline(always)]
    pub fn extent(&self, size: [usize; 2]) -> Extent {
        let ends = |k: usize| {
            let [a, b, c] = [self.corners[0][k], self.corners[1][k], self.corners[2][k]];
            let first = (a.min(b).min(c) - MAX_SAMPLE_OFFSET + SUBPIXELS - 1).div_euclid(SUBPIXELS);
            let last = (a.max(b).max(c) + MAX_SAMPLE_OFFSET).div_euclid(SUBPIXELS) + 1;
            let n = size[k] as i32;
            [first.clamp(0, n) as u16, last.clamp(0, n) as u16]
        };
        [ends(0), ends(1)]
    }
}

#[derive(Clone, Debug, Default)]
pub struct RowBand {
    width: usize,
    rows: [usize; 2],
    /// Inverse depth, 1/cm; 0 is infinity. Shape: [BAND_ROWS, width]
    pub inverse_depth: Vec<[f32; 4]>,
    pub triangles: Vec<[u32; 4]>,
    /// Minimum inverse depth in each cell, valid after `update_cells`.
    cells: Vec<f32>,
}

impl RowBand {
    pub fn new(width: usize) -> Self {
        let n = width * BAND_ROWS;
        let cells = vec![0.0; width.div_ceil(CELL) * BAND_ROWS / CELL];
        Self { width, rows: [0; 2], inverse_depth: vec![[0.0; 4]; n], triangles: vec![[NO_TRIANGLE; 4]; n], cells }
    }

    /// Resets the band to other rows and clears a range of columns; `background` is the inverse depth of the background
    /// for the whole image.
    pub fn reset(&mut self, rows: [usize; 2], columns: [usize; 2], background: Option<&[[f32; 4]]>) {
        self.rows = rows;
        for y in rows[0]..rows[1] {
            let row = self.at(columns[0], y)..self.at(columns[1], y);
            match background {
                Some(background) => {
                    let there = y * self.width;
                    self.inverse_depth[row.clone()]
                        .copy_from_slice(&background[there + columns[0]..there + columns[1]]);
                }
                None => self.inverse_depth[row.clone()].fill([0.0; 4]),
            }
            self.triangles[row].fill([NO_TRIANGLE; 4]);
        }
    }

    /// Index of a pixel, given its position in the image.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> usize {
        (y - self.rows[0]) * self.width + x
    }

    /// Computes the depth bounds of the cells in a range of columns, for `is_hidden`.
    pub fn update_cells(&mut self, columns: [usize; 2]) {
        let n_columns = self.width.div_ceil(CELL);
        for cell_y in 0..(self.rows[1] - self.rows[0]).div_ceil(CELL) {
            for cell_x in columns[0] / CELL..columns[1].div_ceil(CELL) {
                let mut least = [f32::INFINITY; 4];
                for y in cell_y * CELL..((cell_y + 1) * CELL).min(self.rows[1] - self.rows[0]) {
                    let ends = [cell_x * CELL, (cell_x + 1) * CELL].map(|x| x.clamp(columns[0], columns[1]));
                    for pixel in &self.inverse_depth[y * self.width + ends[0]..y * self.width + ends[1]] {
                        (0..4).for_each(|k| least[k] = if pixel[k] < least[k] { pixel[k] } else { least[k] });
                    }
                }
                self.cells[cell_y * n_columns + cell_x] = least[0].min(least[1]).min(least[2]).min(least[3]);
            }
        }
    }

    /// Whether a triangle is behind everything in the cells that it may touch.
    pub fn is_hidden(&self, triangle: &FlatTriangle, extent: Extent) -> bool {
        let ([first, last], [top, bottom]) = (extent[0].map(usize::from), self.rows_of(extent));
        let nearest = triangle.inverse_depth[0].max(triangle.inverse_depth[1]).max(triangle.inverse_depth[2]);
        let n_columns = self.width.div_ceil(CELL);
        ((top - self.rows[0]) / CELL..(bottom - self.rows[0]).div_ceil(CELL))
            .all(|y| (first / CELL..last.div_ceil(CELL)).all(|x| nearest < self.cells[y * n_columns + x]))
    }

    /// Rows of the band within an extent that overlaps it.
    #[inline(always)]
    fn rows_of(&self, extent: Extent) -> [usize; 2] {
        extent[1].map(|y| usize::from(y).clamp(self.rows[0], self.rows[1]))
    }

    /// Rasterises a triangle with either orientation wherever it is frontmost.
    pub fn fill(&mut self, triangle: &FlatTriangle, extent: Extent, number: u32) {
        let [a, b, c] = triangle.corners;
        let length = |k: usize| a[k].max(b[k]).max(c[k]) - a[k].min(b[k]).min(c[k]);
        if length(0) <= MAX_I32_EXTENT && length(1) <= MAX_I32_EXTENT {
            self.fill_with::<i32>(triangle, extent, number);
        } else {
            self.fill_with::<i64>(triangle, extent, number);
        }
    }

    #[inline(always)]
    fn fill_with<T: EdgeInteger>(&mut self, triangle: &FlatTriangle, extent: Extent, number: u32) {
        let FlatTriangle { corners, inverse_depth } = triangle;
        let area = triangle.area();
        let sign = area.signum() as i32;
        let ([left, right], [top, bottom]) = (extent[0].map(usize::from), self.rows_of(extent));
        let start = [left as i32 * SUBPIXELS, top as i32 * SUBPIXELS];
        // Edge functions, non-negative inside, at the four samples of the first pixel, and their steps per pixel.
        let mut edges = [[T::ZERO; 4]; 3];
        let mut steps = [[T::ZERO; 2]; 3];
        for side in 0..3 {
            let (p, q) = (corners[(side + 1) % 3], corners[(side + 2) % 3]);
            let slope = [T::of((p[1] - q[1]) * sign), T::of((q[0] - p[0]) * sign)];
            let middle = slope[0] * T::of(start[0] - p[0]) + slope[1] * T::of(start[1] - p[1]);
            for (edge, offset) in edges[side].iter_mut().zip(SAMPLE_OFFSETS) {
                *edge = middle + slope[0] * T::of(offset[0]) + slope[1] * T::of(offset[1]);
            }
            steps[side] = [slope[0] * T::of(SUBPIXELS), slope[1] * T::of(SUBPIXELS)];
        }
        // Inverse depth is a linear function of the image position.
        let [a, b, c] = *corners;
        let from_a = [(b[0] - a[0]) as f32, (b[1] - a[1]) as f32];
        let from_b = [(c[0] - a[0]) as f32, (c[1] - a[1]) as f32];
        let rise = [inverse_depth[1] - inverse_depth[0], inverse_depth[2] - inverse_depth[0]];
        let per_area = 1.0 / area as f32;
        let slope = [
            (rise[0] * from_b[1] - rise[1] * from_a[1]) * per_area,
            (rise[1] * from_a[0] - rise[0] * from_b[0]) * per_area,
        ];
        let mut first = [0.0; 4];
        for (first, offset) in first.iter_mut().zip(SAMPLE_OFFSETS) {
            let (right, down) = ((start[0] + offset[0] - a[0]) as f32, (start[1] + offset[1] - a[1]) as f32);
            *first = inverse_depth[0] + slope[0] * right + slope[1] * down;
        }
        let per_pixel = [slope[0] * SUBPIXELS as f32, slope[1] * SUBPIXELS as f32];
        self.fill_rows(&Setup { edges, steps, first, per_pixel, number }, [left, right], [top, bottom]);
    }

    /// Rasterises the pixels of an extent. It is separate so that the compiler vectorises over the four samples.
    #[inline(never)]
    fn fill_rows<T: EdgeInteger>(&mut self, setup: &Setup<T>, [left, right]: [usize; 2], [top, bottom]: [usize; 2]) {
        let Setup { mut edges, steps, mut first, per_pixel, number } = *setup;
        for y in top..bottom {
            let columns = self.at(left, y)..self.at(right, y);
            let pixels = self.inverse_depth[columns.clone()].iter_mut().zip(&mut self.triangles[columns]);
            let ([mut e0, mut e1, mut e2], mut here) = (edges, first);
            let mut is_entered = false;
            for (front, triangles) in pixels {
                // Loops over the four samples without branches compile to one instruction each.
                let mut outer = [0; 4];
                for k in 0..4 {
                    outer[k] = T::outer(e0[k], e1[k], e2[k]);
                }
                for k in 0..4 {
                    e0[k] = e0[k] + steps[0][0];
                    e1[k] = e1[k] + steps[1][0];
                    e2[k] = e2[k] + steps[2][0];
                }
                let mut new = here;
                here.iter_mut().for_each(|inverse_depth| *inverse_depth += per_pixel[0]);
                if outer[0] & outer[1] & outer[2] & outer[3] < 0 {
                    // Thin triangles may pass between samples, so a row ends only where all samples are beyond an edge.
                    if is_entered
                        && (is_beyond_edge(&e0, steps[0][0])
                            || is_beyond_edge(&e1, steps[1][0])
                            || is_beyond_edge(&e2, steps[2][0]))
                    {
                        break;
                    }
                    continue;
                }
                is_entered = true;
                // Samples outside the triangle get infinite depth.
                for k in 0..4 {
                    new[k] = f32::from_bits(new[k].to_bits() & !((outer[k] >> 31) as u32));
                }
                let (old, old_triangles) = (*front, *triangles);
                let (mut is_new, mut new_triangles) = ([0; 4], [0; 4]);
                for k in 0..4 {
                    is_new[k] = if new[k] > old[k] { u32::MAX } else { 0 };
                }
                for k in 0..4 {
                    new[k] = if new[k] > old[k] { new[k] } else { old[k] };
                }
                for k in 0..4 {
                    new_triangles[k] = number & is_new[k] | old_triangles[k] & !is_new[k];
                }
                (*front, *triangles) = (new, new_triangles);
            }
            for (edge, step) in edges.iter_mut().zip(steps) {
                edge.iter_mut().for_each(|v| *v = *v + step[1]);
            }
            first.iter_mut().for_each(|v| *v += per_pixel[1]);
        }
    }
}

/// Whether all samples of a pixel and of the pixels to its right are outside an edge.
#[inline(always)]
fn is_beyond_edge<T: EdgeInteger>(edge: &[T; 4], step: T) -> bool {
    let [a, b, c, d] = edge.map(|v| T::outer(v, v, v));
    a & b & c & d & T::outer(step, step, step) < 0
}

/// Edge functions and inverse depth of a triangle at the first pixel of its extent, and their steps per column and row.
struct Setup<T> {
    edges: [[T; 4]; 3],
    steps: [[T; 2]; 3],
    /// Inverse depth at the four samples, 1/cm.
    first: [f32; 4],
    per_pixel: [f32; 2],
    number: u32,
}

/// Integer type for the edge functions of a triangle.
trait EdgeInteger: Copy + std::ops::Add<Output = Self> + std::ops::Mul<Output = Self> {
    const ZERO: Self;
    fn of(v: i32) -> Self;
    /// Negative if any of the three is negative.
    fn outer(a: Self, b: Self, c: Self) -> i32;
}

impl EdgeInteger for i32 {
    const ZERO: Self = 0;

    fn of(v: i32) -> Self {
        v
    }

    #[inline(always)]
    fn outer(a: Self, b: Self, c: Self) -> i32 {
        a | b | c
    }
}

impl EdgeInteger for i64 {
    const ZERO: Self = 0;

    fn of(v: i32) -> Self {
        i64::from(v)
    }

    #[inline(always)]
    fn outer(a: Self, b: Self, c: Self) -> i32 {
        ((a | b | c) >> 32) as i32
    }
}
