//! Layers of encoder and decoder: layer norm, linear layers, feed-forward blocks, and the keys and values of a head.

use super::weight_file::WeightFile;
use anyhow::{Result, ensure};
use orator_nn::cpu::packed_matrix::{COLUMNS, PackedMatrix};
use orator_nn::cpu::spin_pool::parallel_each;
use orator_nn::cpu::transformer::{gelu, layer_norm, softmax};

/// Number of rows of a parallel task.
pub(super) const CHUNK: usize = 96;
/// Number of rows whose scores are in memory at the same time.
const SCORE_ROWS: usize = 48;
/// Number of weights of a column block, which one thread multiplies.
const BLOCK_WEIGHTS: usize = 256 * 1024;
/// Number of products that are summed on their own: single sums of 2048 products would round too much.
const SUM_BLOCK: usize = 128;

pub(super) struct LayerNorm {
    gamma: Vec<f32>,
    beta: Vec<f32>,
}

impl LayerNorm {
    pub(super) fn read(weights: &WeightFile, name: &str, width: usize) -> Result<Self> {
        let read = |part: &str| weights.tensor(&format!("{name}/{part}"), &[width]);
        Ok(Self { gamma: read("gamma")?, beta: read("beta")? })
    }

    /// Normalises each row of `x`.
    pub(super) fn apply(&self, x: &[f32]) -> Vec<f32> {
        let mut y = vec![0.0; x.len()];
        layer_norm(x, &self.gamma, &self.beta, &mut y);
        y
    }
}

/// A linear layer, stored as blocks of output columns.
pub(super) struct Linear {
    blocks: Vec<PackedMatrix<f32>>,
    /// Number of outputs per block; the last one may have fewer.
    block_columns: usize,
    bias: Vec<f32>,
    n_in: usize,
}

impl Linear {
    /// Packs `weight` [out, in].
    pub(super) fn new(weight: &[f32], bias: Vec<f32>) -> Self {
        let (n_in, n_out) = (weight.len() / bias.len(), bias.len());
        let block_columns = (BLOCK_WEIGHTS / n_in).max(1).next_multiple_of(4 * COLUMNS);
        let block = |first: usize| {
            let n = block_columns.min(n_out - first);
            PackedMatrix::with_block(n_in, n, SUM_BLOCK, |row, column| weight[(first + column) * n_in + row])
        };
        let blocks = (0..n_out).step_by(block_columns).map(block).collect();
        Self { blocks, block_columns, bias, n_in }
    }

    pub(super) fn read(weights: &WeightFile, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        let weight = weights.tensor(&format!("{name}/weight"), &[n_out, n_in])?;
        Ok(Self::new(&weight, weights.tensor(&format!("{name}/bias"), &[n_out])?))
    }

    /// Reads a layer whose first `width` outputs are the queries of heads of size `dim`, and divides these by the root
    /// of that size.
    pub(super) fn read_queries(
        weights: &WeightFile,
        name: &str,
        width: usize,
        n_out: usize,
        dim: usize,
    ) -> Result<Self> {
        let mut weight = weights.tensor(&format!("{name}/weight"), &[n_out, width])?;
        let mut bias = weights.tensor(&format!("{name}/bias"), &[n_out])?;
        let scale = 1.0 / (dim as f32).sqrt();
        weight[..width * width].iter_mut().chain(&mut bias[..width]).for_each(|value| *value *= scale);
        Ok(Self::new(&weight, bias))
    }

    /// Reads a convolution over three frames: `weight` [out, in, 3] as a linear layer of three consecutive frames.
    pub(super) fn read_conv(weights: &WeightFile, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        let weight = weights.tensor(&format!("{name}/weight"), &[n_out, n_in, 3])?;
        let at = |i: usize| weight[i / (3 * n_in) * 3 * n_in + i % n_in * 3 + i / n_in % 3];
        let frames_first: Vec<f32> = (0..weight.len()).map(at).collect();
        Ok(Self::new(&frames_first, weights.tensor(&format!("{name}/bias"), &[n_out])?))
    }

    pub(super) fn n_out(&self) -> usize {
        self.bias.len()
    }

    /// Weights of output `column`.
    pub(super) fn weights_of(&self, column: usize) -> impl Iterator<Item = f32> {
        let block = &self.blocks[column / self.block_columns];
        (0..self.n_in).map(move |row| block.get(row, column % self.block_columns))
    }

    /// Computes the rows of `y` [n, out], where row i depends on the `in` values of `x` from `i * stride` on. The
    /// number of outputs is a multiple of 16.
    pub(super) fn apply_to(&self, x: &[f32], stride: usize, y: &mut [f32]) {
        let n_out = self.n_out();
        y.chunks_exact_mut(n_out).for_each(|row| row.copy_from_slice(&self.bias));
        for (i, block) in self.blocks.iter().enumerate() {
            block.multiply_add(y.len() / n_out, x, stride, &mut y[i * self.block_columns..], n_out);
        }
    }

    /// Computes `x` [n, in] times the weights, plus bias: [n, out].
    pub(super) fn apply(&self, x: &[f32]) -> Vec<f32> {
        let mut y = vec![0.0; x.len() / self.n_in * self.n_out()];
        self.apply_to(x, self.n_in, &mut y);
        y
    }

    /// Equal to [`Linear::apply`], with the blocks in parallel, for few rows and any number of outputs.
    pub(super) fn apply_in_parallel(&self, x: &[f32]) -> Vec<f32> {
        let n = x.len() / self.n_in;
        let parts = parallel_each(self.blocks.iter().zip(self.bias.chunks(self.block_columns)), |_, (block, bias)| {
            let mut part = vec![0.0; n * block.width()];
            part.chunks_exact_mut(block.width()).for_each(|row| row[..bias.len()].copy_from_slice(bias));
            block.multiply_add(n, x, self.n_in, &mut part, block.width());
            part
        });
        let mut y = vec![0.0; n * self.n_out()];
        for (row, y) in y.chunks_exact_mut(self.n_out()).enumerate() {
            for (to, (part, block)) in y.chunks_mut(self.block_columns).zip(parts.iter().zip(&self.blocks)) {
                to.copy_from_slice(&part[row * block.width()..][..to.len()]);
            }
        }
        y
    }
}

/// Layer norm, linear layer, GELU and linear layer, added to the input.
pub(super) struct FeedForward {
    norm: LayerNorm,
    expand: Linear,
    reduce: Linear,
}

impl FeedForward {
    pub(super) fn read(weights: &WeightFile, name: &str, width: usize) -> Result<Self> {
        let first = format!("{name}/linear_0");
        let hidden = weights.shape(&format!("{first}/weight"))?.first().copied().unwrap_or_default();
        ensure!(
            hidden > 0 && hidden.is_multiple_of(COLUMNS),
            "{}: {first}/weight has {hidden} outputs, expected a multiple of {COLUMNS}",
            weights.path().display()
        );
        Ok(Self {
            norm: LayerNorm::read(weights, &format!("{name}/layer_norm"), width)?,
            expand: Linear::read(weights, &first, width, hidden)?,
            reduce: Linear::read(weights, &format!("{name}/linear_1"), hidden, width)?,
        })
    }

    /// Adds the block's output to each row of `x`; `apply` is one of the two functions of [`Linear`].
    pub(super) fn add_to(&self, x: &mut [f32], apply: fn(&Linear, &[f32]) -> Vec<f32>) {
        let mut hidden = apply(&self.expand, &self.norm.apply(x));
        gelu(&mut hidden);
        add(x, &apply(&self.reduce, &hidden));
    }
}

/// Adds `y` to `x`.
pub(super) fn add(x: &mut [f32], y: &[f32]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x += *y);
}

/// Keys and values of one head at all positions of the encoder.
pub(super) struct PackedHead {
    keys: PackedMatrix<f32>,
    values: PackedMatrix<f32>,
    n: usize,
}

impl PackedHead {
    /// Packs keys and values of size `dim`, which start at the columns `key` and `value` of rows of length `stride`.
    pub(super) fn new(rows: &[f32], stride: usize, key: usize, value: usize, dim: usize) -> Self {
        let n = rows.len() / stride;
        let keys = PackedMatrix::new(dim, n, |k, position| rows[position * stride + key + k]);
        let values = PackedMatrix::with_block(n, dim, SUM_BLOCK, |position, k| rows[position * stride + value + k]);
        Self { keys, values, n }
    }

    /// Adds the weighted values of each query to the rows of `context`. Rows start `strides` values apart, of queries
    /// and of `context`. If `observed` is given, it receives the scores [rows, positions].
    pub(super) fn attend(
        &self,
        queries: &[f32],
        context: &mut [f32],
        n_rows: usize,
        strides: [usize; 2],
        mut observed: Option<&mut Vec<f32>>,
    ) {
        let width = self.keys.width();
        let mut buffer = vec![0.0; SCORE_ROWS.min(n_rows) * width];
        for first in (0..n_rows).step_by(SCORE_ROWS) {
            let n = SCORE_ROWS.min(n_rows - first);
            let scores = &mut buffer[..n * width];
            scores.fill(0.0);
            self.keys.multiply_add(n, &queries[first * strides[0]..], strides[0], scores, width);
            if let Some(observed) = &mut observed {
                scores.chunks_exact(width).for_each(|row| observed.extend_from_slice(&row[..self.n]));
            }
            softmax(scores, width, self.n);
            self.values.multiply_add(n, scores, width, &mut context[first * strides[1]..], strides[1]);
        }
    }
}
