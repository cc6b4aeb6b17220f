//! The gradient of a convolution's weight: for every kernel offset and channel pair a sum over all positions of the
//! batch. Tasks divide the weights, not the positions, so that no two threads add to the same value.

use super::direct_conv::ConvSizes;
use super::kernel::{MAX_ROWS, TileJob, TileSteps, panels};
use super::spin_pool::{parallel_for, parallel_map};
use super::tensor::{Scalar, SharedOutputPtr, scratch, written};
use super::winograd::{self, FilterTaps};
use rayon::prelude::*;
use std::ops::Range;

/// Number of positions per block, whose gradients are copied to contiguous memory: in position they are a power of two
/// apart, so that only few of them fit in the first-level cache.
const POSITIONS: usize = 256;
/// Number of values of an output's weights that are written together: complete cache lines.
const AT_ONCE: usize = 32;
/// Number of input channels per task.
const CHANNELS: usize = 11 * MAX_ROWS;

pub fn gradient_of_weight<T: Scalar>(s: &ConvSizes, x: &[T], grad: &[T]) -> Vec<T> {
    assert!(x.len() == s.len_in() && grad.len() == s.len_out());
    let kernel = T::kernel();
    let panels = panels(&kernel, s.n_out);
    let n_chunks = s.n_in.div_ceil(CHANNELS);
    let chunk = |chunk: usize| chunk * CHANNELS..s.n_in.min((chunk + 1) * CHANNELS);
    // For each panel and chunk of channels: [kernel offsets, channels, width of the panel].
    let sums = match FilterTaps::of(s) {
        Some(taps) => {
            let mut points: Vec<Vec<T>> = Vec::new();
            let mut n_points = 1;
            winograd::gradient_tiles(taps, s, [x, grad], |tiles| {
                let some = sums_of_tasks(&tiles.sizes, [tiles.x, tiles.grad], tiles.n_points);
                n_points = tiles.n_points;
                match points.is_empty() {
                    true => points = some,
                    false => points.iter_mut().flatten().zip(some.iter().flatten()).for_each(|(sum, v)| *sum += *v),
                }
            });
            parallel_map(panels.len() * n_chunks, |i| {
                winograd::gradients_of_taps(taps, &points[i * n_points..][..n_points], s.axes[0].stride)
            })
        }
        None => sums_of_tasks(s, [x, grad], 1),
    };
    let scatter = |gradient: SharedOutputPtr<T>, (panel, of_chunk): (usize, usize)| {
        let ((first, n_vectors), channels) = (panels[panel], chunk(of_chunk));
        let width = n_vectors * kernel.lanes;
        let kernel_offsets = sums[panel * n_chunks + of_chunk].chunks_exact(channels.len() * width);
        let kernel_offsets: Vec<&[T]> = kernel_offsets.collect();
        let n_at_once = (AT_ONCE / s.kernel_len()).max(1);
        for some in (0..channels.len()).step_by(n_at_once).map(|c| c..channels.len().min(c + n_at_once)) {
            for o in first..s.n_out.min(first + width) {
                let mut at = (o * s.n_in + channels.start + some.start) * s.kernel_len();
                for c in some.clone() {
                    for sums in &kernel_offsets {
                        // SAFETY: only this task writes the values of these channels of this output.
                        unsafe { gradient.at(at).write(sums[c * width + o - first]) };
                        at += 1;
                    }
                }
            }
        }
    };
    let parts: Vec<(usize, usize)> =
        (0..panels.len()).flat_map(|panel| (0..n_chunks).map(move |chunk| (panel, chunk))).collect();
    // SAFETY: the parts together write every value.
    unsafe {
        written(s.len_weight(), |gradient: SharedOutputPtr<T>| {
            parallel_for(parts.len(), |part| scatter(gradient, parts[part]));
        })
    }
}

/// Sums of products, [kernel offsets, channels, width of the panel], for each panel, chunk of channels and point, of
/// `n_points` inputs and gradients that follow each other in memory.
fn sums_of_tasks<T: Scalar>(s: &ConvSizes, [x, grad]: [&[T]; 2], n_points: usize) -> Vec<Vec<T>> {
    // Only runs along the second axis are contiguous in memory, so a single axis is moved there.
    let is_turned = s.axes[1].n_in == 1 && s.axes[1].kernel == 1 && s.axes[1].n_out == 1;
    let s = &if is_turned { ConvSizes { axes: [s.axes[1], s.axes[0]], ..*s } } else { *s };
    let kernel = T::kernel();
    let panels = panels(&kernel, s.n_out);
    let (padded, n_columns) = pad_channels(grad, s.n_out, kernel.lanes);
    let grad = padded.as_deref().unwrap_or(grad);
    let (n_chunks, n_rows) = (s.n_in.div_ceil(CHANNELS), s.axes[0].kernel);
    let rows = parallel_map(panels.len() * n_chunks * n_points * n_rows, |task| {
        let (row_offset, task) = (task % n_rows, task / n_rows);
        let (point, task) = (task % n_points, task / n_points);
        let (chunk, panel) = (task % n_chunks, task / n_chunks);
        let part = |n: usize| point * n / n_points..(point + 1) * n / n_points;
        let (x, grad) = (&x[part(x.len())], &grad[part(grad.len())]);
        let channels = chunk * CHANNELS..s.n_in.min((chunk + 1) * CHANNELS);
        sum_products(s, x, grad, n_columns, panels[panel], row_offset, channels)
    });
    if n_rows == 1 { rows } else { rows.chunks(n_rows).map(<[Vec<T>]>::concat).collect() }
}

/// Pads the channels with zeros to complete vectors (`None` if they are already complete); returns their number.
fn pad_channels<T: Scalar>(values: &[T], n: usize, lanes: usize) -> (Option<Vec<T>>, usize) {
    let padded = n.next_multiple_of(lanes);
    if padded == n {
        return (None, n);
    }
    let mut to = vec![T::zero(); values.len() / n * padded];
    to.par_chunks_mut(padded).zip(values.par_chunks(n)).with_min_len(256).for_each(|(to, from)| {
        to[..n].copy_from_slice(from);
    });
    (Some(to), padded)
}

/// Sums of `x * grad` over all positions of the batch for one row offset, some input channels and a panel of output
/// channels: [column offsets, channels, width of the panel].
fn sum_products<T: Scalar>(
    s: &ConvSizes,
    x: &[T],
    grad: &[T],
    n_columns: usize,
    (first, n_vectors): (usize, usize),
    row_offset: usize,
    channels: Range<usize>,
) -> Vec<T> {
    let kernel = T::kernel();
    let width = n_vectors * kernel.lanes;
    let [rows, columns] = s.axes;
    let mut sums = vec![T::zero(); columns.kernel * channels.len() * width];
    let start = sums.as_mut_ptr();
    let inside = rows.inside(row_offset);
    // A block has rows of a sample or, if a sample has one row, of samples; a row longer than a block is divided.
    let n_positions = POSITIONS.min(columns.n_out);
    let n_lines = (POSITIONS / columns.n_out).max(1);
    let x_at =
        |b: usize, row: usize| (b * rows.n_in + row * rows.stride + row_offset - rows.pad) * columns.n_in * s.n_in;
    let grad_at = |b: usize, row: usize| (b * rows.n_out + row) * columns.n_out * n_columns;
    let one_row = inside.len() == 1;
    let (samples, lines) = if one_row { (0..1, 0..s.batch) } else { (0..s.batch, inside.clone()) };
    let of_line = |b: usize, line: usize| if one_row { (line, inside.start) } else { (b, line) };
    let x_per_line = if one_row { rows.n_in } else { rows.stride } * columns.n_in * s.n_in;
    let grad_per_line = if one_row { rows.n_out } else { 1 } * columns.n_out * n_columns;
    let blocks = || (0..columns.n_out).step_by(n_positions).map(|at| at..columns.n_out.min(at + n_positions));
    scratch(n_lines * n_positions * width, |packed: &mut [T]| {
        for (b, line) in samples.flat_map(|b| lines.clone().step_by(n_lines).map(move |line| (b, line))) {
            let n = n_lines.min(lines.end - line);
            let (b, row) = of_line(b, line);
            for block in blocks() {
                for (line, packed) in packed.chunks_exact_mut(block.len() * width).take(n).enumerate() {
                    let grad = &grad[grad_at(b, row) + line * grad_per_line + first..];
                    for (position, packed) in block.clone().zip(packed.chunks_exact_mut(width)) {
                        packed.copy_from_slice(&grad[position * n_columns..][..width]);
                    }
                }
                for column_offset in 0..columns.kernel {
                    let across = columns.inside(column_offset);
                    let across = across.start.max(block.start)..across.end.min(block.end);
                    if across.is_empty() {
                        continue;
                    }
                    let x_at = x_at(b, row) + (across.start * columns.stride + column_offset - columns.pad) * s.n_in;
                    let outer = TileSteps { n, left: x_per_line, right: block.len() * width };
                    let inner = TileSteps { n: across.len(), left: columns.stride * s.n_in, right: width };
                    for channel in channels.clone().step_by(MAX_ROWS) {
                        let n_rows = MAX_ROWS.min(channels.end - channel);
                        let of = |row: usize| row.min(n_rows - 1);
                        let at = column_offset * channels.len() + channel - channels.start;
                        let to = std::array::from_fn(|row| start.wrapping_add((at + of(row)) * width));
                        let job = TileJob {
                            rows: std::array::from_fn(|row| &raw const x[x_at + channel + of(row)]),
                            from: to.map(<*mut T>::cast_const),
                            to,
                            right: &raw const packed[(across.start - block.start) * width],
                            outer,
                            inner,
                        };
                        // SAFETY: `inside` keeps all steps inside `x` and `packed`; `sums` belongs to this task.
                        unsafe { (kernel.run)(&job, n_rows, n_vectors) };
                    }
                }
            }
        }
    });
    sums
}
