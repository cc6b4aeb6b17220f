//! Operations on sequences in plain slices: linear interpolation of frames with its gradient, and transposition
//! between channels first and channels last. Every value is computed by one thread in a fixed order.

use super::spin_pool::parallel_for;
use super::tensor::{Scalar, SharedOutputPtr, written};

/// Side of the square blocks of a transposition, which fit in the cache.
const BLOCK: usize = 32;

/// Linear interpolation of frames: frame i of the result is `a + share * (b - a)` for frames a and b of the input.
#[derive(Clone, Debug)]
pub struct FrameInterpolation {
    pub n_in: usize,
    /// First frame, second frame and the weight of the second, for each frame of the result.
    pub of: Vec<(usize, usize, f64)>,
}

impl FrameInterpolation {
    pub fn n_out(&self) -> usize {
        self.of.len()
    }

    /// Interpolates `x` [B, `n_in`, C] to [B, `n_out`, C], plus `skip` of that shape if given.
    pub fn mix<T: Scalar>(&self, x: &[T], skip: Option<&[T]>, n_channels: usize) -> Vec<T> {
        let (of_x, of_y) = (self.n_in * n_channels, self.n_out() * n_channels);
        let batch = x.len() / of_x;
        assert!(batch * of_x == x.len() && skip.is_none_or(|skip| skip.len() == batch * of_y));
        assert!(self.of.iter().all(|(a, b, _)| *a.max(b) < self.n_in));
        // SAFETY: every sample writes all of its own frames.
        unsafe {
            written(batch * of_y, |start: SharedOutputPtr<T>| {
                parallel_for(batch, |sample| {
                    let x = &x[sample * of_x..][..of_x];
                    for (i, (a, b, share)) in self.of.iter().enumerate() {
                        let at = sample * of_y + i * n_channels;
                        let (a, b) = (&x[a * n_channels..][..n_channels], &x[b * n_channels..][..n_channels]);
                        let skip = skip.map(|skip| &skip[at..][..n_channels]);
                        let share = T::from_f64(*share);
                        for c in 0..n_channels {
                            let mixed = a[c] + (b[c] - a[c]) * share;
                            start.at(at + c).write(skip.map_or(mixed, |skip| mixed + skip[c]));
                        }
                    }
                });
            })
        }
    }

    /// Computes the gradient of the input from that of the result.
    pub fn gradient<T: Scalar>(&self, grad: &[T], n_channels: usize) -> Vec<T> {
        let (of_x, of_y) = (self.n_in * n_channels, self.n_out() * n_channels);
        let batch = grad.len() / of_y;
        // SAFETY: every sample initialises all of its own frames with zeros before it adds to them.
        unsafe {
            written(batch * of_x, |start: SharedOutputPtr<T>| {
                parallel_for(batch, |sample| {
                    let to = start.at(sample * of_x);
                    (0..of_x).for_each(|i| to.add(i).write(T::zero()));
                    let to = std::slice::from_raw_parts_mut(to, of_x);
                    for (i, (a, b, share)) in self.of.iter().enumerate() {
                        let grad = &grad[sample * of_y + i * n_channels..][..n_channels];
                        for (frame, share) in [(a, 1.0 - share), (b, *share)] {
                            let share = T::from_f64(share);
                            let to = &mut to[frame * n_channels..][..n_channels];
                            to.iter_mut().zip(grad).for_each(|(to, grad)| *to += *grad * share);
                        }
                    }
                });
            })
        }
    }
}

/// Transposes [batch, rows, columns] to [batch, columns, rows].
pub fn transpose<T: Scalar>(x: &[T], rows: usize, columns: usize) -> Vec<T> {
    let n = rows * columns;
    let (batch, blocks) = (x.len() / n, columns.div_ceil(BLOCK));
    assert!(batch * n == x.len());
    // SAFETY: every task writes all of its own columns of its own sample.
    unsafe {
        written(x.len(), |start: SharedOutputPtr<T>| {
            parallel_for(batch * blocks, |task| {
                let (sample, first) = (task / blocks * n, task % blocks * BLOCK);
                for row in (0..rows).step_by(BLOCK) {
                    for column in first..columns.min(first + BLOCK) {
                        for row in row..rows.min(row + BLOCK) {
                            start.at(sample + column * rows + row).write(x[sample + row * columns + column]);
                        }
                    }
                }
            });
        })
    }
}
