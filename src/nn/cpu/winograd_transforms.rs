//! Transforms of Winograd's filtering by the method of Toom and Cook: polynomials evaluated at the points 0, 1, -1, 2,
//! (-2) and infinity. They apply to rows of columns; a vector of columns at a time.

use super::tensor::{LANES, Scalar};
use std::marker::PhantomData;

/// Outputs of a tile.
pub const TILE: usize = 4;

/// Linear map of `M` rows to `N` rows.
pub trait LinearMap<const M: usize, const N: usize> {
    const MATRIX: [[f64; M]; N];
}

/// The maps of a filter of two or three taps: of its inputs, of its taps, and of the products to the outputs.
pub struct TwoTaps;
pub struct ThreeTaps;

impl LinearMap<5, 5> for TwoTaps {
    const MATRIX: [[f64; 5]; 5] = [
        [2.0, -1.0, -2.0, 1.0, 0.0],
        [0.0, -2.0, -1.0, 1.0, 0.0],
        [0.0, 2.0, -3.0, 1.0, 0.0],
        [0.0, -1.0, 0.0, 1.0, 0.0],
        [0.0, 2.0, -1.0, -2.0, 1.0],
    ];
}

impl LinearMap<2, 5> for TwoTaps {
    const MATRIX: [[f64; 2]; 5] =
        [[0.5, 0.0], [-0.5, -0.5], [-1.0 / 6.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 3.0], [0.0, 1.0]];
}

impl LinearMap<5, TILE> for TwoTaps {
    const MATRIX: [[f64; 5]; TILE] =
        [[1.0, 1.0, 1.0, 1.0, 0.0], [0.0, 1.0, -1.0, 2.0, 0.0], [0.0, 1.0, 1.0, 4.0, 0.0], [0.0, 1.0, -1.0, 8.0, 1.0]];
}

impl LinearMap<6, 6> for ThreeTaps {
    const MATRIX: [[f64; 6]; 6] = [
        [4.0, 0.0, -5.0, 0.0, 1.0, 0.0],
        [0.0, -4.0, -4.0, 1.0, 1.0, 0.0],
        [0.0, 4.0, -4.0, -1.0, 1.0, 0.0],
        [0.0, -2.0, -1.0, 2.0, 1.0, 0.0],
        [0.0, 2.0, -1.0, -2.0, 1.0, 0.0],
        [0.0, 4.0, 0.0, -5.0, 0.0, 1.0],
    ];
}

impl LinearMap<3, 6> for ThreeTaps {
    const MATRIX: [[f64; 3]; 6] = [
        [0.25, 0.0, 0.0],
        [-1.0 / 6.0, -1.0 / 6.0, -1.0 / 6.0],
        [-1.0 / 6.0, 1.0 / 6.0, -1.0 / 6.0],
        [1.0 / 24.0, 1.0 / 12.0, 1.0 / 6.0],
        [1.0 / 24.0, -1.0 / 12.0, 1.0 / 6.0],
        [0.0, 0.0, 1.0],
    ];
}

impl LinearMap<6, TILE> for ThreeTaps {
    const MATRIX: [[f64; 6]; TILE] = [
        [1.0, 1.0, 1.0, 1.0, 1.0, 0.0],
        [0.0, 1.0, -1.0, 2.0, -2.0, 0.0],
        [0.0, 1.0, 1.0, 4.0, 4.0, 0.0],
        [0.0, 1.0, -1.0, 8.0, -8.0, 1.0],
    ];
}

/// The transposed map, which gradients pass through.
pub struct Transposed<X>(PhantomData<X>);

impl<X: LinearMap<M, N>, const M: usize, const N: usize> LinearMap<N, M> for Transposed<X> {
    const MATRIX: [[f64; N]; M] = {
        let (mut matrix, mut row) = ([[0.0; N]; M], 0);
        while row < M * N {
            matrix[row / N][row % N] = X::MATRIX[row % N][row / N];
            row += 1;
        }
        matrix
    };
}

/// Maps the rows `from` to the rows `to`, all of one length.
pub fn transform<T: Scalar, X: LinearMap<M, N>, const M: usize, const N: usize>(from: [&[T]; M], to: [&mut [T]; N]) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f")]
        fn wide<T: Scalar, X: LinearMap<M, N>, const M: usize, const N: usize>(from: [&[T]; M], to: [&mut [T]; N]) {
            body::<T, X, M, N>(from, to);
        }
        #[target_feature(enable = "avx2,fma")]
        fn half<T: Scalar, X: LinearMap<M, N>, const M: usize, const N: usize>(from: [&[T]; M], to: [&mut [T]; N]) {
            body::<T, X, M, N>(from, to);
        }
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor supports the features that the function is compiled for.
            return unsafe { wide::<T, X, M, N>(from, to) };
        }
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the processor supports the features that the function is compiled for.
            return unsafe { half::<T, X, M, N>(from, to) };
        }
    }
    body::<T, X, M, N>(from, to);
}

#[inline(always)]
fn body<T: Scalar, X: LinearMap<M, N>, const M: usize, const N: usize>(from: [&[T]; M], mut to: [&mut [T]; N]) {
    let n_columns = from[0].len();
    assert!(from.iter().all(|row| row.len() == n_columns) && to.iter().all(|row| row.len() == n_columns));
    for at in (0..n_columns).step_by(LANES) {
        let n = LANES.min(n_columns - at);
        let mut lanes = [[T::zero(); LANES]; M];
        for (lanes, from) in lanes.iter_mut().zip(from) {
            match from[at..].first_chunk() {
                Some(all) => *lanes = *all,
                None => lanes[..n].copy_from_slice(&from[at..]),
            }
        }
        for (factors, to) in X::MATRIX.iter().zip(&mut to) {
            let mut sums = [T::zero(); LANES];
            for (factor, lanes) in factors.iter().zip(&lanes).filter(|(factor, _)| **factor != 0.0) {
                let factor = T::from_f64(*factor);
                (0..LANES).for_each(|i| sums[i] += lanes[i] * factor);
            }
            match to[at..].first_chunk_mut() {
                Some(all) => *all = sums,
                None => to[at..].copy_from_slice(&sums[..n]),
            }
        }
    }
}
