//! All sums of some intervals: two rows of numbers, so that resampling intervals with replacement is adding rows.

use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;
use std::ops::AddAssign;

/// What one interval, or many added, come to. `Default` is nothing. Costly sums (packed matrices) stand apart, since
/// they are large and fewer draws are taken of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MetricSums {
    pub(crate) cheap: Vec<f64>,
    pub(crate) costly: CostlySums,
}

/// Large sums: of one block in f32 (half the memory; the rounding of 6e-8 is nothing beside drawing blocks), of
/// anything added in f64.
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

    /// All numbers as f64.
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
    /// These sums as one block's, the costly ones rounded to f32.
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

/// What is not there yet is 0.
fn add(own: &mut Vec<f64>, others: &[f64]) {
    own.resize(own.len().max(others.len()), 0.0);
    own.iter_mut().zip(others).for_each(|(own, other)| *own += other);
}

impl BlockSums {
    /// `n` blocks of `width` numbers, all `start`, over an interval of `n_frames`.
    pub(crate) fn new(n: usize, width: usize, n_frames: usize, start: f64) -> Self {
        Self { n_frames, width, rows: vec![start; n * width] }
    }

    /// How many blocks.
    pub(crate) fn n(&self) -> usize {
        self.rows.len().checked_div(self.width).unwrap_or(0)
    }

    /// The block that frame `t` belongs to.
    pub(crate) fn of(&self, t: usize) -> usize {
        (t * self.n() / self.n_frames.max(1)).min(self.n().saturating_sub(1))
    }

    /// The sums of the block of frame `t`.
    pub(crate) fn at(&mut self, t: usize) -> &mut [f64] {
        let block = self.of(t);
        self.row(block)
    }

    pub(crate) fn row(&mut self, block: usize) -> &mut [f64] {
        &mut self.rows[block * self.width..(block + 1) * self.width]
    }
}

/// One row of cheap sums for each draw [n_draws, n_cheap]. `counts` [n_draws, n_blocks] says how often a block was
/// drawn.
pub(crate) fn draw_cheap(blocks: &[MetricSums], counts: ArrayView2<f64>) -> Array2<f64> {
    let width = blocks.iter().map(|sums| sums.cheap.len()).max().unwrap_or(0);
    drawn(width, blocks, counts, |sums, i| sums.cheap.get(i).copied().unwrap_or(0.0))
}

/// One row of costly sums for each draw [n_draws, n_costly].
pub(crate) fn draw_costly(blocks: &[MetricSums], counts: ArrayView2<f64>) -> Array2<f64> {
    let width = blocks.iter().map(|sums| sums.costly.len()).max().unwrap_or(0);
    drawn(width, blocks, counts, |sums, i| sums.costly.at(i))
}

/// Columns at a time, so that the copy stays small.
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
