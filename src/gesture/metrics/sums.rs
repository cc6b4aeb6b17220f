//! Additive sums of all metrics over intervals: two rows of values, so that resampling intervals is adding rows.

use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;
use std::ops::AddAssign;

/// Sums over one or more intervals; `Default` is the empty sum. Costly sums (packed matrices) are separate, since they
/// are large and fewer draws are taken of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MetricSums {
    pub(crate) cheap: Vec<f64>,
    pub(crate) costly: CostlySums,
}

/// Large sums: those of a single block in f32 (half the memory; a rounding error of 6e-8 is negligible compared with
/// the sampling of blocks), added ones in f64.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum CostlySums {
    Block(Vec<f32>),
    Added(Vec<f64>),
}

/// Sums of one metric over the blocks of an interval.
pub(crate) struct BlockSums {
    n_frames: usize,
    width: usize,
    /// [n_blocks x width].
    rows: Vec<f64>,
}

impl Default for CostlySums {
    fn default() -> Self {
        Self::Added(Vec::new())
    }
}

impl CostlySums {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Block(row) => row.len(),
            Self::Added(row) => row.len(),
        }
    }

    pub(crate) fn row(&self) -> Vec<f64> {
        (0..self.len()).map(|i| self.at(i)).collect()
    }

    fn at(&self, i: usize) -> f64 {
        match self {
            Self::Block(row) => row.get(i).copied().map_or(0.0, f64::from),
            Self::Added(row) => row.get(i).copied().unwrap_or(0.0),
        }
    }
}

impl MetricSums {
    /// Converts these sums to those of a block, with the costly ones rounded to f32.
    pub fn into_block(self) -> Self {
        let costly = CostlySums::Block(self.costly.row().into_iter().map(|v| v as f32).collect());
        Self { costly, ..self }
    }
}

impl AddAssign<&Self> for MetricSums {
    fn add_assign(&mut self, other: &Self) {
        add(&mut self.cheap, &other.cheap);
        let mut costly = self.costly.row();
        add(&mut costly, &other.costly.row());
        self.costly = CostlySums::Added(costly);
    }
}

/// Adds `others` to `own`, which is extended by zeros if it is shorter.
fn add(own: &mut Vec<f64>, others: &[f64]) {
    own.resize(own.len().max(others.len()), 0.0);
    own.iter_mut().zip(others).for_each(|(own, other)| *own += other);
}

impl BlockSums {
    /// Sums of `n` blocks of `width` values, all initialised to `start`, over an interval of `n_frames`.
    pub(crate) fn new(n: usize, width: usize, n_frames: usize, start: f64) -> Self {
        Self { n_frames, width, rows: vec![start; n * width] }
    }

    pub(crate) fn n(&self) -> usize {
        self.rows.len().checked_div(self.width).unwrap_or(0)
    }

    pub(crate) fn of(&self, t: usize) -> usize {
        (t * self.n() / self.n_frames.max(1)).min(self.n().saturating_sub(1))
    }

    pub(crate) fn at(&mut self, t: usize) -> &mut [f64] {
        let block = self.of(t);
        self.row(block)
    }

    pub(crate) fn row(&mut self, block: usize) -> &mut [f64] {
        &mut self.rows[block * self.width..(block + 1) * self.width]
    }
}

/// Cheap sums of each draw [n_draws, n_cheap]. `counts` [n_draws, n_blocks] is the multiplicity of each block.
pub(crate) fn draw_cheap(blocks: &[MetricSums], counts: ArrayView2<f64>) -> Array2<f64> {
    let width = blocks.iter().map(|sums| sums.cheap.len()).max().unwrap_or(0);
    drawn(width, blocks, counts, |sums, i| sums.cheap.get(i).copied().unwrap_or(0.0))
}

/// Costly sums of each draw [n_draws, n_costly].
pub(crate) fn draw_costly(blocks: &[MetricSums], counts: ArrayView2<f64>) -> Array2<f64> {
    let width = blocks.iter().map(|sums| sums.costly.len()).max().unwrap_or(0);
    drawn(width, blocks, counts, |sums, i| sums.costly.at(i))
}

/// Columns that are processed at a time, so that the copy of them stays small.
const N_COLUMNS: usize = 1024;

fn drawn(
    width: usize,
    blocks: &[MetricSums],
    counts: ArrayView2<f64>,
    at: fn(&MetricSums, usize) -> f64,
) -> Array2<f64> {
    let mut all = Array2::zeros((counts.nrows(), width));
    all.axis_chunks_iter_mut(Axis(1), N_COLUMNS).into_par_iter().enumerate().for_each(|(i, mut all)| {
        let columns = Array2::from_shape_fn((counts.ncols(), all.ncols()), |(block, k)| {
            blocks.get(block).map_or(0.0, |sums| at(sums, i * N_COLUMNS + k))
        });
        all.assign(&counts.dot(&columns));
    });
    all
}
