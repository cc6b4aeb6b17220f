//! Savitzky-Golay filter: a polynomial is fitted to the frames around each frame and evaluated at that frame. At the
//! ends of a run the polynomials of the first and the last complete window are evaluated (scipy's `mode="interp"`), so
//! that the run keeps its length and has no delay.

use super::vec3::{Vec3, add, scale};

/// Filter for one window length and polynomial order.
#[derive(Clone, Debug)]
pub struct SavitzkyGolay {
    order: usize,
    /// Row `i`: weights of the window's values in the fit at the window's frame `i`.
    fits: Vec<Vec<f64>>,
}

impl SavitzkyGolay {
    /// Creates a filter with a window of `2 * half + 1` frames and a polynomial of `order`, at most `2 * half`.
    pub fn new(half: usize, order: usize) -> Self {
        let window = 2 * half + 1;
        let basis = orthonormal_powers(window, order);
        let fit = |i: usize, k: usize| basis.iter().map(|power| power[i] * power[k]).sum();
        let fits = (0..window).map(|i| (0..window).map(|k| fit(i, k)).collect()).collect();
        Self { order, fits }
    }

    /// Number of frames of the window.
    pub fn window(&self) -> usize {
        self.fits.len()
    }

    /// Smooths a run. A run that is shorter than the window is smoothed with the longest window that fits; if that
    /// window has no more frames than the polynomial has coefficients, the run is returned unchanged.
    pub fn run(&self, values: &[Vec3]) -> Vec<Vec3> {
        let (n, window) = (values.len(), self.fits.len());
        if n < window {
            let half = n.saturating_sub(1) / 2;
            return if 2 * half <= self.order { values.to_vec() } else { Self::new(half, self.order).run(values) };
        }
        let half = window / 2;
        (0..n)
            .map(|t| {
                let start = t.saturating_sub(half).min(n - window);
                let weights = self.fits[t - start].iter();
                weights.zip(&values[start..]).fold([0.0; 3], |sum, (&w, &v)| add(sum, scale(v, w)))
            })
            .collect()
    }
}

/// Polynomials up to `order`, orthonormal over the frames of a window.
fn orthonormal_powers(window: usize, order: usize) -> Vec<Vec<f64>> {
    let half = (window as f64 - 1.0) / 2.0;
    let at = |i: usize| (i as f64 - half) / half.max(1.0);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for degree in 0..=order.min(window - 1) {
        let mut power: Vec<f64> = (0..window).map(|i| at(i).powi(degree as i32)).collect();
        // Twice, to remove what rounding leaves of the other polynomials.
        for _ in 0..2 {
            for other in &basis {
                let along: f64 = power.iter().zip(other).map(|(a, b)| a * b).sum();
                power.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
            }
        }
        let length = power.iter().map(|v| v * v).sum::<f64>().sqrt();
        power.iter_mut().for_each(|v| *v /= length);
        basis.push(power);
    }
    basis
}
