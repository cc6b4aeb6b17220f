//! One step of a GRU (Cho 2014, in PyTorch's form) for some rows of a batch, forward and backward. Internally a state
//! is padded with zeros to complete vectors, and the gates have the order candidate from the input, reset, update,
//! candidate from the state: the first three use the input, the last three the state.

use crate::cpu::packed_matrix::{COLUMNS, PackedMatrix};
use crate::cpu::tensor::{Matrix, Scalar, add_product};
use crate::cpu::vectorised::{gates_backward, gates_forward};
use candle_core::Result;
use std::any::Any;
use std::sync::OnceLock;

/// Maximum number of rows of a chunk of a batch.
const CHUNK: usize = 64;
/// Batches with fewer rows are one chunk.
const MIN_DIVIDED: usize = 8;

/// Number of rows per chunk of a batch, independent of the number of threads; the last chunk may have fewer.
pub fn chunk_rows(batch: usize) -> usize {
    if batch < MIN_DIVIDED { batch.max(1) } else { batch.div_ceil(batch.div_ceil(CHUNK).next_multiple_of(2)) }
}

#[derive(Clone, Copy, Debug)]
pub struct GruSizes {
    pub input: usize,
    pub hidden: usize,
}

impl GruSizes {
    /// Length of a state including its padding.
    pub fn width(&self) -> usize {
        self.hidden.next_multiple_of(COLUMNS)
    }

    /// Number of weights: input [3 H, I], state [3 H, H], both biases [3 H]; the rows are reset, update, candidate.
    pub fn n_weights(&self) -> usize {
        3 * self.hidden * (self.input + self.hidden + 2)
    }

    /// Splits [`Self::n_weights`] values into these four tensors.
    fn parts<'a, T>(&self, weights: &'a [T]) -> [&'a [T]; 4] {
        let (of_input, rest) = weights.split_at(3 * self.hidden * self.input);
        let (of_state, rest) = rest.split_at(3 * self.hidden * self.hidden);
        let (input_bias, state_bias) = rest.split_at(3 * self.hidden);
        [of_input, of_state, input_bias, state_bias]
    }

    /// Row of an input weight for a column of the input's three gates; `None` in the padding.
    fn row_of_input(&self, column: usize) -> Option<usize> {
        let (gate, i) = (column / self.width(), column % self.width());
        (i < self.hidden).then_some([2, 0, 1][gate] * self.hidden + i)
    }

    /// Row of a state weight for a column of the state's three gates; `None` in the padding.
    fn row_of_state(&self, column: usize) -> Option<usize> {
        let (gate, i) = (column / self.width(), column % self.width());
        (i < self.hidden).then_some(gate * self.hidden + i)
    }
}

/// Weights in the layout of the forward pass.
pub struct ForwardCell<T> {
    sizes: GruSizes,
    of_input: PackedMatrix<T>,
    of_state: PackedMatrix<T>,
    /// Initial values of the four sums.
    bias: Vec<T>,
}

impl<T: Scalar> ForwardCell<T> {
    pub fn new(sizes: GruSizes, weights: &[T]) -> Self {
        let ([of_input, of_state, input_bias, state_bias], width) = (sizes.parts(weights), sizes.width());
        let GruSizes { input, hidden } = sizes;
        let or_zero = |row: Option<usize>, value: &dyn Fn(usize) -> T| row.map_or(T::zero(), value);
        let bias = (0..4 * width).map(|column| {
            let from_input = |c: usize| or_zero(sizes.row_of_input(c), &|row| input_bias[row]);
            let from_state = |c: usize| or_zero(sizes.row_of_state(c), &|row| state_bias[row]);
            match column / width {
                0 => from_input(column),
                1 | 2 => from_input(column) + from_state(column - width),
                _ => from_state(column - width),
            }
        });
        Self {
            sizes,
            bias: bias.collect(),
            of_input: PackedMatrix::new(input, 3 * width, |k, c| {
                or_zero(sizes.row_of_input(c), &|row| of_input[row * input + k])
            }),
            of_state: PackedMatrix::new(hidden, 3 * width, |k, c| {
                or_zero(sizes.row_of_state(c), &|row| of_state[row * hidden + k])
            }),
        }
    }

    /// One step for the rows of `previous`. Input rows are `stride` values apart; `gates` and `next` are overwritten.
    pub fn step(&self, x: &[T], stride: usize, previous: &[T], gates: &mut [T], next: &mut [T]) {
        let width = self.sizes.width();
        let n = previous.len() / width;
        gates.chunks_exact_mut(4 * width).for_each(|row| row.copy_from_slice(&self.bias));
        self.of_input.multiply_add(n, x, stride, gates, 4 * width);
        self.of_state.multiply_add(n, previous, width, &mut gates[width..], 4 * width);
        gates_forward(gates, previous, next, width);
    }
}

/// Weights in the layout of the backward pass.
pub struct BackwardCell<T> {
    sizes: GruSizes,
    to_input: PackedMatrix<T>,
    to_state: PackedMatrix<T>,
}

impl<T: Scalar> BackwardCell<T> {
    pub fn new(sizes: GruSizes, weights: &[T]) -> Self {
        let ([of_input, of_state, ..], GruSizes { input, hidden }) = (sizes.parts(weights), sizes);
        let depth = 3 * sizes.width();
        Self {
            sizes,
            to_input: PackedMatrix::new(depth, input, |k, c| {
                sizes.row_of_input(k).map_or(T::zero(), |row| of_input[row * input + c])
            }),
            to_state: PackedMatrix::new(depth, hidden, |k, c| {
                sizes.row_of_state(k).map_or(T::zero(), |row| of_state[row * hidden + c])
            }),
        }
    }

    /// Backpropagates one step: `grad`, the gradient of the next state, is overwritten with that of the previous
    /// state; `of_gates` is overwritten with that of the gates.
    pub fn step(&self, gates: &[T], previous: &[T], grad: &mut [T], of_gates: &mut [T]) {
        let width = self.sizes.width();
        gates_backward(gates, previous, grad, of_gates, width);
        self.to_state.multiply_add(grad.len() / width, &of_gates[width..], 4 * width, grad, width);
    }

    /// Length of a row of the input's gradient including its padding.
    pub fn input_width(&self) -> usize {
        self.to_input.width()
    }

    /// Adds the gradient of the input to rows of [`Self::input_width`], from that of the gates.
    pub fn add_input_gradient(&self, of_gates: &[T], to: &mut [T]) {
        let (width, input_width) = (self.sizes.width(), self.input_width());
        self.to_input.multiply_add(to.len() / input_width, of_gates, 4 * width, to, input_width);
    }

    /// Adds the gradients of the weights to `to`, in their order, from all rows of a chunk: gradients of the gates,
    /// inputs (rows of `input` values) and previous states.
    pub fn add_weight_gradients(&self, of_gates: &[T], inputs: &[T], previous: &[T], to: &mut [T]) {
        let (s, width) = (self.sizes, self.sizes.width());
        let GruSizes { input, hidden } = s;
        let n = of_gates.len() / (4 * width);
        let gates = |first: usize| Matrix::new(&of_gates[first..], 4 * width).transposed();
        let (to_input, rest) = to.split_at_mut(3 * hidden * input);
        let (to_state, rest) = rest.split_at_mut(3 * hidden * hidden);
        let (input_bias, state_bias) = rest.split_at_mut(3 * hidden);
        for gate in 0..3 {
            let first = gate * width;
            let of_input = [2, 0, 1][gate] * hidden * input;
            let rows = &mut to_input[of_input..][..hidden * input];
            add_product(rows, gates(first), Matrix::new(inputs, input), hidden, input, n);
            let rows = &mut to_state[gate * hidden * hidden..][..hidden * hidden];
            add_product(rows, gates(first + width), Matrix::new(previous, width), hidden, hidden, n);
        }
        for row in of_gates.chunks_exact(4 * width) {
            for gate in 0..3 {
                let add = |to: &mut [T], from: &[T]| to.iter_mut().zip(from).for_each(|(to, from)| *to += *from);
                add(&mut input_bias[[2, 0, 1][gate] * hidden..][..hidden], &row[gate * width..]);
                add(&mut state_bias[gate * hidden..][..hidden], &row[(gate + 1) * width..]);
            }
        }
    }
}

/// Sums the weight gradients of the chunks of a batch, in order.
pub fn sum_chunks<T: Scalar>(chunks: &[Vec<T>]) -> Vec<T> {
    let mut sum = chunks.first().cloned().unwrap_or_default();
    for chunk in chunks.iter().skip(1) {
        sum.iter_mut().zip(chunk).for_each(|(sum, value)| *sum += *value);
    }
    sum
}

/// Copies rows of `hidden` values into rows padded with zeros.
pub fn widen<T: Scalar>(rows: &[T], hidden: usize, to: &mut [T], width: usize) {
    for (from, to) in rows.chunks_exact(hidden).zip(to.chunks_exact_mut(width)) {
        to[..hidden].copy_from_slice(from);
    }
}

/// Values that the forward pass of an operator saves for its backward pass, per chunk of the batch; written once.
#[derive(Default)]
pub struct SavedChunks(OnceLock<Box<dyn Any + Send + Sync>>);

impl SavedChunks {
    pub fn put<T: Send + Sync + 'static>(&self, chunks: Vec<Vec<T>>) {
        let _ = self.0.set(Box::new(chunks));
    }

    /// Returns the saved values.
    ///
    /// # Errors
    /// No forward pass has saved values.
    pub fn get<T: 'static>(&self) -> Result<&[Vec<T>]> {
        match self.0.get().and_then(|chunks| chunks.downcast_ref::<Vec<Vec<T>>>()) {
            Some(chunks) => Ok(chunks),
            None => candle_core::bail!("backward was called without a forward pass"),
        }
    }
}
