//! Convolutions along the first axis by Winograd's minimal filtering (Lavin & Gray 2016): a tile of four outputs of three
//! taps takes six products instead of twelve, of two taps five instead of eight. Inputs, weights and outputs pass through
//! small linear transforms; the products are shorter convolutions. A convolution of four taps and stride 2 is one of two
//! taps over pairs of rows.

use super::axis::ConvAxis;
use super::direct_conv::{ConvPass, ConvSizes};
use super::kernel::MAX_ROWS;
use super::packed_matrix::PackedWeights;
use super::spin_pool::parallel_for;
use super::tensor::{Scalar, SharedOutputPtr, scratch};
use super::winograd_filter::{Lanes, TILE, ThreeTaps, TwoTaps, WinogradFilter, transform};
use std::ops::Range;

/// Number of tiles (twice as many for two taps), and of channels on either side, below which the transforms cost more than
/// they save.
const MIN_TILES: usize = 24;
const MIN_CHANNELS: usize = 32;
/// Transformed values of a part, and of the groups of tiles of a weight's gradient.
const PART: usize = 160 * 1024;
const GROUP: usize = 1 << 20;
/// Minimum number of parts of a pass, if its tiles are enough.
const MIN_PARTS: usize = 8;
/// Products of a tile of three taps.
const MAX_POINTS: usize = 6;
/// Values that a task transforms.
const TASK: usize = 32 * 1024;

/// Number of taps of a filter, after the rows of a stride have been taken together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterTaps {
    Two,
    Three,
}

impl FilterTaps {
    /// Filter of a convolution and its gradients; `None`: they are computed directly.
    pub fn of(s: &ConvSizes) -> Option<Self> {
        let [rows, columns] = s.axes;
        let (taps, min_tiles) = match (rows.kernel, rows.stride, columns.stride) {
            (3, 1, 1) => (Self::Three, MIN_TILES),
            (4, 2, _) => (Self::Two, 2 * MIN_TILES),
            _ => return None,
        };
        let is_large = rows.n_out >= TILE && s.batch * rows.n_out.div_ceil(TILE) >= min_tiles;
        (is_large && s.n_in.min(s.n_out) >= MIN_CHANNELS).then_some(taps)
    }
}

/// Partition of the tiles of a batch into parts of nearly equal size.
pub struct WinogradTiles {
    per_sample: usize,
    n: usize,
    n_parts: usize,
}

impl WinogradTiles {
    /// Partition of a forward pass, whose transformed values fit in the second-level cache.
    pub fn forward(s: &ConvSizes) -> Self {
        let [rows, columns] = s.axes;
        Self::of_pass(s.batch, rows.n_out, rows.stride * columns.n_in * s.n_in + columns.n_out * s.n_out)
    }

    fn of_pass(batch: usize, n_rows: usize, row_len: usize) -> Self {
        let n = batch * n_rows.div_ceil(TILE);
        Self::with_parts(batch, n_rows, (PART / (MAX_POINTS * row_len)).min(n.div_ceil(MIN_PARTS)))
    }

    /// Partition into parts of at most `at_most` tiles, but at least complete tiles of the kernel.
    fn with_parts(batch: usize, n_rows: usize, at_most: usize) -> Self {
        let per_sample = n_rows.div_ceil(TILE);
        let n = batch * per_sample;
        Self { per_sample, n, n_parts: n.div_ceil(at_most.max(MAX_ROWS)) }
    }

    pub fn n_parts(&self) -> usize {
        self.n_parts
    }

    fn part(&self, part: usize) -> Range<usize> {
        self.n * part / self.n_parts..self.n * (part + 1) / self.n_parts
    }

    /// Number of tiles of the largest part.
    fn largest(&self) -> usize {
        self.n.div_ceil(self.n_parts.max(1))
    }
}

/// Rows of a tensor [B, rows, ...] in tiles: row `i` of phase `p` of tile `t` of a sample is `first + (4 t + i) phases +
/// p`.
struct TileRows<'a, T> {
    values: &'a [T],
    zeros: &'a [T],
    n_rows: usize,
    first: isize,
    phases: usize,
    /// Tiles per sample.
    n_tiles: usize,
}

impl<T: Scalar> TileRows<'_, T> {
    /// Rows of a tile of the batch; zeros outside the sample.
    fn tile<const N: usize>(&self, tile: usize, phase: usize) -> [&[T]; N] {
        let (len, b, tile) = (self.zeros.len(), tile / self.n_tiles, tile % self.n_tiles);
        std::array::from_fn(|i| {
            let row = self.first + ((tile * TILE + i) * self.phases + phase) as isize;
            match usize::try_from(row) {
                Ok(row) if row < self.n_rows => &self.values[(b * self.n_rows + row) * len..][..len],
                _ => self.zeros,
            }
        })
    }

    /// Applies `map` to tiles: matrices [tiles, phases, row] that follow each other in `to`.
    fn transform<const N: usize, const POINTS: usize>(
        &self,
        tiles: Range<usize>,
        to: &mut [T],
        map: impl Fn([Lanes<T>; N]) -> [Lanes<T>; POINTS] + Sync,
    ) {
        let (len, start, n) = (self.zeros.len(), tiles.start, tiles.len() * self.phases);
        assert!(to.len() == POINTS * n * len);
        let per_task = (TASK / len).max(1);
        let to = SharedOutputPtr::new(to);
        parallel_for(n.div_ceil(per_task), |task| {
            for row in task * per_task..n.min((task + 1) * per_task) {
                // SAFETY: only this task writes this row of the matrices.
                let to = std::array::from_fn(|point| unsafe {
                    std::slice::from_raw_parts_mut(to.at((point * n + row) * len), len)
                });
                transform(self.tile(start + row / self.phases, row % self.phases), to, &map);
            }
        });
    }
}

/// A pass whose windows read `TAPS` rows of each phase; a convolution of stride 2 has two phases of rows.
#[derive(Clone, Copy)]
pub(super) struct WinogradPass<'a, T> {
    pub pass: &'a ConvPass,
    pub from: &'a [T],
    /// Packed in the order of the pass.
    pub weights: &'a PackedWeights<T>,
    pub begin: &'a [T],
}

impl<T: Scalar> WinogradPass<'_, T> {
    /// Writes the outputs, as [`ConvPass::run`] for all windows; `finish` as in [`super::direct_conv::forward`], only for
    /// passes that write every row.
    ///
    /// # Safety
    /// `to` has room for the batch's results, and no other thread writes to those of these windows.
    pub(super) unsafe fn run(&self, taps: FilterTaps, to: SharedOutputPtr<T>, finish: impl Fn(usize, &mut [T]) + Sync) {
        // SAFETY: guaranteed by the caller.
        unsafe {
            match taps {
                FilterTaps::Two => self.run_filter::<TwoTaps, 2, 5>(to, finish),
                FilterTaps::Three => self.run_filter::<ThreeTaps, 3, 6>(to, finish),
            }
        }
    }

    unsafe fn run_filter<F: WinogradFilter<TAPS, POINTS>, const TAPS: usize, const POINTS: usize>(
        &self,
        to: SharedOutputPtr<T>,
        finish: impl Fn(usize, &mut [T]) + Sync,
    ) {
        let [rows, columns] = &self.pass.windows;
        let phases = rows.kernel_offsets.len() / TAPS;
        let (from_len, to_len) = (columns.n_from * self.pass.n_from, columns.n * self.pass.n_to);
        let weights = transform_weights::<T, F, TAPS, POINTS>(self.weights, phases);
        let all_tiles = WinogradTiles::of_pass(self.pass.batch, rows.n, phases * from_len + to_len);
        let zeros = vec![T::zero(); from_len.max(self.pass.n_to)];
        let inputs = TileRows {
            values: self.from,
            zeros: &zeros[..from_len],
            n_rows: rows.n_from,
            first: rows.first,
            phases,
            n_tiles: all_tiles.per_sample,
        };
        let mut columns_of_products = columns.clone();
        (columns_of_products.n_to, columns_of_products.to_first, columns_of_products.to_step) = (columns.n, 0, 1);
        let compute = |part: usize, transformed: &mut [T], sums: &mut [T]| {
            let tiles = all_tiles.part(part);
            let n = tiles.len();
            let transformed = &mut transformed[..POINTS * phases * n * from_len];
            inputs.transform(tiles.clone(), transformed, F::inputs);
            let products = ConvPass {
                batch: 1,
                n_from: self.pass.n_from,
                n_to: self.pass.n_to,
                windows: [ConvAxis::valid(n * phases, phases, phases).forward(), columns_of_products.clone()],
                kernel: [phases, self.pass.kernel[1]],
            };
            let of_points = transformed.chunks_exact(phases * n * from_len).zip(sums.chunks_exact_mut(n * to_len));
            for (point, ((from, to), weights)) in of_points.zip(&weights).enumerate() {
                // The product at the point 1 is part of every output.
                let begin = if point == 1 { self.begin } else { &zeros[..self.pass.n_to] };
                // SAFETY: `to` has room for the sums of all tiles.
                unsafe { products.run(from, weights, begin, SharedOutputPtr::new(to), 0, 0..n) };
            }
            for tile in tiles.clone() {
                let sums = |point: usize| &sums[(point * n + tile - tiles.start) * to_len..][..to_len];
                // SAFETY: only this task writes the rows of these tiles.
                unsafe {
                    self.write_tile::<F, TAPS, POINTS>(tile, all_tiles.per_sample, std::array::from_fn(sums), to);
                };
            }
            if rows.to_step == 1 && columns.n == columns.n_to {
                let row = |tile: usize| tile / all_tiles.per_sample * rows.n + tile % all_tiles.per_sample * TILE;
                let (at, end) = (row(tiles.start) * to_len, row(tiles.end) * to_len);
                // SAFETY: the rows of a part follow each other, and only this task writes them.
                finish(part, unsafe { std::slice::from_raw_parts_mut(to.at(at), end - at) });
            }
        };
        parallel_for(all_tiles.n_parts, |part| {
            scratch(POINTS * phases * all_tiles.largest() * from_len, |transformed: &mut [T]| {
                scratch(POINTS * all_tiles.largest() * to_len, |sums: &mut [T]| compute(part, transformed, sums));
            });
        });
    }

    /// Writes the output rows of a tile.
    ///
    /// # Safety
    /// As for [`Self::run`].
    unsafe fn write_tile<F: WinogradFilter<TAPS, POINTS>, const TAPS: usize, const POINTS: usize>(
        &self,
        tile: usize,
        n_tiles: usize,
        sums: [&[T]; POINTS],
        to: SharedOutputPtr<T>,
    ) {
        let [rows, columns] = &self.pass.windows;
        let (b, first, len, n_to) = (tile / n_tiles, tile % n_tiles * TILE, sums[0].len(), self.pass.n_to);
        let at = |row: usize, column: usize| {
            let row = b * rows.n_to + rows.to_first + (first + row) * rows.to_step;
            // SAFETY: guaranteed by the caller.
            unsafe { to.at((row * columns.n_to + columns.to_first + column * columns.to_step) * n_to) }
        };
        if columns.to_step == 1 && first + TILE <= rows.n {
            // SAFETY: only this task writes these rows.
            let four = std::array::from_fn(|row| unsafe { std::slice::from_raw_parts_mut(at(row, 0), len) });
            return transform(sums, four, F::outputs);
        }
        scratch(TILE * len, |outputs: &mut [T]| {
            let mut four = outputs.chunks_exact_mut(len);
            transform(sums, std::array::from_fn(|_| four.next().unwrap_or_default()), F::outputs);
            for (row, output) in outputs.chunks_exact(len).enumerate().take(rows.n - first) {
                for (column, output) in output.chunks_exact(n_to).enumerate() {
                    // SAFETY: guaranteed by the caller.
                    unsafe { at(row, column).copy_from_nonoverlapping(output.as_ptr(), n_to) };
                }
            }
        });
    }
}

/// Transforms packed weights, whose steps are `TAPS` times `phases` rows: those of a point have one row per phase.
fn transform_weights<T: Scalar, F: WinogradFilter<TAPS, POINTS>, const TAPS: usize, const POINTS: usize>(
    weights: &PackedWeights<T>,
    phases: usize,
) -> [PackedWeights<T>; POINTS] {
    let mut points = std::array::from_fn(|_| weights.with_share(TAPS));
    let of_points = points.each_mut().map(|point: &mut PackedWeights<T>| {
        let starts: Vec<usize> = (0..point.panels.len()).map(|panel| point.steps(panel).start).collect();
        (SharedOutputPtr::new(&mut point.data), starts)
    });
    parallel_for(weights.panels.len() * phases, |task| {
        let (panel, phase) = (task / phases, task % phases);
        let steps = &weights.data[weights.steps(panel)];
        let n = steps.len() / (TAPS * phases);
        let taps = std::array::from_fn(|tap| &steps[(tap * phases + phase) * n..][..n]);
        let to = of_points.each_ref().map(|(data, starts)| {
            // SAFETY: the tasks write disjoint parts of the data of each point.
            unsafe { std::slice::from_raw_parts_mut(data.at(starts[panel] + phase * n), n) }
        });
        transform(taps, to, F::taps);
    });
    points
}

/// Transformed rows of some tiles of an input and of the gradient of the output, of one point after the other, and sizes
/// of the products that add up to the gradient of the transformed weight.
pub(super) struct GradientTiles<'a, T> {
    pub sizes: ConvSizes,
    pub n_points: usize,
    pub x: &'a [T],
    pub grad: &'a [T],
}

/// Calls `add` with each group of tiles.
pub(super) fn gradient_tiles<T: Scalar>(
    taps: FilterTaps,
    s: &ConvSizes,
    operands: [&[T]; 2],
    add: impl FnMut(GradientTiles<T>),
) {
    match taps {
        FilterTaps::Two => gradient_tiles_of::<T, TwoTaps, 2, 5>(s, operands, add),
        FilterTaps::Three => gradient_tiles_of::<T, ThreeTaps, 3, 6>(s, operands, add),
    }
}

fn gradient_tiles_of<T: Scalar, F: WinogradFilter<TAPS, POINTS>, const TAPS: usize, const POINTS: usize>(
    s: &ConvSizes,
    [x, grad]: [&[T]; 2],
    mut add: impl FnMut(GradientTiles<T>),
) {
    let [rows, columns] = s.axes;
    let phases = rows.stride;
    let (x_len, grad_len) = (columns.n_in * s.n_in, columns.n_out * s.n_out);
    let at_most = GROUP / (POINTS * (phases * x_len + grad_len));
    let all_tiles = WinogradTiles::with_parts(s.batch, rows.n_out, at_most);
    let zeros = vec![T::zero(); x_len.max(grad_len)];
    let n_tiles = all_tiles.per_sample;
    let first = -(rows.pad as isize);
    let inputs = TileRows { values: x, zeros: &zeros[..x_len], n_rows: rows.n_in, first, phases, n_tiles };
    let zeros = &zeros[..grad_len];
    let gradients = TileRows { values: grad, zeros, n_rows: rows.n_out, first: 0, phases: 1, n_tiles };
    scratch(POINTS * phases * all_tiles.largest() * x_len, |x: &mut [T]| {
        scratch(POINTS * all_tiles.largest() * grad_len, |grad: &mut [T]| {
            for tiles in (0..all_tiles.n_parts).map(|part| all_tiles.part(part)) {
                let n = tiles.len();
                let (x, grad) = (&mut x[..POINTS * phases * n * x_len], &mut grad[..POINTS * n * grad_len]);
                inputs.transform(tiles.clone(), x, F::inputs);
                gradients.transform(tiles, grad, F::gradients_of_outputs);
                let axes = [ConvAxis::valid(n * phases, phases, phases), columns];
                add(GradientTiles { sizes: ConvSizes { batch: 1, axes, ..*s }, n_points: POINTS, x, grad });
            }
        });
    });
}

/// Gradients of the rows of taps, [offsets of rows, ...], from those of the points, each [phases, ...].
pub(super) fn gradients_of_taps<T: Scalar>(taps: FilterTaps, points: &[Vec<T>], phases: usize) -> Vec<T> {
    fn of<T: Scalar, F: WinogradFilter<TAPS, POINTS>, const TAPS: usize, const POINTS: usize>(
        points: &[Vec<T>],
        phases: usize,
    ) -> Vec<T> {
        let n = points[0].len() / phases;
        let mut gradients = vec![T::zero(); TAPS * phases * n];
        for phase in 0..phases {
            let points = std::array::from_fn(|point| &points[point][phase * n..][..n]);
            let mut rows = gradients.chunks_exact_mut(n).skip(phase).step_by(phases);
            let rows = std::array::from_fn(|_| rows.next().unwrap_or_default());
            transform(points, rows, F::gradients_of_taps);
        }
        gradients
    }
    match taps {
        FilterTaps::Two => of::<T, TwoTaps, 2, 5>(points, phases),
        FilterTaps::Three => of::<T, ThreeTaps, 3, 6>(points, phases),
    }
}
