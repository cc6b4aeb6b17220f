//! Statistics over the rows of a matrix whose columns are channels, and batch norm followed by leaky ReLU on such
//! rows, on plain slices. Sums run over blocks of fixed size in a fixed order.

use super::spin_pool::{parallel_for, parallel_map};
use super::tensor::{GRAIN, LANES, Scalar, SharedOutputPtr, written};
use super::vectorised::vectorised;
use rayon::prelude::*;

/// Number of values that are summed before the sum continues in f64, and number of values per task.
const BLOCK: usize = 16 * 1024;
const TASK: usize = 128 * 1024;

/// Number of values per channel, their mean, and the sum of their squared deviations from the mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelMoments {
    pub n: f64,
    pub mean: Vec<f64>,
    pub squares: Vec<f64>,
}

impl ChannelMoments {
    pub fn measure<T: Scalar>(values: &[T], n_channels: usize) -> Self {
        let mut all = Self::default();
        for block in values.chunks(row_multiple(BLOCK, n_channels)) {
            let n = (block.len() / n_channels) as f64;
            let (mut mean, mut squares) = (vec![T::zero(); n_channels], vec![T::zero(); n_channels]);
            block_sums(block, &mut mean);
            mean.iter_mut().for_each(|sum| *sum = T::from_f64(sum.to_f64() / n));
            block_squares(block, &mean, &mut squares);
            let f64s = |values: Vec<T>| values.into_iter().map(T::to_f64).collect();
            all = all.and(&Self { n, mean: f64s(mean), squares: f64s(squares) });
        }
        all
    }

    /// Combines the moments of two sets of values (Chan et al. 1979).
    pub fn and(&self, other: &Self) -> Self {
        if self.n == 0.0 {
            return other.clone();
        }
        let n = self.n + other.n;
        let delta: Vec<f64> = self.mean.iter().zip(&other.mean).map(|(a, b)| b - a).collect();
        let mean = self.mean.iter().zip(&delta).map(|(mean, delta)| mean + delta * other.n / n).collect();
        let squares = self.squares.iter().zip(&other.squares).zip(&delta);
        let squares = squares.map(|((a, b), delta)| a + b + delta * delta * self.n * other.n / n).collect();
        Self { n, mean, squares }
    }
}

/// Returns the largest multiple of `n_channels` up to `n`, but at least `n_channels`.
fn row_multiple(n: usize, n_channels: usize) -> usize {
    (n / n_channels).max(1) * n_channels
}

vectorised!(
    /// Sums each channel over some rows.
    block_sums = block_sums_body(block: &[T], sums: &mut [T])
);

#[inline(always)]
fn block_sums_body<T: Scalar>(block: &[T], sums: &mut [T]) {
    #[inline(always)]
    fn some<T: Scalar, const N: usize>(block: &[T], n_channels: usize, first: usize) -> [T; N] {
        let mut sums = [T::zero(); N];
        for row in rows::<T, N>(block, n_channels, first) {
            (0..N).for_each(|i| sums[i] += row[i]);
        }
        sums
    }
    let (n_channels, mut first) = (sums.len(), 0);
    let (wide, rest) = sums.as_chunks_mut::<LANES>();
    for sums in wide {
        *sums = some(block, n_channels, first);
        first += LANES;
    }
    for sum in rest {
        [*sum] = some(block, n_channels, first);
        first += 1;
    }
}

vectorised!(
    /// Sums each channel's squared deviations from `mean` over some rows.
    block_squares = block_squares_body(block: &[T], mean: &[T], squares: &mut [T])
);

#[inline(always)]
fn block_squares_body<T: Scalar>(block: &[T], mean: &[T], squares: &mut [T]) {
    let (n_channels, mut first) = (mean.len(), 0);
    let (wide, rest) = squares.as_chunks_mut::<LANES>();
    for (sums, mean) in wide.iter_mut().zip(mean.as_chunks().0) {
        *sums = sums_of_squares(block, n_channels, first, mean);
        first += LANES;
    }
    for (sum, mean) in rest.iter_mut().zip(&mean[first..]) {
        [*sum] = sums_of_squares(block, n_channels, first, &[*mean]);
        first += 1;
    }
}

/// Iterates over `N` channels from `first` on of every row.
#[inline(always)]
fn rows<T, const N: usize>(block: &[T], n_channels: usize, first: usize) -> impl Iterator<Item = &[T; N]> {
    block.chunks_exact(n_channels).filter_map(move |row| row.get(first..)?.first_chunk())
}

#[inline(always)]
fn sums_of_squares<T: Scalar, const N: usize>(block: &[T], n_channels: usize, first: usize, mean: &[T; N]) -> [T; N] {
    let mut sums = [T::zero(); N];
    for row in rows::<T, N>(block, n_channels, first) {
        for i in 0..N {
            let off = row[i] - mean[i];
            sums[i] += off * off;
        }
    }
    sums
}

pub fn sums<T: Scalar>(values: &[T], n_channels: usize) -> Vec<f64> {
    let sum_task = |task: &[T]| {
        let (mut sums, mut block_total) = (vec![0.0; n_channels], vec![T::zero(); n_channels]);
        for block in task.chunks(row_multiple(BLOCK, n_channels)) {
            block_sums(block, &mut block_total);
            sums.iter_mut().zip(&block_total).for_each(|(sum, value)| *sum += value.to_f64());
        }
        sums
    };
    let tasks: Vec<Vec<f64>> = values.par_chunks(row_multiple(TASK, n_channels)).map(sum_task).collect();
    add_up(tasks, n_channels)
}

fn add_up(tasks: Vec<Vec<f64>>, n: usize) -> Vec<f64> {
    tasks.into_iter().fold(vec![0.0; n], |mut all, part| {
        all.iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
        all
    })
}

/// `y = leaky(z * scale + shift)`, with a scale and a shift per channel.
pub struct Norm<T> {
    pub mean: Vec<T>,
    pub scale: Vec<T>,
    pub shift: Vec<T>,
    pub slope: T,
}

impl<T: Scalar> Norm<T> {
    /// Overwrites `z` with the result.
    pub fn apply(&self, z: &mut [T]) {
        apply_rows(self, z);
    }

    /// Number of values of the rows of `z` that one task processes.
    fn chunk(&self) -> usize {
        row_multiple(GRAIN, self.scale.len())
    }

    /// Overwrites `z` with the result, on all threads.
    pub fn apply_parallel(&self, z: &mut [T]) {
        let (n, start, chunk) = (z.len(), SharedOutputPtr::new(z), self.chunk());
        // SAFETY: the chunks of `z` are disjoint.
        parallel_for(n.div_ceil(chunk), |i| unsafe {
            self.apply(std::slice::from_raw_parts_mut(start.at(i * chunk), chunk.min(n - i * chunk)));
        });
    }

    /// Returns the result for `z` without modifying it, on all threads.
    pub fn forward(&self, z: &[T]) -> Vec<T> {
        let chunk = self.chunk();
        // SAFETY: every chunk of the result is written by one task, as many values as it reads.
        unsafe {
            written(z.len(), |y: SharedOutputPtr<T>| {
                parallel_for(z.len().div_ceil(chunk), |i| {
                    let z = &z[i * chunk..z.len().min((i + 1) * chunk)];
                    let y = std::slice::from_raw_parts_mut(y.at(i * chunk), z.len());
                    y.copy_from_slice(z);
                    self.apply(y);
                });
            })
        }
    }

    #[inline(always)]
    fn result<const N: usize>(&self, z: &[T; N], scale: &[T; N], shift: &[T; N]) -> [T; N] {
        let mut y = [T::zero(); N];
        for i in 0..N {
            let value = z[i] * scale[i] + shift[i];
            y[i] = if value > T::zero() { value } else { value * self.slope };
        }
        y
    }

    #[inline(always)]
    fn before_activation<const N: usize>(&self, z: &[T; N], grad: &[T; N], scale: &[T; N], shift: &[T; N]) -> [T; N] {
        let mut before_activation = [T::zero(); N];
        for i in 0..N {
            before_activation[i] = if z[i] * scale[i] + shift[i] > T::zero() { grad[i] } else { grad[i] * self.slope };
        }
        before_activation
    }

    /// Sums over all rows of `g` and of `g * (z - mean)`, where `g` is `grad` before the activation.
    pub fn sums_of_gradient(&self, z: &[T], grad: &[T]) -> (Vec<f64>, Vec<f64>) {
        let n = self.scale.len();
        let sum_task = |(z, grad): (&[T], &[T])| {
            let mut sums = vec![0.0; 2 * n];
            for (z, grad) in z.chunks(row_multiple(BLOCK, n)).zip(grad.chunks(row_multiple(BLOCK, n))) {
                sum_gradient(self, z, grad, &mut sums);
            }
            sums
        };
        let chunk = row_multiple(TASK, n);
        let tasks: Vec<_> = z.chunks(chunk).zip(grad.chunks(chunk)).collect();
        let mut plain = add_up(parallel_map(tasks.len(), |task| sum_task(tasks[task])), 2 * n);
        let product = plain.split_off(n);
        (plain, product)
    }

    /// Adds both sums of `N` channels over a block to `sums`.
    #[inline(always)]
    fn add_sums<const N: usize>(&self, z: &[T], grad: &[T], first: usize, sums: &mut [f64]) {
        let n = self.scale.len();
        let some = |values: &[T]| std::array::from_fn::<T, N, _>(|i| values[first + i]);
        let (mean, scale, shift) = (some(&self.mean), some(&self.scale), some(&self.shift));
        let (mut plain, mut product) = ([T::zero(); N], [T::zero(); N]);
        for (z, grad) in rows::<T, N>(z, n, first).zip(rows::<T, N>(grad, n, first)) {
            let g = self.before_activation(z, grad, &scale, &shift);
            for i in 0..N {
                plain[i] += g[i];
                product[i] += g[i] * (z[i] - mean[i]);
            }
        }
        for i in 0..N {
            sums[first + i] += plain[i].to_f64();
            sums[n + first + i] += product[i].to_f64();
        }
    }

    /// Overwrites `z` with the gradient before the norm: `scale * g + constant + linear * (z - mean)`.
    pub fn backward(&self, z: &mut [T], grad: &[T], constant: &[T], linear: &[T]) {
        let n = self.scale.len();
        // constant + linear * (z - mean) as offset + linear * z.
        let offset: Vec<T> =
            constant.iter().zip(linear).zip(&self.mean).map(|((c, l), mean)| *c - *l * *mean).collect();
        let chunk = row_multiple(TASK, n);
        let channels = |i: usize| (self.scale[i], self.shift[i], offset[i], linear[i]);
        let n_wide = n / LANES;
        let coefficients = NormCoefficients {
            wide: (0..n_wide).map(|i| NormCoefficient::new(|lane| channels(i * LANES + lane))).collect(),
            rest: (n_wide * LANES..n).map(|i| NormCoefficient::new(|_| channels(i))).collect(),
        };
        let (n_all, start) = (z.len(), SharedOutputPtr::new(z));
        parallel_for(n_all.div_ceil(chunk), |task| {
            let part = task * chunk..n_all.min((task + 1) * chunk);
            // SAFETY: the tasks' parts of `z` are disjoint.
            let z = unsafe { std::slice::from_raw_parts_mut(start.at(part.start), part.len()) };
            backward_rows(self, &coefficients, z, &grad[part]);
        });
    }
}

vectorised!(
    /// [`Norm::apply`].
    apply_rows = apply_rows_body(norm: &Norm<T>, z: &mut [T])
);

#[inline(always)]
fn apply_rows_body<T: Scalar>(norm: &Norm<T>, z: &mut [T]) {
    let (scale, scale_rest) = norm.scale.as_chunks::<LANES>();
    let (shift, shift_rest) = norm.shift.as_chunks::<LANES>();
    for row in z.chunks_exact_mut(norm.scale.len()) {
        let (wide, rest) = row.as_chunks_mut::<LANES>();
        for ((z, scale), shift) in wide.iter_mut().zip(scale).zip(shift) {
            *z = norm.result(z, scale, shift);
        }
        for ((z, scale), shift) in rest.iter_mut().zip(scale_rest).zip(shift_rest) {
            [*z] = norm.result(&[*z], &[*scale], &[*shift]);
        }
    }
}

vectorised!(
    /// Adds the sums of [`Norm::sums_of_gradient`] over some rows: first all of `g`, then all of the product.
    sum_gradient = sum_gradient_body(norm: &Norm<T>, z: &[T], grad: &[T], sums: &mut [f64])
);

#[inline(always)]
fn sum_gradient_body<T: Scalar>(norm: &Norm<T>, z: &[T], grad: &[T], sums: &mut [f64]) {
    let (n, mut first) = (norm.scale.len(), 0);
    while first + LANES <= n {
        norm.add_sums::<LANES>(z, grad, first, sums);
        first += LANES;
    }
    (first..n).for_each(|first| norm.add_sums::<1>(z, grad, first, sums));
}

vectorised!(
    /// [`Norm::backward`] of some rows.
    backward_rows = backward_rows_body(norm: &Norm<T>, coefficients: &NormCoefficients<T>, z: &mut [T], grad: &[T])
);

#[inline(always)]
fn backward_rows_body<T: Scalar>(norm: &Norm<T>, coefficients: &NormCoefficients<T>, z: &mut [T], grad: &[T]) {
    let n = norm.scale.len();
    for (z, grad) in z.chunks_exact_mut(n).zip(grad.chunks_exact(n)) {
        let ((z, z_rest), (grad, grad_rest)) = (z.as_chunks_mut(), grad.as_chunks());
        for ((z, grad), coefficient) in z.iter_mut().zip(grad).zip(&coefficients.wide) {
            *z = coefficient.gradient(norm, z, grad);
        }
        for ((z, grad), coefficient) in z_rest.iter_mut().zip(grad_rest).zip(&coefficients.rest) {
            [*z] = coefficient.gradient(norm, &[*z], &[*grad]);
        }
    }
}

/// Coefficients of a [`Norm::backward`]: groups of `LANES` channels, then the remaining ones.
pub struct NormCoefficients<T> {
    wide: Vec<NormCoefficient<T, LANES>>,
    rest: Vec<NormCoefficient<T, 1>>,
}

/// Coefficients that convert `z` of `N` channels to its gradient.
pub struct NormCoefficient<T, const N: usize> {
    scale: [T; N],
    shift: [T; N],
    offset: [T; N],
    linear: [T; N],
}

impl<T: Scalar, const N: usize> NormCoefficient<T, N> {
    fn new(of: impl Fn(usize) -> (T, T, T, T)) -> Self {
        use std::array::from_fn;
        Self {
            scale: from_fn(|i| of(i).0),
            shift: from_fn(|i| of(i).1),
            offset: from_fn(|i| of(i).2),
            linear: from_fn(|i| of(i).3),
        }
    }

    #[inline(always)]
    fn gradient(&self, norm: &Norm<T>, z: &[T; N], grad: &[T; N]) -> [T; N] {
        let g = norm.before_activation(z, grad, &self.scale, &self.shift);
        let mut gradient = [T::zero(); N];
        for i in 0..N {
            gradient[i] = self.scale[i] * g[i] + self.offset[i] + self.linear[i] * z[i];
        }
        gradient
    }
}
