//! All sums of some intervals: two rows of numbers, so that resampling intervals with replacement is adding rows.

use ndarray::{Array2, ArrayView2, Axis, s};
use std::ops::{AddAssign, Range};

/// What one interval, or many added, come to. `Default` is nothing. Costly sums stand apart, since they are large and
/// fewer draws are taken of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    pub(super) cheap: Vec<f64>,
    pub(super) costly: Vec<f64>,
}

impl Sums {
    /// Memory of these sums, bytes.
    pub fn n_bytes(&self) -> usize {
        size_of::<f64>() * (self.cheap.len() + self.costly.len())
    }
}

impl AddAssign<&Self> for Sums {
    fn add_assign(&mut self, other: &Self) {
        add(&mut self.cheap, &other.cheap);
        add(&mut self.costly, &other.costly);
    }
}

/// What is not there yet is 0.
fn add(own: &mut Vec<f64>, others: &[f64]) {
    if own.len() < others.len() {
        own.resize(others.len(), 0.0);
    }
    own.iter_mut().zip(others).for_each(|(own, other)| *own += other);
}

/// One row of cheap sums for each draw [n_draws, n_cheap]. `counts` [n_draws, n_blocks] says how often a block was
/// drawn.
pub(super) fn draw_cheap(blocks: &[Sums], counts: ArrayView2<f64>) -> Array2<f64> {
    drawn(blocks, counts, |sums| &sums.cheap)
}

/// The same of the costly sums.
pub(super) fn draw_costly(blocks: &[Sums], counts: ArrayView2<f64>) -> Array2<f64> {
    drawn(blocks, counts, |sums| &sums.costly)
}

/// Columns at a time, so that the copy stays small.
const N_COLUMNS: usize = 2048;

fn drawn(blocks: &[Sums], counts: ArrayView2<f64>, part: fn(&Sums) -> &Vec<f64>) -> Array2<f64> {
    let width = blocks.iter().map(|sums| part(sums).len()).max().unwrap_or(0);
    let mut all = Array2::zeros((counts.nrows(), width));
    for from in (0..width).step_by(N_COLUMNS) {
        let range = from..(from + N_COLUMNS).min(width);
        let columns = gather(blocks, range.clone(), part);
        all.slice_mut(s![.., range]).assign(&counts.dot(&columns));
    }
    all
}

/// Blocks as rows [n_blocks, range].
fn gather(blocks: &[Sums], range: Range<usize>, part: fn(&Sums) -> &Vec<f64>) -> Array2<f64> {
    let mut rows = Array2::zeros((blocks.len(), range.len()));
    for (sums, mut row) in blocks.iter().zip(rows.axis_iter_mut(Axis(0))) {
        if let Some(numbers) = part(sums).get(range.clone()) {
            row.iter_mut().zip(numbers).for_each(|(to, from)| *to = *from);
        }
    }
    rows
}
