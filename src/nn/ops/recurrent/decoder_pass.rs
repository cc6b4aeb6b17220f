//! The decoder's loop over one chunk of a batch, forward and backward.

use super::cell::{BackwardCell, ForwardCell, GruSizes, widen};
use crate::cpu::packed_matrix::PackedMatrix;
use crate::cpu::tensor::{Matrix, Scalar, add_product};
use crate::cpu::vectorised::{Attended, DropMask, attend, attend_backward, drop_out};
use candle_core::Result;

pub struct DecoderSizes {
    pub batch: usize,
    pub n_previous: usize,
    pub n_steps: usize,
    /// Sizes of pose and state.
    pub cell: GruSizes,
    pub n_keys: Vec<usize>,
    /// Number of rows per chunk.
    pub chunk: usize,
    /// For each of the B * N decoder steps, whether its input is the true pose of the preceding step instead of the
    /// computed one; empty without true poses.
    pub taken: Vec<bool>,
}

impl DecoderSizes {
    /// Number of vectors that the output is computed from: the decoder's state and one context per sequence.
    pub fn n_read(&self) -> usize {
        1 + self.n_keys.len()
    }

    pub fn all_keys(&self) -> usize {
        self.n_keys.iter().sum()
    }

    /// Length of a row of the starts: previous poses, true poses (if any) and state.
    pub fn start_len(&self) -> usize {
        let n_true = if self.taken.is_empty() { 0 } else { self.n_steps };
        (self.n_previous + n_true) * self.cell.input + self.cell.hidden
    }

    /// Position of the pose that row `row` of the batch reads at `step`, in its row of the starts; `None` if the row
    /// reads the pose that was computed at the preceding step. The first decoder step reads the last previous pose
    /// again; the true poses follow it, so that later steps read theirs one position before their own.
    fn given_pose(&self, row: usize, step: usize) -> Option<usize> {
        let is_taken = |decoder_step: usize| self.taken.get(row * self.n_steps + decoder_step) == Some(&true);
        let position = if step < self.n_previous { step } else { step - 1 };
        (step <= self.n_previous || is_taken(step - self.n_previous)).then_some(position * self.cell.input)
    }

    fn n_weights(&self) -> usize {
        self.cell.n_weights() + self.cell.input * (self.n_read() * self.cell.hidden + 1)
    }

    pub fn check(&self, start: &[usize], keys: &[usize], n_weights: usize) -> Result<()> {
        let fits = start == [self.batch, self.start_len()]
            && keys == [self.batch, self.all_keys(), self.cell.hidden]
            && n_weights == self.n_weights()
            && !self.n_keys.contains(&0)
            && self.batch * self.n_previous * self.n_steps * self.cell.input * self.cell.hidden > 0;
        if !fits {
            candle_core::bail!("decoder: start {start:?} and keys {keys:?} do not fit {n_weights} weights");
        }
        Ok(())
    }
}

/// Lengths of the values that the forward pass of a chunk of `n` rows saves, in order: gates of every step; states of
/// every step and the initial one; attention weights, and inputs of the output layer, of every step with an output.
fn saved_len(s: &DecoderSizes, n: usize) -> [usize; 4] {
    let (width, steps) = (s.cell.width(), s.n_previous + s.n_steps);
    [steps * n * 4 * width, (steps + 1) * n * width, s.n_steps * n * s.all_keys(), s.n_steps * n * s.n_read() * width]
}

/// Column of the output weights for a position in the padded input of the output layer; `None` in the padding.
fn output_column(s: &DecoderSizes, position: usize) -> Option<usize> {
    let (part, i) = (position / s.cell.width(), position % s.cell.width());
    (i < s.cell.hidden).then_some(part * s.cell.hidden + i)
}

/// Position in the dropout mask of the first input of the output layer of row `row` at step `step`.
fn mask_position(s: &DecoderSizes, row: usize, step: usize) -> usize {
    (row * s.n_steps + step) * s.n_read() * s.cell.width()
}

/// First key and number of keys of each sequence.
fn sequences(s: &DecoderSizes) -> impl Iterator<Item = (usize, usize)> {
    let firsts = s.n_keys.iter().scan(0, |first, n| {
        *first += n;
        Some(*first - n)
    });
    firsts.zip(s.n_keys.iter().copied())
}

/// Copies the poses that the rows from `begin` on read at `step` to `to`, from their starts and computed poses `y`.
fn copy_inputs<T: Scalar>(s: &DecoderSizes, (begin, step): (usize, usize), start: &[T], y: &[T], to: &mut [T]) {
    let pose = s.cell.input;
    let rows = start.chunks_exact(s.start_len()).zip(y.chunks_exact(s.n_steps * pose));
    for (row, (to, (start, y))) in to.chunks_exact_mut(pose).zip(rows).enumerate() {
        let from = match s.given_pose(begin + row, step) {
            Some(at) => &start[at..],
            None => &y[(step - s.n_previous - 1) * pose..],
        };
        to.copy_from_slice(&from[..pose]);
    }
}

/// Keys of a chunk, padded to complete vectors.
fn wide_keys<T: Scalar>(s: &DecoderSizes, keys: &[T]) -> Vec<T> {
    let mut wide = vec![T::zero(); keys.len() / s.cell.hidden * s.cell.width()];
    widen(keys, s.cell.hidden, &mut wide, s.cell.width());
    wide
}

/// Weights in the layout of the forward pass.
pub struct ForwardDecoder<'a, T> {
    sizes: &'a DecoderSizes,
    mask: Option<DropMask>,
    cell: ForwardCell<T>,
    output: PackedMatrix<T>,
    bias: Vec<T>,
}

impl<'a, T: Scalar> ForwardDecoder<'a, T> {
    pub fn new(sizes: &'a DecoderSizes, mask: Option<DropMask>, weights: &[T]) -> Self {
        let s = sizes;
        let (of_cell, rest) = weights.split_at(s.cell.n_weights());
        let n_read = s.n_read() * s.cell.hidden;
        let (weight, bias) = rest.split_at(s.cell.input * n_read);
        let element =
            |k: usize, pose: usize| output_column(s, k).map_or(T::zero(), |column| weight[pose * n_read + column]);
        let output = PackedMatrix::new(s.n_read() * s.cell.width(), s.cell.input, element);
        let mut wide = bias.to_vec();
        wide.resize(output.width(), T::zero());
        Self { sizes, mask, cell: ForwardCell::new(s.cell, of_cell), output, bias: wide }
    }

    /// Computes the poses `y` of the rows from `begin` on; returns the values that the backward pass requires.
    pub fn run(&self, begin: usize, start: &[T], keys: &[T], y: &mut [T]) -> Vec<T> {
        let s = self.sizes;
        let (pose, hidden, width) = (s.cell.input, s.cell.hidden, s.cell.width());
        let (start_len, y_len) = (s.start_len(), s.n_steps * pose);
        let n = start.len() / start_len;
        let keys = wide_keys(s, keys);
        let lens = saved_len(s, n);
        let mut saved = vec![T::zero(); lens.iter().sum()];
        let (gates, rest) = saved.split_at_mut(lens[0]);
        let (states, rest) = rest.split_at_mut(lens[1]);
        let (weights, read) = rest.split_at_mut(lens[2]);
        for (row, state) in start.chunks_exact(start_len).zip(states.chunks_exact_mut(width)) {
            state[..hidden].copy_from_slice(&row[start_len - hidden..]);
        }
        let read_len = s.n_read() * width;
        let mut inputs = vec![T::zero(); n * pose];
        let mut out = vec![T::zero(); n * self.output.width()];
        for (step, gates) in gates.chunks_exact_mut(n * 4 * width).enumerate() {
            let (previous, next) = states[step * n * width..][..2 * n * width].split_at_mut(n * width);
            copy_inputs(s, (begin, step), start, y, &mut inputs);
            self.cell.step(&inputs, pose, previous, gates, next);
            let Some(step) = step.checked_sub(s.n_previous) else { continue };
            let weights = &mut weights[step * n * s.all_keys()..][..n * s.all_keys()];
            let read = &mut read[step * n * read_len..][..n * read_len];
            let rows = read.chunks_exact_mut(read_len).zip(weights.chunks_exact_mut(s.all_keys()));
            let of_rows = next.chunks_exact(width).zip(keys.chunks_exact(s.all_keys() * width));
            for (row, ((read, weights), (state, keys))) in rows.zip(of_rows).enumerate() {
                let (own, contexts) = read.split_at_mut(width);
                own.copy_from_slice(state);
                for ((first, n), context) in sequences(s).zip(contexts.chunks_exact_mut(width)) {
                    attend(state, &keys[first * width..][..n * width], &mut weights[first..][..n], context);
                }
                if let Some(mask) = self.mask {
                    drop_out(read, mask_position(s, begin + row, step), mask);
                }
            }
            out.chunks_exact_mut(self.bias.len()).for_each(|row| row.copy_from_slice(&self.bias));
            self.output.multiply_add(n, read, read_len, &mut out, self.bias.len());
            for (y, out) in y.chunks_exact_mut(y_len).zip(out.chunks_exact(self.bias.len())) {
                y[step * pose..][..pose].copy_from_slice(&out[..pose]);
            }
        }
        saved
    }
}

/// Weights in the layout of the backward pass.
pub struct BackwardDecoder<'a, T> {
    sizes: &'a DecoderSizes,
    mask: Option<DropMask>,
    cell: BackwardCell<T>,
    /// Maps the gradient of a pose to that of the output layer's input.
    to_read: PackedMatrix<T>,
}

impl<'a, T: Scalar> BackwardDecoder<'a, T> {
    pub fn new(sizes: &'a DecoderSizes, mask: Option<DropMask>, weights: &[T]) -> Self {
        let s = sizes;
        let (of_cell, rest) = weights.split_at(s.cell.n_weights());
        let n_read = s.n_read() * s.cell.hidden;
        let element = |pose: usize, c: usize| output_column(s, c).map_or(T::zero(), |c| rest[pose * n_read + c]);
        let to_read = PackedMatrix::new(s.cell.input, s.n_read() * s.cell.width(), element);
        Self { sizes, mask, cell: BackwardCell::new(s.cell, of_cell), to_read }
    }

    /// Adds the gradients of starts and keys of the rows from `begin` on to `of_start` and `of_keys`; returns those of
    /// the weights. The tuples are starts and keys, and poses with their gradients. The gradient of an input goes to
    /// the pose that was read: a computed pose that a true one replaced gets none.
    pub fn run(
        &self,
        begin: usize,
        (start, keys): (&[T], &[T]),
        (y, grad): (&[T], &[T]),
        saved: &[T],
        of_start: &mut [T],
        of_keys: &mut [T],
    ) -> Vec<T> {
        let s = self.sizes;
        let (pose, hidden, width) = (s.cell.input, s.cell.hidden, s.cell.width());
        let (start_len, y_len, read_len) = (s.start_len(), s.n_steps * pose, s.n_read() * width);
        let n = start.len() / start_len;
        let keys = wide_keys(s, keys);
        let mut of_wide_keys = vec![T::zero(); keys.len()];
        let lens = saved_len(s, n);
        let (gates, rest) = saved.split_at(lens[0]);
        let (states, rest) = rest.split_at(lens[1]);
        let (weights, read) = rest.split_at(lens[2]);

        let n_all = s.n_previous + s.n_steps;
        let mut of_gates = vec![T::zero(); lens[0]];
        let mut inputs = vec![T::zero(); n_all * n * pose];
        let mut of_poses = vec![T::zero(); s.n_steps * n * pose];
        let mut of_y = grad.to_vec();
        let mut of_state = vec![T::zero(); n * width];
        let mut of_read = vec![T::zero(); n * read_len];
        let input_width = self.cell.input_width();
        let mut of_input = vec![T::zero(); n * input_width];
        for step in (0..n_all).rev() {
            let gates = &gates[step * n * 4 * width..][..n * 4 * width];
            let (previous, next) = states[step * n * width..][..2 * n * width].split_at(n * width);
            if let Some(step) = step.checked_sub(s.n_previous) {
                of_read.fill(T::zero());
                self.to_read.multiply_add(n, &of_y[step * pose..], y_len, &mut of_read, read_len);
                let of_poses = &mut of_poses[step * n * pose..][..n * pose];
                for (to, of_y) in of_poses.chunks_exact_mut(pose).zip(of_y.chunks_exact(y_len)) {
                    to.copy_from_slice(&of_y[step * pose..][..pose]);
                }
                let weights = &weights[step * n * s.all_keys()..][..n * s.all_keys()];
                for row in 0..n {
                    let of_read = &mut of_read[row * read_len..][..read_len];
                    if let Some(mask) = self.mask {
                        drop_out(of_read, mask_position(s, begin + row, step), mask);
                    }
                    let (own, contexts) = of_read.split_at(width);
                    let of_state = &mut of_state[row * width..][..width];
                    of_state.iter_mut().zip(own).for_each(|(to, from)| *to += *from);
                    for ((first, n), grad) in sequences(s).zip(contexts.chunks_exact(width)) {
                        let first = row * s.all_keys() + first;
                        let attended = Attended {
                            state: &next[row * width..][..width],
                            keys: &keys[first * width..][..n * width],
                            weights: &weights[first..][..n],
                            grad,
                        };
                        attend_backward(attended, of_state, &mut of_wide_keys[first * width..][..n * width]);
                    }
                }
            }
            let of_gates = &mut of_gates[step * n * 4 * width..][..n * 4 * width];
            self.cell.step(gates, previous, &mut of_state, of_gates);
            of_input.fill(T::zero());
            self.cell.add_input_gradient(of_gates, &mut of_input);
            copy_inputs(s, (begin, step), start, y, &mut inputs[step * n * pose..][..n * pose]);
            let of_rows = of_start.chunks_exact_mut(start_len).zip(of_y.chunks_exact_mut(y_len));
            for (row, ((of_start, of_y), from)) in of_rows.zip(of_input.chunks_exact(input_width)).enumerate() {
                let to = match s.given_pose(begin + row, step) {
                    Some(at) => &mut of_start[at..],
                    None => &mut of_y[(step - s.n_previous - 1) * pose..],
                };
                to[..pose].iter_mut().zip(from).for_each(|(to, from)| *to += *from);
            }
        }
        for (to, from) in of_start.chunks_exact_mut(start_len).zip(of_state.chunks_exact(width)) {
            to[start_len - hidden..].copy_from_slice(&from[..hidden]);
        }
        for (to, from) in of_keys.chunks_exact_mut(hidden).zip(of_wide_keys.chunks_exact(width)) {
            to.copy_from_slice(&from[..hidden]);
        }
        self.weight_gradients(&of_gates, &inputs, &states[..gates.len() / 4], &of_poses, read)
    }

    fn weight_gradients(&self, of_gates: &[T], inputs: &[T], states: &[T], of_poses: &[T], read: &[T]) -> Vec<T> {
        let s = self.sizes;
        let (pose, hidden, width, read_len) =
            (s.cell.input, s.cell.hidden, s.cell.width(), s.n_read() * s.cell.width());
        let n_read = s.n_read() * hidden;
        let mut gradients = vec![T::zero(); s.cell.n_weights() + pose * (n_read + 1)];
        let (of_cell, rest) = gradients.split_at_mut(s.cell.n_weights());
        self.cell.add_weight_gradients(of_gates, inputs, states, of_cell);
        let (of_weight, of_bias) = rest.split_at_mut(pose * n_read);
        let mut wide = vec![T::zero(); pose * read_len];
        let of_rows = Matrix::new(of_poses, pose).transposed();
        add_product(&mut wide, of_rows, Matrix::new(read, read_len), pose, read_len, of_poses.len() / pose);
        for (to, from) in of_weight.chunks_exact_mut(hidden).zip(wide.chunks_exact(width)) {
            to.copy_from_slice(&from[..hidden]);
        }
        for row in of_poses.chunks_exact(pose) {
            of_bias.iter_mut().zip(row).for_each(|(to, from)| *to += *from);
        }
        gradients
    }
}
