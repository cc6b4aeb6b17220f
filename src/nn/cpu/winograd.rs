//! Convolutions of three taps and stride 1 along the first axis by Winograd's minimal filtering F(4, 3) (Lavin & Gray
//! 2016): a tile of four outputs takes six products instead of twelve. Inputs, weights and outputs pass through small
//! linear transforms along that axis; the products are convolutions with a kernel of length 1 there.

use super::axis::ConvAxis;
use super::direct_conv::{ConvPass, ConvSizes};
use super::kernel::MAX_ROWS;
use super::packed_matrix::{PackedWeights, WeightPanel};
use super::spin_pool::parallel_for;
use super::tensor::{LANES, Scalar, SharedOutputPtr, scratch, written};
use super::vectorised::vectorised;
use std::ops::Range;

/// Outputs of a tile, and the number of its products.
const TILE: usize = 4;
pub(super) const POINTS: usize = 6;
pub(super) const TAPS: usize = 3;
/// Number of tiles, and of channels on either side, below which the transforms cost more than they save.
const MIN_TILES: usize = 24;
const MIN_CHANNELS: usize = 32;
/// Transformed values of a part, and of the groups of tiles of a weight's gradient.
const PART: usize = 160 * 1024;
const GROUP: usize = 1 << 20;
/// Minimum number of parts of a pass, if its tiles are enough.
const MIN_PARTS: usize = 8;
/// Values that a task transforms.
const TASK: usize = 32 * 1024;

/// Returns whether the convolution and its gradients are computed by this file.
pub fn applies(s: &ConvSizes) -> bool {
    let [rows, columns] = s.axes;
    let is_fitting = rows.kernel == TAPS && rows.stride == 1 && columns.stride == 1;
    is_fitting && s.batch * rows.n_out.div_ceil(TILE) >= MIN_TILES && s.n_in.min(s.n_out) >= MIN_CHANNELS
}

vectorised!(
    /// Transforms the six input rows of a tile.
    transform_inputs = inputs_body(rows: [&[T]; POINTS], to: [&mut [T]; POINTS])
);
vectorised!(
    /// Transforms the four rows of a gradient: the transpose of [`transform_sums`].
    transform_gradients = gradients_body(rows: [&[T]; TILE], to: [&mut [T]; POINTS])
);
vectorised!(
    /// Adds `begin` and the transformed sums of a tile: four output rows.
    transform_sums = sums_body(sums: [&[T]; POINTS], begin: &[T], to: [&mut [T]; TILE])
);

vectorised!(
    /// Transforms the taps of weights.
    transform_taps = taps_body(taps: [&[T]; TAPS], to: [&mut [T]; POINTS])
);
vectorised!(
    /// Gradients of the taps: the transpose of [`transform_taps`].
    untransform_taps = untaps_body(points: [&[T]; POINTS], to: [&mut [T]; TAPS])
);

#[inline(always)]
fn inputs_body<T: Scalar>(rows: [&[T]; POINTS], to: [&mut [T]; POINTS]) {
    by_lanes(rows, to, |[a, b, c, d, e, f]| {
        let (even, odd) = (e - c * 4.0, d - b * 4.0);
        let (half_even, half_odd) = (e - c, (d - b) * 2.0);
        let (first, last) = (a * 4.0 - c * 5.0 + e, b * 4.0 - d * 5.0 + f);
        [first, even + odd, even - odd, half_even + half_odd, half_even - half_odd, last]
    });
}

#[inline(always)]
fn gradients_body<T: Scalar>(rows: [&[T]; TILE], to: [&mut [T]; POINTS]) {
    by_lanes(rows, to, |[a, b, c, d]| {
        let (even, odd, far_even, far_odd) = (a + c, b + d, a + c * 4.0, (b + d * 4.0) * 2.0);
        [a, even + odd, even - odd, far_even + far_odd, far_even - far_odd, d]
    });
}

#[inline(always)]
fn sums_body<T: Scalar>(sums: [&[T]; POINTS], begin: &[T], to: [&mut [T]; TILE]) {
    let [a, b, c, d, e, f] = sums;
    by_lanes([a, b, c, d, e, f, begin], to, |[a, b, c, d, e, f, begin]| {
        let (near_even, far_even, near_odd, far_odd) = (b + c, d + e, b - c, d - e);
        let (even, odd) = (begin + near_even, begin + near_odd);
        [even + a + far_even, odd + far_odd * 2.0, even + far_even * 4.0, odd + far_odd * 8.0 + f]
    });
}

#[inline(always)]
fn taps_body<T: Scalar>(taps: [&[T]; TAPS], to: [&mut [T]; POINTS]) {
    by_lanes(taps, to, |[a, b, c]| {
        let (near, near_odd) = ((a + c) * (-1.0 / 6.0), b * (1.0 / 6.0));
        let (far, far_odd) = (a * (1.0 / 24.0) + c * (1.0 / 6.0), b * (1.0 / 12.0));
        [a * 0.25, near - near_odd, near + near_odd, far + far_odd, far - far_odd, c]
    });
}

#[inline(always)]
fn untaps_body<T: Scalar>(points: [&[T]; POINTS], to: [&mut [T]; TAPS]) {
    by_lanes(points, to, |[a, b, c, d, e, f]| {
        let (near, far) = ((b + c) * (1.0 / 6.0), (d + e) * (1.0 / 24.0));
        [a * 0.25 - near + far, (c - b) * (1.0 / 6.0) + (d - e) * (1.0 / 12.0), far * 4.0 - near + f]
    });
}

/// A vector of columns.
#[derive(Clone, Copy)]
struct Lanes<T>([T; LANES]);

macro_rules! lanes_operator {
    ($trait:ident, $method:ident) => {
        impl<T: Scalar> std::ops::$trait for Lanes<T> {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                (0..LANES).for_each(|i| self.0[i] = self.0[i].$method(other.0[i]));
                self
            }
        }
    };
}
lanes_operator!(Add, add);
lanes_operator!(Sub, sub);

impl<T: Scalar> std::ops::Mul<f64> for Lanes<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(mut self, factor: f64) -> Self {
        let factor = T::from_f64(factor);
        (0..LANES).for_each(|i| self.0[i] = self.0[i] * factor);
        self
    }
}

/// Calls `f` for each vector of columns of the rows `from`.
#[inline(always)]
fn by_lanes<T: Scalar, const M: usize, const N: usize>(
    from: [&[T]; M],
    mut to: [&mut [T]; N],
    f: impl Fn([Lanes<T>; M]) -> [Lanes<T>; N],
) {
    let n_columns = from[0].len();
    assert!(from.iter().all(|row| row.len() == n_columns) && to.iter().all(|row| row.len() == n_columns));
    let n_complete = n_columns / LANES * LANES;
    for at in (0..n_complete).step_by(LANES) {
        let mut lanes = [Lanes([T::zero(); LANES]); M];
        for (lanes, from) in lanes.iter_mut().zip(from) {
            lanes.0.copy_from_slice(&from[at..at + LANES]);
        }
        for (lanes, to) in f(lanes).iter().zip(&mut to) {
            to[at..at + LANES].copy_from_slice(&lanes.0);
        }
    }
    if n_complete < n_columns {
        let mut lanes = [Lanes([T::zero(); LANES]); M];
        for (lanes, from) in lanes.iter_mut().zip(from) {
            lanes.0[..n_columns - n_complete].copy_from_slice(&from[n_complete..]);
        }
        for (lanes, to) in f(lanes).iter().zip(&mut to) {
            to[n_complete..].copy_from_slice(&lanes.0[..n_columns - n_complete]);
        }
    }
}

/// Rows of a tensor [B, rows, ...], in tiles: tile `t` of a sample starts at row `first + 4 t`.
struct TileRows<'a, T> {
    values: &'a [T],
    zeros: &'a [T],
    n_rows: usize,
    first: isize,
    /// Tiles per sample.
    n_tiles: usize,
}

impl<T: Scalar> TileRows<'_, T> {
    /// Rows of a tile of the batch; zeros outside the sample.
    fn tile<const N: usize>(&self, tile: usize) -> [&[T]; N] {
        let len = self.zeros.len();
        let (b, first) = (tile / self.n_tiles, self.first + (tile % self.n_tiles * TILE) as isize);
        std::array::from_fn(|i| match usize::try_from(first + i as isize) {
            Ok(row) if row < self.n_rows => &self.values[(b * self.n_rows + row) * len..][..len],
            _ => self.zeros,
        })
    }

    /// Transforms tiles by `f`, to six matrices [tiles, row] that follow each other in `to`.
    fn transform<const N: usize>(
        &self,
        tiles: Range<usize>,
        to: &mut [T],
        f: impl Fn([&[T]; N], [&mut [T]; POINTS]) + Sync,
    ) {
        let (len, start, n) = (self.zeros.len(), tiles.start, tiles.len());
        assert!(to.len() == POINTS * n * len);
        let per_task = (TASK / len).max(1);
        let to = SharedOutputPtr::new(to);
        parallel_for(n.div_ceil(per_task), |task| {
            for tile in task * per_task..n.min((task + 1) * per_task) {
                // SAFETY: only this task writes the rows of this tile.
                let to = std::array::from_fn(|point| unsafe {
                    std::slice::from_raw_parts_mut(to.at((point * n + tile) * len), len)
                });
                f(self.tile(start + tile), to);
            }
        });
    }
}

/// Partition of the tiles of a batch into parts of nearly equal size.
pub struct WinogradTiles {
    per_sample: usize,
    n: usize,
    n_parts: usize,
}

impl WinogradTiles {
    /// Partition for outputs of `n_rows` rows per sample, such that the transformed values of a part, `row_len` per tile
    /// and point, fit in the second-level cache.
    pub fn new(batch: usize, n_rows: usize, row_len: usize) -> Self {
        let tiles = batch * n_rows.div_ceil(TILE);
        Self::with_parts(batch, n_rows, (PART / (POINTS * row_len)).min(tiles.div_ceil(MIN_PARTS)))
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

/// Runs a pass with this weight, whose element of column `o` and channel `c` starts at `per_column o + per_channel c`.
/// `begin` and `finish` as in [`super::direct_conv::forward`].
pub(super) fn run<T: Scalar>(
    pass: &ConvPass,
    from: &[T],
    (weight, per_column, per_channel): (&[T], usize, usize),
    begin: &[T],
    finish: impl Fn(usize, &mut [T]) + Sync,
) -> Vec<T> {
    let [rows, columns] = &pass.windows;
    let (from_len, to_len) = (columns.n_from * pass.n_from, columns.n_to * pass.n_to);
    let panels = transform_weights(&PackedWeights::pack(weight, &pass.order(per_column, per_channel)));
    let tiles = WinogradTiles::new(pass.batch, rows.n, from_len + to_len);
    let (zeros, begin) = (vec![T::zero(); from_len.max(pass.n_to)], begin.repeat(columns.n_to));
    let inputs = TileRows {
        values: from,
        zeros: &zeros[..from_len],
        n_rows: rows.n_from,
        first: rows.first,
        n_tiles: tiles.per_sample,
    };
    let row = |tile: usize| tile / tiles.per_sample * rows.n + tile % tiles.per_sample * TILE;
    let compute = |part: usize, to: SharedOutputPtr<T>, transformed: &mut [T], sums: &mut [T]| {
        let tiles = tiles.part(part);
        let n = tiles.len();
        let (transformed, sums) = (&mut transformed[..POINTS * n * from_len], &mut sums[..POINTS * n * to_len]);
        inputs.transform(tiles.clone(), transformed, transform_inputs);
        let products = ConvPass {
            batch: 1,
            n_from: pass.n_from,
            n_to: pass.n_to,
            windows: [ConvAxis::valid(n, 1, 1).forward(), columns.clone()],
            kernel: [1, pass.kernel[1]],
        };
        let of_points = transformed.chunks_exact(n * from_len).zip(sums.chunks_exact_mut(n * to_len));
        for ((from, to), panels) in of_points.zip(&panels) {
            // SAFETY: `to` has room for the sums of all tiles.
            unsafe { products.run(from, panels, &zeros[..pass.n_to], SharedOutputPtr::new(to), 0, 0..n) };
        }
        let (at, end) = (row(tiles.start), row(tiles.end));
        // SAFETY: the rows of a part follow each other, and only this task writes them.
        let to = unsafe { std::slice::from_raw_parts_mut(to.at(at * to_len), (end - at) * to_len) };
        let sums = |point: usize, tile: usize| &sums[(point * n + tile - tiles.start) * to_len..][..to_len];
        write_rows(to, to_len, &begin, tiles.clone(), |tile| row(tile + 1) - row(tile), sums);
        finish(part, to);
    };
    // SAFETY: the parts together cover every row of every sample.
    unsafe {
        written(pass.batch * rows.n * to_len, |to: SharedOutputPtr<T>| {
            parallel_for(tiles.n_parts, |part| {
                scratch(POINTS * tiles.largest() * from_len, |transformed: &mut [T]| {
                    scratch(POINTS * tiles.largest() * to_len, |sums: &mut [T]| compute(part, to, transformed, sums));
                });
            });
        })
    }
}

/// Writes the output rows of `tiles` to `to`, `n_rows` of each.
fn write_rows<'a, T: Scalar>(
    mut to: &mut [T],
    len: usize,
    begin: &[T],
    tiles: Range<usize>,
    n_rows: impl Fn(usize) -> usize,
    sums: impl Fn(usize, usize) -> &'a [T],
) {
    fn all<T>(rows: &mut [T], len: usize) -> [&mut [T]; TILE] {
        let (a, rows) = rows.split_at_mut(len);
        let (b, rows) = rows.split_at_mut(len);
        let (c, d) = rows.split_at_mut(len);
        [a, b, c, d]
    }
    for tile in tiles {
        let rows;
        (rows, to) = std::mem::take(&mut to).split_at_mut(n_rows(tile) * len);
        let sums = std::array::from_fn(|point| sums(point, tile));
        if rows.len() == TILE * len {
            transform_sums(sums, begin, all(rows, len));
            continue;
        }
        scratch(TILE * len, |complete: &mut [T]| {
            transform_sums(sums, begin, all(complete, len));
            rows.copy_from_slice(&complete[..rows.len()]);
        });
    }
}

/// Transforms packed weights: those of a point have a third of the steps.
fn transform_weights<T: Scalar>(weights: &PackedWeights<T>) -> [PackedWeights<T>; POINTS] {
    let mut points = std::array::from_fn(|_| weights.resized(TAPS));
    let of_points = points.each_mut().map(|point: &mut PackedWeights<T>| {
        (SharedOutputPtr::new(&mut point.data), point.panels.iter().map(WeightPanel::start).collect::<Vec<_>>())
    });
    parallel_for(weights.panels.len(), |panel| {
        let steps = weights.steps(panel);
        let n = steps.len() / TAPS;
        let taps = std::array::from_fn(|tap| &steps[tap * n..][..n]);
        // SAFETY: the panels are disjoint parts of the data of each point.
        let to = of_points
            .each_ref()
            .map(|(data, starts)| unsafe { std::slice::from_raw_parts_mut(data.at(starts[panel]), n) });
        transform_taps(taps, to);
    });
    points
}

/// Transformed rows of an input and of the gradient of the output, and sizes of the products that add up to the
/// transformed gradient of the weight.
pub(super) struct GradientGroup<'a, T> {
    pub sizes: ConvSizes,
    pub x: &'a [T],
    pub grad: &'a [T],
}

/// Calls `add` with each group of tiles: for point p, `x` and `grad` have `len / 6` values from `p len / 6` on.
pub(super) fn gradient_groups<T: Scalar>(s: &ConvSizes, x: &[T], grad: &[T], mut add: impl FnMut(GradientGroup<T>)) {
    let [rows, columns] = s.axes;
    let (x_len, grad_len) = (columns.n_in * s.n_in, columns.n_out * s.n_out);
    let tiles = WinogradTiles::with_parts(s.batch, rows.n_out, GROUP / (POINTS * (x_len + grad_len)));
    let zeros = vec![T::zero(); x_len.max(grad_len)];
    let of = |values, len, n_rows, first| TileRows {
        values,
        zeros: &zeros[..len],
        n_rows,
        first,
        n_tiles: tiles.per_sample,
    };
    let (inputs, gradients) = (of(x, x_len, rows.n_in, -(rows.pad as isize)), of(grad, grad_len, rows.n_out, 0));
    scratch(POINTS * tiles.largest() * x_len, |x: &mut [T]| {
        scratch(POINTS * tiles.largest() * grad_len, |grad: &mut [T]| {
            for tiles in (0..tiles.n_parts).map(|part| tiles.part(part)) {
                let n = tiles.len();
                let (x, grad) = (&mut x[..POINTS * n * x_len], &mut grad[..POINTS * n * grad_len]);
                inputs.transform(tiles.clone(), x, transform_inputs);
                gradients.transform(tiles, grad, transform_gradients);
                add(GradientGroup {
                    sizes: ConvSizes { batch: 1, axes: [ConvAxis::valid(n, 1, 1), columns], ..*s },
                    x,
                    grad,
                });
            }
        });
    });
}

/// Gradients of the taps from those of the transformed weight.
pub(super) fn gradients_of_taps<T: Scalar>(points: [&[T]; POINTS]) -> [Vec<T>; TAPS] {
    let mut taps = std::array::from_fn(|_| vec![T::zero(); points[0].len()]);
    untransform_taps(points, taps.each_mut().map(|tap: &mut Vec<T>| &mut tap[..]));
    taps
}
