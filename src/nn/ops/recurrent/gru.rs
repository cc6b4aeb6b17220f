//! A GRU layer over a complete sequence, in one direction or both, with backpropagation through time, as one operator,
//! which avoids the overhead of separate operators per step. Chunks of the batch are processed in parallel; results do
//! not depend on the number of threads.

use super::cell::{BackwardCell, ForwardCell, GruSizes, SavedChunks, chunk_rows, sum_chunks, widen};
use crate::Mode;
use crate::cpu::spin_pool::parallel_each;
use crate::cpu::tensor::Scalar;
use crate::cpu::vectorised::{DropMask, drop_out};
use crate::ops::operator::{CpuOperator, CustomOperator, Gradients, Operand};
use crate::params::{Init, Params};
use candle_core::{Result, Shape, Tensor};
use rand::Rng;

/// A layer with its weights, named as in PyTorch: `<name>.weight_ih_l0` [3 H, I], `.weight_hh_l0` [3 H, H],
/// `.bias_ih_l0` and `.bias_hh_l0` [3 H], with `_reverse` for the reverse direction; rows are reset, update, candidate.
pub struct Gru {
    /// Four tensors per direction.
    weights: Vec<Tensor>,
    hidden: usize,
}

impl Gru {
    /// Creates layer number `layer` (part of the tensor names) with `n` = sizes of [input, state]. Initial values are
    /// uniform in +-1 / sqrt(H), as in PyTorch.
    pub fn new(params: &mut Params, name: &str, n: [usize; 2], layer: usize, bidirectional: bool) -> Result<Self> {
        let [input, hidden] = n;
        let init = Init::Uniform(1.0 / (hidden as f64).sqrt());
        let mut weights = Vec::new();
        for suffix in if bidirectional { &["", "_reverse"][..] } else { &[""] } {
            let mut add = |kind: &str, shape: &[usize]| -> Result<()> {
                weights.push(params.trainable(&format!("{name}.{kind}_l{layer}{suffix}"), shape, init)?);
                Ok(())
            };
            add("weight_ih", &[3 * hidden, input])?;
            add("weight_hh", &[3 * hidden, hidden])?;
            add("bias_ih", &[3 * hidden])?;
            add("bias_hh", &[3 * hidden])?;
        }
        Ok(Self { weights, hidden })
    }

    /// All states of a sequence [B, T, I], from zeros: [B, T, directions * H]; training applies dropout with rate `p`.
    pub fn forward(&self, x: &Tensor, p: f64, mode: &mut Mode) -> Result<Tensor> {
        self.run(x, false, drop_mask(p, mode))
    }

    /// Returns the output of the last step [B, directions * H]; the reverse direction has read only that step.
    pub fn last(&self, x: &Tensor) -> Result<Tensor> {
        self.run(x, true, None)
    }

    /// Weights as one flat tensor, for operators that contain this layer.
    pub fn flat_weights(&self) -> Result<Tensor> {
        Tensor::cat(&self.weights.iter().map(Tensor::flatten_all).collect::<Result<Vec<_>>>()?, 0)
    }

    /// Returns the state [B, H] of a unidirectional layer after reading a sequence [B, T, I] from `state` [B, H] on.
    pub fn state_after(&self, x: &Tensor, state: &Tensor) -> Result<Tensor> {
        let options = GruOptions { n_directions: 1, last: true, mask: None };
        gru(x, &state.unsqueeze(0)?, &self.flat_weights()?, options)
    }

    fn run(&self, x: &Tensor, last: bool, mask: Option<DropMask>) -> Result<Tensor> {
        let n_directions = self.weights.len() / 4;
        let first = Tensor::zeros((n_directions, x.dim(0)?, self.hidden), x.dtype(), x.device())?;
        gru(x, &first, &self.flat_weights()?, GruOptions { n_directions, last, mask })
    }
}

/// Draws the mask of a dropout in training; `None` if nothing is dropped.
pub fn drop_mask(p: f64, mode: &mut Mode) -> Option<DropMask> {
    match mode {
        Mode::Train(rng) if p > 0.0 => Some(DropMask::new(rng.random(), p)),
        _ => None,
    }
}

#[derive(Clone, Copy, Debug)]
pub struct GruOptions {
    /// 1: forward; 2: forward and backward in time, concatenated in the result.
    pub n_directions: usize,
    /// Return only the result of the last step, for which the backward direction makes one step.
    pub last: bool,
    /// Dropout of the result.
    pub mask: Option<DropMask>,
}

/// Returns the states of a GRU over `x` [B, T, I] from the `first` states [directions, B, H] on, with the concatenated
/// `weights` of the directions: [B, T, directions * H], or [B, directions * H] with `last`.
pub fn gru(x: &Tensor, first: &Tensor, weights: &Tensor, options: GruOptions) -> Result<Tensor> {
    let saves = x.track_op() || first.track_op() || weights.track_op();
    let op = GruOp { options, saves, saved: SavedChunks::default() };
    x.contiguous()?.apply_op3(&first.contiguous()?, weights, CustomOperator(op))
}

struct GruOp {
    options: GruOptions,
    saves: bool,
    saved: SavedChunks,
}

struct PassSizes {
    batch: usize,
    n_steps: usize,
    cell: GruSizes,
    /// Number of rows per chunk.
    chunk: usize,
    /// Number of values per row of the result.
    row: usize,
}

impl GruOp {
    fn sizes(&self, x: &[usize], first: &[usize], n_weights: usize) -> Result<PassSizes> {
        let GruOptions { n_directions, last, .. } = self.options;
        if let (&[batch, n_steps, input], &[directions, b, hidden]) = (x, first) {
            let cell = GruSizes { input, hidden };
            let fits = (directions, b, n_weights) == (n_directions, batch, n_directions * cell.n_weights());
            if fits && batch * n_steps * input * hidden > 0 {
                let row = if last { 1 } else { n_steps } * directions * hidden;
                return Ok(PassSizes { batch, n_steps, cell, chunk: chunk_rows(batch), row });
            }
        }
        candle_core::bail!("gru: input {x:?} does not fit initial states {first:?} and {n_weights} weights")
    }

    fn steps(&self, direction: usize, s: &PassSizes) -> usize {
        if self.options.last && direction == 1 { 1 } else { s.n_steps }
    }

    fn time(direction: usize, k: usize, s: &PassSizes) -> usize {
        if direction == 1 { s.n_steps - 1 - k } else { k }
    }

    /// Position of the output of step `k` in a row of the result; `None` for steps without output.
    fn position(&self, direction: usize, k: usize, s: &PassSizes) -> Option<usize> {
        let GruOptions { n_directions, last, .. } = self.options;
        let time = Self::time(direction, k, s);
        let at = |time: usize| (time * n_directions + direction) * s.cell.hidden;
        if last { (time == s.n_steps - 1).then(|| at(0)) } else { Some(at(time)) }
    }

    /// Numbers of values saved for a direction of `n` rows: gates of every step; states of every step and the initial.
    fn saved_len(&self, direction: usize, n: usize, s: &PassSizes) -> [usize; 2] {
        let (steps, width) = (self.steps(direction, s), s.cell.width());
        [steps * n * 4 * width, (steps + 1) * n * width]
    }
}

impl CpuOperator for GruOp {
    const NAME: &'static str = "gru";

    fn forward<T: Scalar>(&self, [x, first, weights]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let s = &self.sizes(x.dims, first.dims, weights.values.len())?;
        let (hidden, width, x_row) = (s.cell.hidden, s.cell.width(), s.n_steps * s.cell.input);
        let cells: Vec<ForwardCell<T>> =
            weights.values.chunks_exact(s.cell.n_weights()).map(|weights| ForwardCell::new(s.cell, weights)).collect();
        let mut y = vec![T::zero(); s.batch * s.row];
        let saved = parallel_each(y.chunks_mut(s.chunk * s.row), |chunk, y| {
            let (n, begin) = (y.len() / s.row, chunk * s.chunk);
            let x = &x.values[begin * x_row..][..n * x_row];
            let mut saved = vec![T::zero(); (0..cells.len()).flat_map(|d| self.saved_len(d, n, s)).sum()];
            let mut rest = &mut saved[..];
            for (direction, cell) in cells.iter().enumerate() {
                let [n_gates, n_states] = self.saved_len(direction, n, s);
                let (gates, after) = std::mem::take(&mut rest).split_at_mut(n_gates);
                let (states, after) = after.split_at_mut(n_states);
                rest = after;
                let of_chunk = &first.values[(direction * s.batch + begin) * hidden..][..n * hidden];
                widen(of_chunk, hidden, &mut states[..n * width], width);
                for (k, gates) in gates.chunks_exact_mut(n * 4 * width).enumerate() {
                    let x = &x[Self::time(direction, k, s) * s.cell.input..];
                    let (previous, next) = states[k * n * width..][..2 * n * width].split_at_mut(n * width);
                    cell.step(x, x_row, previous, gates, next);
                    let Some(position) = self.position(direction, k, s) else { continue };
                    for (y, state) in y.chunks_exact_mut(s.row).zip(next.chunks_exact(width)) {
                        y[position..][..hidden].copy_from_slice(&state[..hidden]);
                    }
                }
            }
            if let Some(mask) = self.options.mask {
                drop_out(y, begin * s.row, mask);
            }
            if self.saves { saved } else { Vec::new() }
        });
        if self.saves {
            self.saved.put(saved);
        }
        let n_out = self.options.n_directions * hidden;
        let all = Shape::from((s.batch, s.n_steps, n_out));
        Ok((y, if self.options.last { Shape::from((s.batch, n_out)) } else { all }))
    }

    fn backward<T: Scalar>(&self, [x, first, weights]: [Operand<T>; 3], _: &[T], grad: &[T]) -> Gradients<T> {
        let s = &self.sizes(x.dims, first.dims, weights.values.len())?;
        let saved = self.saved.get::<T>()?;
        let (hidden, width, input) = (s.cell.hidden, s.cell.width(), s.cell.input);
        let (x_row, n_directions) = (s.n_steps * input, self.options.n_directions);
        let cells: Vec<BackwardCell<T>> =
            weights.values.chunks_exact(s.cell.n_weights()).map(|weights| BackwardCell::new(s.cell, weights)).collect();
        let mut of_x = vec![T::zero(); if x.tracked { x.values.len() } else { 0 }];
        let mut none = saved.iter().map(|_| <&mut [T]>::default());
        let chunks: Vec<&mut [T]> =
            if x.tracked { of_x.chunks_mut(s.chunk * x_row).collect() } else { none.by_ref().collect() };
        let gradients = parallel_each(chunks.into_iter().zip(saved), |chunk, (of_x, saved)| {
            let begin = chunk * s.chunk;
            let n = s.chunk.min(s.batch - begin);
            let x = &x.values[begin * x_row..][..n * x_row];
            let mut grad = grad[begin * s.row..][..n * s.row].to_vec();
            if let Some(mask) = self.options.mask {
                drop_out(&mut grad, begin * s.row, mask);
            }
            let mut of_weights = vec![T::zero(); weights.values.len()];
            let mut of_first = Vec::with_capacity(n_directions * n * hidden);
            let mut rest = &saved[..];
            for (direction, cell) in cells.iter().enumerate() {
                let [n_gates, n_states] = self.saved_len(direction, n, s);
                let (gates, after) = rest.split_at(n_gates);
                let (states, after) = after.split_at(n_states);
                rest = after;
                let mut of_gates = vec![T::zero(); n_gates];
                let mut inputs = vec![T::zero(); self.steps(direction, s) * n * input];
                let mut of_state = vec![T::zero(); n * width];
                let mut of_input = vec![T::zero(); n * cell.input_width()];
                let steps = gates.chunks_exact(n * 4 * width).zip(of_gates.chunks_exact_mut(n * 4 * width));
                for (k, ((gates, of_gates), inputs)) in steps.zip(inputs.chunks_exact_mut(n * input)).enumerate().rev()
                {
                    if let Some(position) = self.position(direction, k, s) {
                        for (to, grad) in of_state.chunks_exact_mut(width).zip(grad.chunks_exact(s.row)) {
                            to.iter_mut().zip(&grad[position..][..hidden]).for_each(|(to, grad)| *to += *grad);
                        }
                    }
                    cell.step(gates, &states[k * n * width..][..n * width], &mut of_state, of_gates);
                    let at = Self::time(direction, k, s) * input;
                    for (to, x) in inputs.chunks_exact_mut(input).zip(x.chunks_exact(x_row)) {
                        to.copy_from_slice(&x[at..][..input]);
                    }
                    if of_x.is_empty() {
                        continue;
                    }
                    of_input.fill(T::zero());
                    cell.add_input_gradient(of_gates, &mut of_input);
                    for (to, of_input) in of_x.chunks_exact_mut(x_row).zip(of_input.chunks_exact(cell.input_width())) {
                        to[at..][..input].iter_mut().zip(of_input).for_each(|(to, from)| *to += *from);
                    }
                }
                let of_cell = &mut of_weights[direction * s.cell.n_weights()..][..s.cell.n_weights()];
                cell.add_weight_gradients(&of_gates, &inputs, &states[..gates.len() / 4], of_cell);
                of_state.chunks_exact(width).for_each(|row| of_first.extend_from_slice(&row[..hidden]));
            }
            (of_weights, of_first)
        });
        let (of_weights, of_chunks): (Vec<_>, Vec<_>) = gradients.into_iter().unzip();
        let of_first = first.tracked.then(|| {
            let part = |direction: usize, chunk: &Vec<T>| {
                let n = chunk.len() / n_directions;
                chunk[direction * n..][..n].to_vec()
            };
            let parts = (0..n_directions).flat_map(|d| of_chunks.iter().map(move |chunk| part(d, chunk)));
            parts.flatten().collect()
        });
        Ok([x.tracked.then_some(of_x), of_first, weights.tracked.then(|| sum_chunks(&of_weights))])
    }
}
