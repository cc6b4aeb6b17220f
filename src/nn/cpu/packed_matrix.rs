//! A matrix in the memory order in which the tiles of `kernel` read it, for repeated multiplication: a recurrent layer
//! multiplies its weights with a few rows at every step of a sequence, too few to pack them every time.

use super::kernel::{MAX_ROWS, TileJob, TileKernel, TileSteps, panels};
use super::tensor::Scalar;

/// Columns are padded with zeros to a multiple of this number.
pub const COLUMNS: usize = 16;

/// Matrix [depth, columns], stored as consecutive panels of columns.
pub struct PackedMatrix<T> {
    data: Vec<T>,
    /// First column and number of vectors of each panel.
    panels: Vec<(usize, usize)>,
    kernel: TileKernel<T>,
    depth: usize,
    width: usize,
}

impl<T: Scalar> PackedMatrix<T> {
    /// Packs a matrix; `element(row, column)` returns its elements.
    pub fn new(depth: usize, n_columns: usize, element: impl Fn(usize, usize) -> T) -> Self {
        let (kernel, width) = (T::kernel(), n_columns.next_multiple_of(COLUMNS));
        let panels = panels(&kernel, width);
        let mut data = vec![T::zero(); depth * width];
        for &(first, n_vectors) in &panels {
            let n = n_vectors * kernel.lanes;
            let inside = n.min(n_columns.saturating_sub(first));
            for (row, to) in data[depth * first..][..depth * n].chunks_exact_mut(n).enumerate() {
                to[..inside].iter_mut().enumerate().for_each(|(i, to)| *to = element(row, first + i));
            }
        }
        Self { data, panels, kernel, depth, width }
    }

    /// Number of columns, including the padding.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Adds the products of `n_rows` rows of `left` with the matrix to the rows of `to`, which have at least `width`
    /// values. Successive rows start `left_stride` and `to_stride` values apart.
    pub fn multiply_add(&self, n_rows: usize, left: &[T], left_stride: usize, to: &mut [T], to_stride: usize) {
        if n_rows == 0 || self.depth == 0 {
            return;
        }
        assert!(
            (n_rows - 1) * left_stride + self.depth <= left.len()
                && (n_rows - 1) * to_stride + self.width <= to.len()
                && (self.width <= to_stride || n_rows == 1),
            "strides {left_stride} and {to_stride} do not fit a matrix of {} x {}",
            self.depth,
            self.width
        );
        let (left, to) = (left.as_ptr(), to.as_mut_ptr());
        let none = TileSteps { n: 1, left: 0, right: 0 };
        for &(first, n_vectors) in &self.panels {
            let columns = n_vectors * self.kernel.lanes;
            let right = self.data[self.depth * first..].as_ptr();
            for row in (0..n_rows).step_by(MAX_ROWS) {
                let n = MAX_ROWS.min(n_rows - row);
                let to = std::array::from_fn(|i| to.wrapping_add((row + i.min(n - 1)) * to_stride + first));
                let job = TileJob {
                    rows: std::array::from_fn(|i| left.wrapping_add((row + i.min(n - 1)) * left_stride)),
                    from: to.map(<*mut T>::cast_const),
                    to,
                    right,
                    outer: none,
                    inner: TileSteps { n: self.depth, left: 1, right: columns },
                };
                // SAFETY: the assert bounds the addresses of `left` and `to`; the panel holds `depth` rows of its columns.
                unsafe { (self.kernel.run)(&job, n, n_vectors) };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_added() {
        let element = |row: usize, column: usize| (row * 100 + column) as f64;
        for (depth, n_columns, n_rows) in [(5, 150, 13), (1, 3, 1), (7, 16, 6), (3, 65, 2)] {
            let matrix = PackedMatrix::new(depth, n_columns, element);
            let (left_stride, to_stride) = (depth + 2, matrix.width() + 3);
            let left: Vec<f64> = (0..n_rows * left_stride).map(|i| (i % 7) as f64).collect();
            let mut to = vec![1.0; n_rows * to_stride];
            matrix.multiply_add(n_rows, &left, left_stride, &mut to, to_stride);
            for (row, to) in to.chunks_exact(to_stride).enumerate() {
                for (column, to) in to.iter().enumerate() {
                    let product = |k: usize| left[row * left_stride + k] * element(k, column);
                    let is_inside = column < n_columns;
                    assert_eq!(*to, 1.0 + if is_inside { (0..depth).map(product).sum() } else { 0.0 });
                }
            }
        }
    }
}
