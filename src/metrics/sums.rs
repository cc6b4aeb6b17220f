//! All sums of some intervals: two rows of numbers, so that resampling intervals with replacement is adding rows.

use ndarray::{Array2, ArrayView2, Axis, s};
use rayon::prelude::*;
use std::ops::{AddAssign, Range};

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

impl MetricSums {
    /// Memory of these sums, bytes.
    pub fn n_bytes(&self) -> usize {
        let costly = match &self.costly {
            CostlySums::Block(row) => size_of_val(&row[..]),
            CostlySums::Added(row) => size_of_val(&row[..]),
        };
        size_of_val(&self.cheap[..]) + costly
    }
}

impl Default for CostlySums {
    fn default() -> Self {
        Self::Added(Vec::new())
    }
}

impl CostlySums {
    pub fn len(&self) -> usize {
        match self {
            Self::Block(row) => row.len(),
            Self::Added(row) => row.len(),
        }
    }

    /// All numbers as f64.
    pub fn row(&self) -> Vec<f64> {
        self.part(0..self.len()).collect()
    }

    fn part(&self, range: Range<usize>) -> Box<dyn Iterator<Item = f64> + '_> {
        match self {
            Self::Block(row) => Box::new(row.get(range).unwrap_or_default().iter().map(|v| f64::from(*v))),
            Self::Added(row) => Box::new(row.get(range).unwrap_or_default().iter().copied()),
        }
    }
}

impl AddAssign<&Self> for MetricSums {
    fn add_assign(&mut self, other: &Self) {
        add(&mut self.cheap, other.cheap.iter().copied());
        if let CostlySums::Block(row) = &self.costly {
            self.costly = CostlySums::Added(row.iter().map(|v| f64::from(*v)).collect());
        }
        if let CostlySums::Added(row) = &mut self.costly {
            add(row, other.costly.part(0..other.costly.len()));
        }
    }
}

/// What is not there yet is 0.
fn add(own: &mut Vec<f64>, others: impl Iterator<Item = f64>) {
    for (i, other) in others.enumerate() {
        match own.get_mut(i) {
            Some(own) => *own += other,
            None => own.push(other),
        }
    }
}

impl BlockSums {
    /// `n` blocks of `width` numbers, all `start`, over an interval of `n_frames`.
    pub fn new(n: usize, width: usize, n_frames: usize, start: f64) -> Self {
        Self { n_frames, width, rows: vec![start; n * width] }
    }

    /// How many blocks.
    pub fn n(&self) -> usize {
        self.rows.len().checked_div(self.width).unwrap_or(0)
    }

    /// The block that frame `t` belongs to.
    pub fn of(&self, t: usize) -> usize {
        (t * self.n() / self.n_frames.max(1)).min(self.n().saturating_sub(1))
    }

    /// The sums of the block of frame `t`.
    pub fn at(&mut self, t: usize) -> &mut [f64] {
        let block = self.of(t);
        self.row(block)
    }

    pub fn row(&mut self, block: usize) -> &mut [f64] {
        &mut self.rows[block * self.width..(block + 1) * self.width]
    }
}

/// One row of cheap sums for each draw [n_draws, n_cheap]. `counts` [n_draws, n_blocks] says how often a block was
/// drawn.
pub(crate) fn draw_cheap(blocks: &[MetricSums], counts: ArrayView2<f64>) -> Array2<f64> {
    let width = blocks.iter().map(|sums| sums.cheap.len()).max().unwrap_or(0);
    drawn(width, blocks, counts, |sums, range| Box::new(sums.cheap.get(range).unwrap_or_default().iter().copied()))
}

/// One row of costly sums for each draw [n_draws, n_costly].
pub(crate) fn draw_costly(blocks: &[MetricSums], counts: ArrayView2<f64>) -> Array2<f64> {
    let width = blocks.iter().map(|sums| sums.costly.len()).max().unwrap_or(0);
    drawn(width, blocks, counts, |sums, range| sums.costly.part(range))
}

/// Columns at a time, so that the copy stays small.
const N_COLUMNS: usize = 1024;

type CostlyColumns = for<'a> fn(&'a MetricSums, Range<usize>) -> Box<dyn Iterator<Item = f64> + 'a>;

fn drawn(width: usize, blocks: &[MetricSums], counts: ArrayView2<f64>, part: CostlyColumns) -> Array2<f64> {
    let mut all = Array2::zeros((counts.nrows(), width));
    all.axis_chunks_iter_mut(Axis(1), N_COLUMNS).into_par_iter().enumerate().for_each(|(i, mut all)| {
        let from = i * N_COLUMNS;
        let mut columns = Array2::zeros((counts.ncols(), all.ncols()));
        for (sums, mut row) in blocks.iter().zip(columns.outer_iter_mut()) {
            row.iter_mut().zip(part(sums, from..from + all.ncols())).for_each(|(to, from)| *to = from);
        }
        all.assign(&counts.dot(&columns.slice(s![.., ..])));
    });
    all
}
