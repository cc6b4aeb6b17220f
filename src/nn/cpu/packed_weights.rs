//! Weights of a convolution laid out as the tiles of `kernel` read them, and their products with the places of a
//! padded copy.

use super::kernel::{MOST_ROWS, TileJob, TileSteps, panels};
use super::tensor::{OutputStart, Scalar, written};
use super::thread_team::parallel_for;
use std::ops::Range;

/// Weights in the order in which tiles want them: panel after panel of columns, in each one row a step of the sum.
pub struct PackedWeights<T> {
    pub data: Vec<T>,
    pub panels: Vec<WeightPanel>,
}

/// Some columns of weights.
pub struct WeightPanel {
    /// Where its data begins, its first column, and how many of its columns there are; the rest of its width is zero.
    start: usize,
    first: usize,
    n: usize,
    n_vectors: usize,
    /// Width of the panel.
    pub columns: usize,
}

/// Where the weights of one pass lie: that of column `o`, channel `c` and the pass's tap `i` is number
/// `o * per_column + c * per_channel + taps[i]`; steps of a sum go through the channels of one tap after the other.
pub struct WeightOrder {
    pub n_columns: usize,
    pub per_column: usize,
    pub n_channels: usize,
    pub per_channel: usize,
    pub kernel_offsets: Vec<usize>,
}

/// Numbers of a column that are read at once: whole lines of memory.
const AT_ONCE: usize = 128;
/// Channels of a task.
const CHANNELS: usize = 64;

impl<T: Scalar> PackedWeights<T> {
    /// Packs the weights of a pass.
    pub fn pack(weight: &[T], order: &WeightOrder) -> Self {
        let WeightOrder { n_columns, per_column, n_channels, per_channel, kernel_offsets } = order;
        let (kernel, mut start) = (T::kernel(), 0);
        let panels = panels(&kernel, *n_columns).into_iter().map(|(first, n_vectors)| {
            let columns = n_vectors * kernel.lanes;
            let panel = WeightPanel { start, first, n: columns.min(n_columns - first), n_vectors, columns };
            start += columns * kernel_offsets.len() * n_channels;
            panel
        });
        let panels: Vec<WeightPanel> = panels.collect();
        let most = kernel_offsets.iter().copied().max().unwrap_or(0);
        let n_at_once = (AT_ONCE / kernel_offsets.len().max(1)).max(1);
        let pack = |data: OutputStart<T>, panel: &WeightPanel, channels: Range<usize>| {
            let mut rows = vec![T::zero(); n_at_once * kernel_offsets.len() * panel.columns];
            let mut line = Vec::new();
            for first in channels.clone().step_by(n_at_once) {
                let some = first..channels.end.min(first + n_at_once);
                // What lies side by side in memory is fetched at once, then scattered.
                let of_columns = per_column < per_channel;
                let (n_lines, in_line) = if of_columns { (some.len(), panel.n) } else { (panel.n, some.len()) };
                let (per_line, per_place) =
                    if of_columns { (per_channel, per_column) } else { (per_column, per_channel) };
                let corner = panel.first * per_column + first * per_channel;
                for n in 0..n_lines {
                    line.clear();
                    line.extend_from_slice(&weight[corner + n * per_line..][..(in_line - 1) * per_place + most + 1]);
                    for place in 0..in_line {
                        let (channel, column) = if of_columns { (n, place) } else { (place, n) };
                        for (i, kernel_offset) in kernel_offsets.iter().enumerate() {
                            rows[(channel * kernel_offsets.len() + i) * panel.columns + column] =
                                line[place * per_place + kernel_offset];
                        }
                    }
                }
                let steps = some
                    .flat_map(|c| (0..kernel_offsets.len()).map(move |kernel_offset| kernel_offset * n_channels + c));
                for (row, step) in rows.chunks_exact(panel.columns).zip(steps) {
                    // SAFETY: a step's row of this panel, which only this task writes.
                    unsafe {
                        let to = data.at(panel.start + step * panel.columns);
                        to.copy_from_nonoverlapping(row.as_ptr(), panel.columns);
                    }
                }
            }
        };
        let tasks: Vec<(&WeightPanel, Range<usize>)> = panels
            .iter()
            .flat_map(|panel| {
                // A phase of a gradient may have no tap at all.
                let starts = (0..*n_channels).step_by(CHANNELS).filter(|_| !kernel_offsets.is_empty());
                starts.map(move |start| (panel, start..(*n_channels).min(start + CHANNELS)))
            })
            .collect();
        // SAFETY: the tasks together write every row of every panel.
        let data = unsafe {
            written(start, |data: OutputStart<T>| {
                parallel_for(tasks.len(), |task| pack(data, tasks[task].0, tasks[task].1.clone()));
            })
        };
        Self { data, panels }
    }
}

impl WeightPanel {
    /// Adds the products of one block of steps to the sums at every place.
    ///
    /// # Safety
    /// Places lie inside `left` (with the block's reach) and `to`, which no other thread writes to there.
    pub unsafe fn multiply<T: Scalar>(
        &self,
        right: &[T],
        left: &[T],
        places: &[(usize, usize)],
        to: OutputStart<T>,
        block: &StepBlock,
    ) {
        let kernel = T::kernel();
        let right = right[self.start + block.right..].as_ptr();
        for tile in places.chunks(MOST_ROWS) {
            let of = |row: usize| tile[row.min(tile.len() - 1)];
            let mut job = TileJob {
                rows: std::array::from_fn(|row| left.as_ptr().wrapping_add(of(row).0 + block.left)),
                // SAFETY: the caller's.
                to: std::array::from_fn(|row| unsafe { to.at(of(row).1 + self.first) }),
                right,
                outer: block.outer,
                inner: block.inner,
            };
            // SAFETY: the caller's; where the panel is wider than its columns, sums are kept aside meanwhile.
            unsafe {
                if self.n == self.columns {
                    (kernel.run)(&job, tile.len(), self.n_vectors);
                    continue;
                }
                let mut aside = [[T::zero(); 64]; MOST_ROWS];
                let places = job.to;
                for (aside, place) in aside.iter_mut().zip(&places).take(tile.len()) {
                    aside.as_mut_ptr().copy_from_nonoverlapping(*place, self.n);
                }
                job.to = aside.each_mut().map(|row| row.as_mut_ptr());
                (kernel.run)(&job, tile.len(), self.n_vectors);
                for (aside, place) in aside.iter().zip(&places).take(tile.len()) {
                    place.copy_from_nonoverlapping(aside.as_ptr(), self.n);
                }
            }
        }
    }
}

/// Steps of a sum, as a part of all.
pub struct StepBlock {
    pub left: usize,
    pub right: usize,
    pub outer: TileSteps,
    pub inner: TileSteps,
}
