//! Matrices in the memory order in which the tiles of `kernel` read them: one for repeated multiplication (a recurrent
//! layer multiplies its weights with a few rows at every step of a sequence, too few to pack them every time), and the
//! weights of a convolution with their products with positions of a padded copy.

use super::kernel::{MAX_ROWS, TileJob, TileKernel, TileSteps, panels};
use super::spin_pool::parallel_for;
use super::tensor::{LANES, Scalar, SharedOutputPtr, aligned, written};
use std::ops::Range;

/// Columns are padded with zeros to a multiple of this number.
pub const COLUMNS: usize = 16;
/// Maximum number of columns of a tile.
const MAX_COLUMNS: usize = 64;

/// Matrix [depth, columns], stored as consecutive panels of columns.
pub struct PackedMatrix<T> {
    data: Vec<T>,
    /// Start of the first panel in `data`, on a cache line.
    start: usize,
    /// First column and number of vectors of each panel.
    panels: Vec<(usize, usize)>,
    kernel: TileKernel<T>,
    depth: usize,
    width: usize,
    /// Number of consecutive products that are summed on their own.
    block: usize,
}

impl<T: Scalar> PackedMatrix<T> {
    /// Packs a matrix; `element(row, column)` returns its elements.
    pub fn new(depth: usize, n_columns: usize, element: impl Fn(usize, usize) -> T) -> Self {
        Self::with_block(depth, n_columns, depth.max(1), element)
    }

    /// Packs a matrix whose products are summed in blocks of `block`, at least 1, which rounds less for large depths.
    pub fn with_block(depth: usize, n_columns: usize, block: usize, element: impl Fn(usize, usize) -> T) -> Self {
        let (kernel, width) = (T::kernel(), n_columns.next_multiple_of(COLUMNS));
        let panels = panels(&kernel, width);
        let mut data = vec![T::zero(); depth * width + LANES];
        let start = aligned(data.as_ptr());
        for &(first, n_vectors) in &panels {
            let n = n_vectors * kernel.lanes;
            let inside = n.min(n_columns.saturating_sub(first));
            for (row, to) in data[start + depth * first..][..depth * n].chunks_exact_mut(n).enumerate() {
                to[..inside].iter_mut().enumerate().for_each(|(i, to)| *to = element(row, first + i));
            }
        }
        Self { data, start, panels, kernel, depth, width, block }
    }

    /// Number of columns, including the padding.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Value of the matrix at this row and column.
    pub fn get(&self, row: usize, column: usize) -> T {
        let panel = self.panels.partition_point(|(first, _)| *first <= column).saturating_sub(1);
        let (first, n_vectors) = self.panels[panel];
        self.data[self.start + self.depth * first + row * n_vectors * self.kernel.lanes + column - first]
    }

    /// Adds the products of `n_rows` rows of `left` with the matrix to the rows of `to`, which have at least `width`
    /// values. Successive rows start `left_stride` and `to_stride` values apart.
    pub fn multiply_add(&self, n_rows: usize, left: &[T], left_stride: usize, to: &mut [T], to_stride: usize) {
        if n_rows == 0 || self.depth == 0 {
            return;
        }
        assert!(
            (n_rows - 1) * left_stride + self.depth <= left.len()
                && (n_rows - 1) * to_stride + self.width <= to.len()
                && (self.width <= to_stride || n_rows == 1),
            "strides {left_stride} and {to_stride} do not fit a matrix of {} x {}",
            self.depth,
            self.width
        );
        let (left, to) = (left.as_ptr(), to.as_mut_ptr());
        let none = TileSteps { n: 1, left: 0, right: 0 };
        let zeros = [T::zero(); MAX_COLUMNS];
        let mut sums = [zeros; MAX_ROWS];
        for &(first, n_vectors) in &self.panels {
            let columns = n_vectors * self.kernel.lanes;
            let panel = &self.data[self.start + self.depth * first..][..self.depth * columns];
            for row in (0..n_rows).step_by(MAX_ROWS) {
                let n = MAX_ROWS.min(n_rows - row);
                let to = std::array::from_fn(|i| to.wrapping_add((row + i.min(n - 1)) * to_stride + first));
                for (i, right) in panel.chunks(self.block * columns).enumerate() {
                    let from_step = |row: usize| left.wrapping_add(row * left_stride + i * self.block);
                    let mut job = TileJob {
                        rows: std::array::from_fn(|i| from_step(row + i.min(n - 1))),
                        from: to.map(<*mut T>::cast_const),
                        to,
                        right: right.as_ptr(),
                        outer: none,
                        inner: TileSteps { n: right.len() / columns, left: 1, right: columns },
                    };
                    if i > 0 {
                        job.from = [zeros.as_ptr(); MAX_ROWS];
                        job.to = sums.each_mut().map(|row| row.as_mut_ptr());
                    }
                    // SAFETY: the assert bounds the addresses of `left` and `to`; the block holds its steps' columns.
                    unsafe { (self.kernel.run)(&job, n, n_vectors) };
                    for (to, sums) in to.iter().zip(&sums).take(if i > 0 { n } else { 0 }) {
                        // SAFETY: as above.
                        let to = unsafe { std::slice::from_raw_parts_mut(*to, columns) };
                        to.iter_mut().zip(sums).for_each(|(to, sum)| *to += *sum);
                    }
                }
            }
        }
    }
}

/// Weights in tile order: consecutive panels of columns; each panel has one row per summation step.
pub struct PackedWeights<T> {
    pub data: Vec<T>,
    /// End of the last panel in `data`.
    end: usize,
    pub panels: Vec<WeightPanel>,
}

pub struct WeightPanel {
    /// Start of its data, its first column, and its number of columns; the rest of its width is zero.
    start: usize,
    first: usize,
    n: usize,
    n_vectors: usize,
    /// Width of the panel, including the padding.
    pub columns: usize,
}

/// Memory order of the weights of a pass: the weight of column `o`, channel `c` and the pass's kernel offset `i` is at
/// `o * per_column + c * per_channel + kernel_offsets[i]`; the summation steps go over the channels of each offset.
pub struct WeightOrder {
    pub n_columns: usize,
    pub per_column: usize,
    pub n_channels: usize,
    pub per_channel: usize,
    pub kernel_offsets: Vec<usize>,
}

/// Number of values of a column that are read together: complete cache lines.
const AT_ONCE: usize = 128;
/// Number of channels per task.
const CHANNELS: usize = 64;

impl<T: Scalar> PackedWeights<T> {
    pub fn pack(weight: &[T], order: &WeightOrder) -> Self {
        let WeightOrder { n_columns, per_column, n_channels, per_channel, kernel_offsets } = order;
        let (kernel, mut start) = (T::kernel(), 0);
        let panels = panels(&kernel, *n_columns).into_iter().map(|(first, n_vectors)| {
            let columns = n_vectors * kernel.lanes;
            let panel = WeightPanel { start, first, n: columns.min(n_columns - first), n_vectors, columns };
            start += columns * kernel_offsets.len() * n_channels;
            panel
        });
        let mut panels: Vec<WeightPanel> = panels.collect();
        let max_offset = kernel_offsets.iter().copied().max().unwrap_or(0);
        let n_at_once = (AT_ONCE / kernel_offsets.len().max(1)).max(1);
        // Values that are adjacent in memory are read together: the channels of a column, or the columns of a channel.
        let of_columns = per_column < per_channel;
        let (per_line, per_position) =
            if of_columns { (*per_channel, *per_column) } else { (*per_column, *per_channel) };
        let pack = |data: SharedOutputPtr<T>, panel: &WeightPanel, channels: Range<usize>| {
            let mut lines = Vec::new();
            for first in channels.clone().step_by(n_at_once) {
                let some = first..channels.end.min(first + n_at_once);
                let (n_lines, in_line) = if of_columns { (some.len(), panel.n) } else { (panel.n, some.len()) };
                let corner = panel.first * per_column + first * per_channel;
                let length = (in_line - 1) * per_position + max_offset + 1;
                lines.clear();
                for n in 0..n_lines {
                    lines.extend_from_slice(&weight[corner + n * per_line..][..length]);
                }
                let (from_channel, from_column) =
                    if of_columns { (length, per_position) } else { (per_position, length) };
                for channel in some.clone() {
                    for (i, kernel_offset) in kernel_offsets.iter().enumerate() {
                        let row = &lines[(channel - first) * from_channel + kernel_offset..];
                        let step = i * n_channels + channel;
                        // SAFETY: only this task writes this step's row of this panel.
                        let to = unsafe {
                            std::slice::from_raw_parts_mut(data.at(panel.start + step * panel.columns), panel.columns)
                        };
                        let (inside, outside) = to.split_at_mut(panel.n);
                        let row = &row[..(panel.n - 1) * from_column + 1];
                        for (column, to) in inside.iter_mut().enumerate() {
                            *to = row[column * from_column];
                        }
                        outside.fill(T::zero());
                    }
                }
            }
        };
        let tasks: Vec<(&WeightPanel, Range<usize>)> = panels
            .iter()
            .flat_map(|panel| {
                // A phase of a gradient may have no kernel offset.
                let starts = (0..*n_channels).step_by(CHANNELS).filter(|_| !kernel_offsets.is_empty());
                starts.map(move |start| (panel, start..(*n_channels).min(start + CHANNELS)))
            })
            .collect();
        let n_numbers = start;
        let mut first = 0;
        // SAFETY: the tasks together write every row of every panel; this thread pads before and after them.
        let data = unsafe {
            written(n_numbers + LANES, |data: SharedOutputPtr<T>| {
                first = aligned(data.at(0));
                (0..first).chain(first + n_numbers..n_numbers + LANES).for_each(|i| data.at(i).write(T::zero()));
                let data = data.from(first);
                parallel_for(tasks.len(), |task| pack(data, tasks[task].0, tasks[task].1.clone()));
            })
        };
        panels.iter_mut().for_each(|panel| panel.start += first);
        Self { data, end: first + n_numbers, panels }
    }
}

impl<T: Scalar> PackedWeights<T> {
    /// Where all steps of a panel are in `data`.
    pub fn steps(&self, panel: usize) -> Range<usize> {
        self.panels[panel].start..self.panels.get(panel + 1).map_or(self.end, |next| next.start)
    }

    /// Zero weights of the same panels with a `share`-th of the steps.
    pub fn with_share(&self, share: usize) -> Self {
        let from = self.panels.first().map_or(0, |panel| panel.start);
        let n = (self.end - from) / share;
        let data = vec![T::zero(); n + LANES];
        let first = aligned(data.as_ptr());
        let panel = |panel: &WeightPanel| WeightPanel { start: first + (panel.start - from) / share, ..*panel };
        Self { panels: self.panels.iter().map(panel).collect(), end: first + n, data }
    }
}

impl WeightPanel {
    /// Adds the products of one block of steps to the sums at every position, or to `begin`, one value per column, if
    /// the block is the first.
    ///
    /// # Safety
    /// The positions, extended by the block, lie inside `left` and `to`, and no other thread writes there.
    pub unsafe fn multiply<T: Scalar>(
        &self,
        right: &[T],
        left: &[T],
        positions: &[(usize, usize)],
        to: SharedOutputPtr<T>,
        begin: Option<&[T]>,
        block: &StepBlock,
    ) {
        let kernel = T::kernel();
        let begin = begin.map(|begin| begin[self.first..][..self.n].as_ptr());
        let right = right[self.start + block.right..].as_ptr();
        for tile in positions.chunks(MAX_ROWS) {
            let of = |row: usize| tile[row.min(tile.len() - 1)];
            // SAFETY: guaranteed by the caller.
            let to: [*mut T; MAX_ROWS] = std::array::from_fn(|row| unsafe { to.at(of(row).1 + self.first) });
            let mut job = TileJob {
                rows: std::array::from_fn(|row| left.as_ptr().wrapping_add(of(row).0 + block.left)),
                from: to.map(|to| begin.unwrap_or(to)),
                to,
                right,
                outer: block.outer,
                inner: block.inner,
            };
            // SAFETY: guaranteed by the caller; if the panel is wider than its columns, the sums are in a local buffer.
            unsafe {
                if self.n == self.columns {
                    (kernel.run)(&job, tile.len(), self.n_vectors);
                    continue;
                }
                let mut local = [[T::zero(); MAX_COLUMNS]; MAX_ROWS];
                for (local, from) in local.iter_mut().zip(&job.from).take(tile.len()) {
                    local.as_mut_ptr().copy_from_nonoverlapping(*from, self.n);
                }
                job.to = local.each_mut().map(|row| row.as_mut_ptr());
                job.from = job.to.map(<*mut T>::cast_const);
                (kernel.run)(&job, tile.len(), self.n_vectors);
                for (local, position) in local.iter().zip(&to).take(tile.len()) {
                    position.copy_from_nonoverlapping(local.as_ptr(), self.n);
                }
            }
        }
    }
}

/// A block of summation steps: offsets of its factors, and its loops.
pub struct StepBlock {
    pub left: usize,
    pub right: usize,
    pub outer: TileSteps,
    pub inner: TileSteps,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_added() {
        let element = |row: usize, column: usize| (row * 100 + column) as f64;
        for (depth, n_columns, n_rows) in [(5, 150, 13), (1, 3, 1), (7, 16, 6), (3, 65, 2)] {
            let matrix = PackedMatrix::with_block(depth, n_columns, 3, element);
            let (left_stride, to_stride) = (depth + 2, matrix.width() + 3);
            let left: Vec<f64> = (0..n_rows * left_stride).map(|i| (i % 7) as f64).collect();
            let mut to = vec![1.0; n_rows * to_stride];
            matrix.multiply_add(n_rows, &left, left_stride, &mut to, to_stride);
            for (row, to) in to.chunks_exact(to_stride).enumerate() {
                for (column, to) in to.iter().enumerate() {
                    let product = |k: usize| left[row * left_stride + k] * element(k, column);
                    let is_inside = column < n_columns;
                    assert_eq!(*to, 1.0 + if is_inside { (0..depth).map(product).sum() } else { 0.0 });
                }
            }
        }
    }
}
