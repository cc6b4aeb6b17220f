//! Weights of a convolution laid out as the tiles of `kernel` read them, and their products with the places of a
//! padded copy.

use super::cpu::{Real, Start};
use super::kernel::{Job, MOST_ROWS, Steps, panels};
use rayon::prelude::*;

/// Weights in the order in which tiles want them: panel after panel of columns, in each one row a step of the sum.
pub struct Panels<T> {
    pub data: Vec<T>,
    pub panels: Vec<Panel>,
}

/// Some columns of weights.
pub struct Panel {
    /// Where its data begins, its first column, and how many of its columns there are; the rest of its width is zero.
    start: usize,
    first: usize,
    n: usize,
    n_vectors: usize,
    /// Its width.
    pub columns: usize,
}

impl<T: Real> Panels<T> {
    /// The weight of column c and step k is `weight[c * per_column + offsets[k]]`.
    pub fn pack(weight: &[T], n_columns: usize, per_column: usize, offsets: &[usize]) -> Self {
        let kernel = T::kernel();
        let mut start = 0;
        let panels = panels(&kernel, n_columns).into_iter().map(|(first, n_vectors)| {
            let columns = n_vectors * kernel.lanes;
            let panel = Panel { start, first, n: columns.min(n_columns - first), n_vectors, columns };
            start += columns * offsets.len();
            panel
        });
        let panels: Vec<Panel> = panels.collect();
        let mut data = vec![T::zero(); start];
        let mut rest = &mut data[..];
        for panel in &panels {
            let (of_panel, later) = rest.split_at_mut(panel.columns * offsets.len());
            rest = later;
            let weight = &weight[panel.first * per_column..];
            of_panel.par_chunks_mut(panel.columns).zip(offsets).with_min_len(256).for_each(|(row, offset)| {
                let of_column = weight[*offset..].iter().step_by(per_column);
                row.iter_mut().take(panel.n).zip(of_column).for_each(|(to, from)| *to = *from);
            });
        }
        Self { data, panels }
    }
}

impl Panel {
    /// Adds the products of one block of steps to the sums at every place.
    ///
    /// # Safety
    /// Places lie inside `left` (with the block's reach) and `to`, which no other thread writes to there.
    pub unsafe fn multiply<T: Real>(
        &self,
        right: &[T],
        left: &[T],
        places: &[(usize, usize)],
        to: Start<T>,
        block: &Block,
    ) {
        let kernel = T::kernel();
        let right = right[self.start + block.right..].as_ptr();
        for tile in places.chunks(MOST_ROWS) {
            let of = |row: usize| tile[row.min(tile.len() - 1)];
            let mut job = Job {
                rows: std::array::from_fn(|row| left.as_ptr().wrapping_add(of(row).0 + block.left)),
                // SAFETY: the caller's.
                to: std::array::from_fn(|row| unsafe { to.at(of(row).1 + self.first) }),
                right,
                outer: block.outer,
                inner: block.inner,
            };
            // SAFETY: the caller's; where the panel is wider than its columns, sums are kept aside meanwhile.
            unsafe {
                if self.n == self.columns {
                    (kernel.run)(&job, tile.len(), self.n_vectors);
                    continue;
                }
                let mut aside = [[T::zero(); 64]; MOST_ROWS];
                let places = job.to;
                for (aside, place) in aside.iter_mut().zip(&places).take(tile.len()) {
                    aside.as_mut_ptr().copy_from_nonoverlapping(*place, self.n);
                }
                job.to = aside.each_mut().map(|row| row.as_mut_ptr());
                (kernel.run)(&job, tile.len(), self.n_vectors);
                for (aside, place) in aside.iter().zip(&places).take(tile.len()) {
                    place.copy_from_nonoverlapping(aside.as_ptr(), self.n);
                }
            }
        }
    }
}

/// Steps of a sum, as a part of all.
pub struct Block {
    pub left: usize,
    pub right: usize,
    pub outer: Steps,
    pub inner: Steps,
}
