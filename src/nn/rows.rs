//! Statistics over the rows of a matrix whose columns are channels, and batch norm with the leaky ReLU behind it on
//! such rows: plain memory in, plain memory out. Sums run over blocks of fixed size in one order.

use super::cpu::Real;
use rayon::prelude::*;

/// Numbers summed before the sum goes on in f64, and numbers one task takes.
const BLOCK: usize = 16 * 1024;
const TASK: usize = 128 * 1024;

/// How many values each channel has had, their mean, and the sum of their squared distances to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moments {
    pub n: f64,
    pub mean: Vec<f64>,
    pub squares: Vec<f64>,
}

impl Moments {
    /// Of rows of `n_channels`.
    pub fn of<T: Real>(values: &[T], n_channels: usize) -> Self {
        let mut all = Self::default();
        for block in values.chunks(whole_rows(BLOCK, n_channels)) {
            let n = (block.len() / n_channels) as f64;
            let mean: Vec<T> = block_sums(block, n_channels).iter().map(|s| T::from_f64(s.to_f64() / n)).collect();
            let mut squares = vec![T::zero(); n_channels];
            for row in block.chunks_exact(n_channels) {
                for ((sum, value), mean) in squares.iter_mut().zip(row).zip(&mean) {
                    let off = *value - *mean;
                    *sum += off * off;
                }
            }
            let f64s = |values: Vec<T>| values.into_iter().map(|v| v.to_f64()).collect();
            all = all.and(&Self { n, mean: f64s(mean), squares: f64s(squares) });
        }
        all
    }

    /// Those of both sets of values (Chan et al. 1979).
    pub fn and(&self, other: &Self) -> Self {
        if self.n == 0.0 {
            return other.clone();
        }
        let n = self.n + other.n;
        let apart: Vec<f64> = self.mean.iter().zip(&other.mean).map(|(a, b)| b - a).collect();
        let mean = self.mean.iter().zip(&apart).map(|(mean, apart)| mean + apart * other.n / n).collect();
        let squares = self.squares.iter().zip(&other.squares).zip(&apart);
        let squares = squares.map(|((a, b), apart)| a + b + apart * apart * self.n * other.n / n).collect();
        Self { n, mean, squares }
    }
}

/// So many numbers, but whole rows and at least one.
fn whole_rows(n: usize, n_channels: usize) -> usize {
    (n / n_channels).max(1) * n_channels
}

fn block_sums<T: Real>(block: &[T], n_channels: usize) -> Vec<T> {
    let mut sums = vec![T::zero(); n_channels];
    for row in block.chunks_exact(n_channels) {
        sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += *value);
    }
    sums
}

/// The sum of each channel.
pub fn sums<T: Real>(values: &[T], n_channels: usize) -> Vec<f64> {
    let of_task = |task: &[T]| {
        let mut sums = vec![0.0; n_channels];
        for block in task.chunks(whole_rows(BLOCK, n_channels)) {
            let of_block = block_sums(block, n_channels);
            sums.iter_mut().zip(of_block).for_each(|(sum, value)| *sum += value.to_f64());
        }
        sums
    };
    let tasks: Vec<Vec<f64>> = values.par_chunks(whole_rows(TASK, n_channels)).map(of_task).collect();
    add_up(tasks, n_channels)
}

fn add_up(tasks: Vec<Vec<f64>>, n: usize) -> Vec<f64> {
    tasks.into_iter().fold(vec![0.0; n], |mut all, of_task| {
        all.iter_mut().zip(of_task).for_each(|(sum, value)| *sum += value);
        all
    })
}

/// `y = leaky(z * scale + shift)`, a scale and a shift a channel.
pub struct Norm<T> {
    pub mean: Vec<T>,
    pub scale: Vec<T>,
    pub shift: Vec<T>,
    pub slope: T,
}

impl<T: Real> Norm<T> {
    /// `z` overwritten with the result.
    pub fn apply(&self, z: &mut [T]) {
        for row in z.chunks_exact_mut(self.scale.len()) {
            for ((z, scale), shift) in row.iter_mut().zip(&self.scale).zip(&self.shift) {
                let y = *z * *scale + *shift;
                *z = if y > T::zero() { y } else { y * self.slope };
            }
        }
    }

    /// `y` from `z`.
    pub fn forward(&self, z: &[T], y: &mut [T]) {
        for (z, y) in z.chunks_exact(self.scale.len()).zip(y.chunks_exact_mut(self.scale.len())) {
            for (((z, y), scale), shift) in z.iter().zip(y).zip(&self.scale).zip(&self.shift) {
                let value = *z * *scale + *shift;
                *y = if value > T::zero() { value } else { value * self.slope };
            }
        }
    }

    /// Sums over all rows of `g` and of `g * (z - mean)`, `g` being `grad` taken back through the activation.
    pub fn sums_of_gradient(&self, z: &[T], grad: &[T]) -> (Vec<f64>, Vec<f64>) {
        let n = self.scale.len();
        let of_task = |(z, grad): (&[T], &[T])| {
            let mut sums = vec![0.0; 2 * n];
            for (z, grad) in z.chunks(whole_rows(BLOCK, n)).zip(grad.chunks(whole_rows(BLOCK, n))) {
                let (mut plain, mut product) = (vec![T::zero(); n], vec![T::zero(); n]);
                for (z, grad) in z.chunks_exact(n).zip(grad.chunks_exact(n)) {
                    let channels = plain.iter_mut().zip(&mut product).zip(self.channels());
                    for (((plain, product), (mean, scale, shift)), (z, grad)) in channels.zip(z.iter().zip(grad)) {
                        let g = if *z * *scale + *shift > T::zero() { *grad } else { *grad * self.slope };
                        *plain += g;
                        *product += g * (*z - *mean);
                    }
                }
                sums.iter_mut().zip(plain.iter().chain(&product)).for_each(|(sum, value)| *sum += value.to_f64());
            }
            sums
        };
        let chunk = whole_rows(TASK, n);
        let tasks: Vec<Vec<f64>> = z.par_chunks(chunk).zip(grad.par_chunks(chunk)).map(of_task).collect();
        let mut plain = add_up(tasks, 2 * n);
        let product = plain.split_off(n);
        (plain, product)
    }

    /// Overwrites `z` with the gradient before the norm: `scale * g + constant + linear * (z - mean)`.
    pub fn backward(&self, z: &mut [T], grad: &[T], constant: &[T], linear: &[T]) {
        let n = self.scale.len();
        let chunk = whole_rows(TASK, n);
        z.par_chunks_mut(chunk).zip(grad.par_chunks(chunk)).for_each(|(z, grad)| {
            for (z, grad) in z.chunks_exact_mut(n).zip(grad.chunks_exact(n)) {
                let channels = self.channels().zip(constant.iter().zip(linear));
                for (((mean, scale, shift), (constant, linear)), (z, grad)) in channels.zip(z.iter_mut().zip(grad)) {
                    let g = if *z * *scale + *shift > T::zero() { *grad } else { *grad * self.slope };
                    *z = *scale * g + *constant + *linear * (*z - *mean);
                }
            }
        });
    }

    fn channels(&self) -> impl Iterator<Item = (&T, &T, &T)> {
        self.mean.iter().zip(&self.scale).zip(&self.shift).map(|((mean, scale), shift)| (mean, scale, shift))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_parts_are_those_of_the_whole() {
        let n_channels = 3;
        let values: Vec<f64> = (0..3 * 20_000).map(|i| (i as f64 * 0.37).sin() + (i % 3) as f64).collect();
        let whole = Moments::of(&values, n_channels);
        for channel in 0..n_channels {
            let own: Vec<f64> = values.iter().skip(channel).step_by(n_channels).copied().collect();
            let mean = own.iter().sum::<f64>() / own.len() as f64;
            let squares = own.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
            assert!((whole.mean[channel] - mean).abs() < 1e-12 && (whole.squares[channel] - squares).abs() < 1e-7);
            assert!((sums(&values, n_channels)[channel] - own.iter().sum::<f64>()).abs() < 1e-8);
        }
        assert_eq!(whole.n, 20_000.0);
    }
}
