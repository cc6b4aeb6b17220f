//! Direct convolution over two axes, channels last, on plain slices: forward and the gradient of the input, f32 or f64.
//! Nothing is unfolded: the tiles of `kernel` read their left factors in place (from a padded copy of a few rows in the
//! cache) and multiply them with weights that are packed once per pass. A convolution over time only has one axis of
//! length 1. Every value is summed by one thread in a fixed order, so results do not depend on the number of threads.

use super::axis::{AxisWindows, ConvAxis};
use super::kernel::{MAX_ROWS, TileSteps};
use super::packed_matrix::{PackedWeights, StepBlock, WeightOrder};
use super::spin_pool::parallel_for;
use super::tensor::{Scalar, SharedOutputPtr, scratch, written};
use super::winograd::{FilterTaps, WinogradPass, WinogradTiles};
use std::ops::Range;

/// Maximum number of input values that a task copies (but at least some rows), and number of summation steps whose
/// packed weights stay in the first-level cache.
const CHUNK: usize = 48 * 1024;
const DEPTH: usize = 144;

/// Sizes of a convolution: input [B, rows, columns, n_in], weight [n_out, n_in, K rows, K columns], output [B, rows',
/// columns', n_out].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConvSizes {
    pub batch: usize,
    pub n_in: usize,
    pub n_out: usize,
    pub axes: [ConvAxis; 2],
}

impl ConvSizes {
    pub fn kernel_len(&self) -> usize {
        self.axes[0].kernel * self.axes[1].kernel
    }

    /// Number of values of the input; below, those of the weight and of the output.
    pub fn len_in(&self) -> usize {
        self.batch * self.axes[0].n_in * self.axes[1].n_in * self.n_in
    }

    pub fn len_weight(&self) -> usize {
        self.n_in * self.n_out * self.kernel_len()
    }

    pub fn len_out(&self) -> usize {
        self.batch * self.axes[0].n_out * self.axes[1].n_out * self.n_out
    }
}

/// Convolves `x` and adds `bias`. `finish` is called with the number of a chunk (0..[`n_chunks`]) and its rows of the
/// output [positions, n_out] as soon as they are complete, while they are in the cache.
pub fn forward<T: Scalar>(
    s: &ConvSizes,
    x: &[T],
    weight: &[T],
    bias: &[T],
    finish: impl Fn(usize, &mut [T]) + Sync,
) -> Vec<T> {
    assert!(x.len() == s.len_in() && weight.len() == s.len_weight() && bias.len() == s.n_out);
    let pass = forward_pass(s);
    let weights = PackedWeights::pack(weight, &pass.order(s.n_in * s.kernel_len(), s.kernel_len()));
    let per_row = s.axes[1].n_out * s.n_out;
    // SAFETY: the chunks are disjoint and together cover every row of every output.
    unsafe {
        written(s.len_out(), |to: SharedOutputPtr<T>| {
            if let Some(taps) = FilterTaps::of(s) {
                WinogradPass { pass: &pass, from: x, weights: &weights, begin: bias }.run(taps, to, finish);
                return;
            }
            let chunks = pass.chunks();
            parallel_for(chunks.len(), |number| {
                let (b, rows) = chunks[number].clone();
                let start = to.at((b * s.axes[0].n_out + rows.start) * per_row);
                let n = rows.len() * per_row;
                pass.run(x, &weights, bias, to, b, rows);
                finish(number, std::slice::from_raw_parts_mut(start, n));
            });
        })
    }
}

pub fn n_chunks(s: &ConvSizes) -> usize {
    if FilterTaps::of(s).is_some() {
        return WinogradTiles::forward(s).n_parts();
    }
    forward_pass(s).chunks().len()
}

fn forward_pass(s: &ConvSizes) -> ConvPass {
    ConvPass {
        batch: s.batch,
        n_from: s.n_in,
        n_to: s.n_out,
        windows: s.axes.map(|axis| axis.forward()),
        kernel: s.axes.map(|axis| axis.kernel),
    }
}

pub fn gradient_of_input<T: Scalar>(s: &ConvSizes, weight: &[T], grad: &[T]) -> Vec<T> {
    assert!(grad.len() == s.len_out() && weight.len() == s.len_weight());
    let zeros = vec![T::zero(); s.n_in];
    let taps = FilterTaps::of(s);
    // SAFETY: the chunks of all phases are disjoint and together cover every position.
    unsafe {
        written(s.len_in(), |to: SharedOutputPtr<T>| {
            for rows in s.axes[0].backward() {
                for columns in s.axes[1].backward() {
                    let pass = ConvPass {
                        batch: s.batch,
                        n_from: s.n_out,
                        n_to: s.n_in,
                        windows: [rows.clone(), columns],
                        kernel: s.axes.map(|axis| axis.kernel),
                    };
                    let weights = PackedWeights::pack(weight, &pass.order(s.kernel_len(), s.n_in * s.kernel_len()));
                    if let Some(taps) = taps {
                        let pass = WinogradPass { pass: &pass, from: grad, weights: &weights, begin: &zeros };
                        pass.run(taps, to, |_, _| ());
                        continue;
                    }
                    let chunks = pass.chunks();
                    parallel_for(chunks.len(), |number| {
                        let (b, rows) = chunks[number].clone();
                        pass.run(grad, &weights, &zeros, to, b, rows);
                    });
                }
            }
        })
    }
}

/// One convolution over padded rows: forward, or one phase of the backward pass.
pub(super) struct ConvPass {
    pub(super) batch: usize,
    pub(super) n_from: usize,
    pub(super) n_to: usize,
    pub(super) windows: [AxisWindows; 2],
    /// Size of the complete kernel.
    pub(super) kernel: [usize; 2],
}

impl ConvPass {
    pub(super) fn order(&self, per_column: usize, per_channel: usize) -> WeightOrder {
        let [rows, columns] = &self.windows;
        let kernel_offsets = rows
            .kernel_offsets
            .iter()
            .flat_map(|row| columns.kernel_offsets.iter().map(move |c| row * self.kernel[1] + c))
            .collect();
        WeightOrder { n_columns: self.n_to, per_column, n_channels: self.n_from, per_channel, kernel_offsets }
    }

    /// Returns sample and window rows of each chunk of work, independent of the number of threads.
    pub(super) fn chunks(&self) -> Vec<(usize, Range<usize>)> {
        let [rows, columns] = &self.windows;
        let per_row = columns.receptive_field(columns.n) * self.n_from;
        let n_rows = ((CHUNK / per_row.max(1)).saturating_sub(rows.kernel_offsets.len()) / rows.step + 1)
            .max(MAX_ROWS.div_ceil(columns.n))
            .min(rows.n);
        // Chunks of equal size instead of a small last one.
        let n = rows.n.div_ceil(n_rows);
        let chunk = move |b, i| (b, rows.n * i / n..rows.n * (i + 1) / n);
        (0..self.batch).flat_map(|b| (0..n).map(move |i| chunk(b, i))).collect()
    }

    /// Writes the outputs of the windows of sample `b` in these rows: `begin` plus the sums.
    ///
    /// # Safety
    /// `to` has room for the batch's results, and no other thread writes to those of these windows.
    pub(super) unsafe fn run<T: Scalar>(
        &self,
        from: &[T],
        panels: &PackedWeights<T>,
        begin: &[T],
        to: SharedOutputPtr<T>,
        b: usize,
        chunk: Range<usize>,
    ) {
        let [rows, columns] = &self.windows;
        let (width, n_from) = (columns.receptive_field(columns.n), self.n_from);
        let per_row = width * n_from;
        let first = rows.first + (chunk.start * rows.step) as isize;
        let n_rows = rows.receptive_field(chunk.len());
        let is_inside = width == columns.n_from && first >= 0 && first as usize + n_rows <= rows.n_from;
        let copied = if is_inside && columns.first == 0 { 0 } else { n_rows * per_row };
        scratch(copied, |padded: &mut [T]| {
            let padded = if copied > 0 {
                self.copy(from, padded, b, chunk.start);
                &*padded
            } else {
                &from[(b * rows.n_from + first as usize) * per_row..]
            };
            let positions = chunk.clone().flat_map(|row| (0..columns.n).map(move |column| (row, column)));
            let positions: Vec<(usize, usize)> = positions
                .map(|(row, column)| {
                    let left = ((row - chunk.start) * rows.step * width + column * columns.step) * n_from;
                    let to_row = b * rows.n_to + rows.to_first + row * rows.to_step;
                    (left, (to_row * columns.n_to + columns.to_first + column * columns.to_step) * self.n_to)
                })
                .collect();
            // The steps of one row offset are contiguous in the padded copy.
            let run = columns.kernel_offsets.len() * n_from;
            if rows.kernel_offsets.len() * run == 0 {
                for (_, position) in &positions {
                    // SAFETY: guaranteed by the caller.
                    unsafe { to.at(*position).copy_from_nonoverlapping(begin.as_ptr(), self.n_to) };
                }
                return;
            }
            let n_runs = (DEPTH / run.max(1)).max(1);
            let n_parts = run.div_ceil(DEPTH);
            for panel in &panels.panels {
                for row in (0..rows.kernel_offsets.len()).step_by(n_runs) {
                    for part in 0..n_parts {
                        let part = run * part / n_parts..run * (part + 1) / n_parts;
                        let outer = n_runs.min(rows.kernel_offsets.len() - row);
                        let at = StepBlock {
                            left: row * per_row + part.start,
                            right: (row * run + part.start) * panel.columns,
                            outer: TileSteps { n: outer, left: per_row, right: run * panel.columns },
                            inner: TileSteps { n: part.len(), left: 1, right: panel.columns },
                        };
                        let begin = (row == 0 && part.start == 0).then_some(begin);
                        // SAFETY: the positions lie inside the padded copy and `to`; the caller has exclusive access.
                        unsafe { panel.multiply(&panels.data, padded, &positions, to, begin, &at) };
                    }
                }
            }
        });
    }

    /// Copies the rows that the chunk from `first_row` on reads, with zeros outside the input.
    fn copy<T: Scalar>(&self, from: &[T], padded: &mut [T], b: usize, first_row: usize) {
        let [rows, columns] = &self.windows;
        let width = columns.receptive_field(columns.n) as isize;
        let inside = |first: isize, n: usize| (-first).clamp(0, width)..(n as isize - first).clamp(0, width);
        let inside = inside(columns.first, columns.n_from);
        let numbers = inside.start as usize * self.n_from..inside.end.max(inside.start) as usize * self.n_from;
        let first_column = (columns.first + inside.start).max(0) as usize * self.n_from;
        for (i, to) in padded.chunks_exact_mut(width as usize * self.n_from).enumerate() {
            let row = rows.first + (first_row * rows.step + i) as isize;
            if row < 0 || row >= rows.n_from as isize {
                to.fill(T::zero());
                continue;
            }
            let from = &from[(b * rows.n_from + row as usize) * columns.n_from * self.n_from..];
            to[..numbers.start].fill(T::zero());
            to[numbers.clone()].copy_from_slice(&from[first_column..][..numbers.len()]);
            to[numbers.end..].fill(T::zero());
        }
    }
}
