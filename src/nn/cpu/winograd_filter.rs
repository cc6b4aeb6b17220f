//! Transforms of Winograd's filtering: values of polynomials at the points 0, 1, -1, 2, (-2) and infinity. They apply to
//! rows of columns, a vector of columns at a time.

use super::tensor::{LANES, Scalar};
use std::ops::{Add, Mul, Sub};

/// Outputs of a tile.
pub const TILE: usize = 4;

/// Transforms of a filter; those of gradients are transposes of the others.
pub trait WinogradFilter<const TAPS: usize, const POINTS: usize> {
    fn inputs<T: Scalar>(rows: [Lanes<T>; POINTS]) -> [Lanes<T>; POINTS];

    fn taps<T: Scalar>(taps: [Lanes<T>; TAPS]) -> [Lanes<T>; POINTS];

    /// Maps the products to the outputs.
    fn outputs<T: Scalar>(products: [Lanes<T>; POINTS]) -> [Lanes<T>; TILE];

    fn gradients_of_outputs<T: Scalar>(rows: [Lanes<T>; TILE]) -> [Lanes<T>; POINTS];

    fn gradients_of_taps<T: Scalar>(points: [Lanes<T>; POINTS]) -> [Lanes<T>; TAPS];
}

pub struct TwoTaps;
pub struct ThreeTaps;

impl WinogradFilter<2, 5> for TwoTaps {
    #[inline(always)]
    fn inputs<T: Scalar>([a, b, c, d, e]: [Lanes<T>; 5]) -> [Lanes<T>; 5] {
        let (near, far) = (d - b, d - c);
        [(a - c) * 2.0 + near, far - b * 2.0, far + (b - c) * 2.0, near, e - c - near * 2.0]
    }

    #[inline(always)]
    fn taps<T: Scalar>([a, b]: [Lanes<T>; 2]) -> [Lanes<T>; 5] {
        [a * 0.5, (a + b) * -0.5, (b - a) * (1.0 / 6.0), a * (1.0 / 6.0) + b * (1.0 / 3.0), b]
    }

    #[inline(always)]
    fn outputs<T: Scalar>([a, b, c, d, e]: [Lanes<T>; 5]) -> [Lanes<T>; TILE] {
        let (even, odd) = (b + c, b - c);
        [a + even + d, odd + d * 2.0, even + d * 4.0, odd + d * 8.0 + e]
    }

    #[inline(always)]
    fn gradients_of_outputs<T: Scalar>([a, b, c, d]: [Lanes<T>; TILE]) -> [Lanes<T>; 5] {
        let (even, odd) = (a + c, b + d);
        [a, even + odd, even - odd, a + c * 4.0 + (b + d * 4.0) * 2.0, d]
    }

    #[inline(always)]
    fn gradients_of_taps<T: Scalar>([a, b, c, d, e]: [Lanes<T>; 5]) -> [Lanes<T>; 2] {
        [(a - b) * 0.5 + (d - c) * (1.0 / 6.0), c * (1.0 / 6.0) + d * (1.0 / 3.0) - b * 0.5 + e]
    }
}

impl WinogradFilter<3, 6> for ThreeTaps {
    #[inline(always)]
    fn inputs<T: Scalar>([a, b, c, d, e, f]: [Lanes<T>; 6]) -> [Lanes<T>; 6] {
        let (even, odd, half_even, half_odd) = (e - c * 4.0, d - b * 4.0, e - c, (d - b) * 2.0);
        let (first, last) = (a * 4.0 - c * 5.0 + e, b * 4.0 - d * 5.0 + f);
        [first, even + odd, even - odd, half_even + half_odd, half_even - half_odd, last]
    }

    #[inline(always)]
    fn taps<T: Scalar>([a, b, c]: [Lanes<T>; 3]) -> [Lanes<T>; 6] {
        let (near_even, near_odd) = ((a + c) * (-1.0 / 6.0), b * (1.0 / 6.0));
        let (far_even, far_odd) = (a * (1.0 / 24.0) + c * (1.0 / 6.0), b * (1.0 / 12.0));
        [a * 0.25, near_even - near_odd, near_even + near_odd, far_even + far_odd, far_even - far_odd, c]
    }

    #[inline(always)]
    fn outputs<T: Scalar>([a, b, c, d, e, f]: [Lanes<T>; 6]) -> [Lanes<T>; TILE] {
        let (near_even, far_even, near_odd, far_odd) = (b + c, d + e, b - c, d - e);
        let (second, third) = (near_odd + far_odd * 2.0, near_even + far_even * 4.0);
        [a + near_even + far_even, second, third, near_odd + far_odd * 8.0 + f]
    }

    #[inline(always)]
    fn gradients_of_outputs<T: Scalar>([a, b, c, d]: [Lanes<T>; TILE]) -> [Lanes<T>; 6] {
        let (even, odd, far_even, far_odd) = (a + c, b + d, a + c * 4.0, (b + d * 4.0) * 2.0);
        [a, even + odd, even - odd, far_even + far_odd, far_even - far_odd, d]
    }

    #[inline(always)]
    fn gradients_of_taps<T: Scalar>([a, b, c, d, e, f]: [Lanes<T>; 6]) -> [Lanes<T>; 3] {
        let (near, far) = ((b + c) * (1.0 / 6.0), (d + e) * (1.0 / 24.0));
        [a * 0.25 - near + far, (c - b) * (1.0 / 6.0) + (d - e) * (1.0 / 12.0), far * 4.0 - near + f]
    }
}

/// A vector of columns.
#[derive(Clone, Copy)]
pub struct Lanes<T>([T; LANES]);

macro_rules! operator {
    ($trait:ident, $method:ident) => {
        impl<T: Scalar> $trait for Lanes<T> {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                (0..LANES).for_each(|i| self.0[i] = self.0[i].$method(other.0[i]));
                self
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);

impl<T: Scalar> Mul<f64> for Lanes<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(mut self, factor: f64) -> Self {
        let factor = T::from_f64(factor);
        self.0.iter_mut().for_each(|value| *value *= factor);
        self
    }
}

/// Maps the rows `from` to the rows `to`, all of one length, by `map`.
pub fn transform<T: Scalar, const M: usize, const N: usize>(
    from: [&[T]; M],
    to: [&mut [T]; N],
    map: impl Fn([Lanes<T>; M]) -> [Lanes<T>; N],
) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f")]
        fn wide<T: Scalar, const M: usize, const N: usize>(
            from: [&[T]; M],
            to: [&mut [T]; N],
            map: impl Fn([Lanes<T>; M]) -> [Lanes<T>; N],
        ) {
            by_lanes(from, to, map);
        }
        #[target_feature(enable = "avx2,fma")]
        fn half<T: Scalar, const M: usize, const N: usize>(
            from: [&[T]; M],
            to: [&mut [T]; N],
            map: impl Fn([Lanes<T>; M]) -> [Lanes<T>; N],
        ) {
            by_lanes(from, to, map);
        }
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor supports the features that the function is compiled for.
            return unsafe { wide(from, to, map) };
        }
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the processor supports the features that the function is compiled for.
            return unsafe { half(from, to, map) };
        }
    }
    by_lanes(from, to, map);
}

#[inline(always)]
fn by_lanes<T: Scalar, const M: usize, const N: usize>(
    from: [&[T]; M],
    mut to: [&mut [T]; N],
    map: impl Fn([Lanes<T>; M]) -> [Lanes<T>; N],
) {
    let n_columns = from[0].len();
    assert!(from.iter().all(|row| row.len() == n_columns) && to.iter().all(|row| row.len() == n_columns));
    let n_complete = n_columns / LANES * LANES;
    for at in (0..n_complete).step_by(LANES) {
        let mut lanes = [Lanes([T::zero(); LANES]); M];
        for (lanes, from) in lanes.iter_mut().zip(from) {
            lanes.0.copy_from_slice(&from[at..at + LANES]);
        }
        for (lanes, to) in map(lanes).iter().zip(&mut to) {
            to[at..at + LANES].copy_from_slice(&lanes.0);
        }
    }
    if n_complete < n_columns {
        let mut lanes = [Lanes([T::zero(); LANES]); M];
        for (lanes, from) in lanes.iter_mut().zip(from) {
            lanes.0[..n_columns - n_complete].copy_from_slice(&from[n_complete..]);
        }
        for (lanes, to) in map(lanes).iter().zip(&mut to) {
            to[n_complete..].copy_from_slice(&lanes.0[..n_columns - n_complete]);
        }
    }
}
