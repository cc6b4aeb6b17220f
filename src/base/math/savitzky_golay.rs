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

#[cfg(test)]
mod tests {
    use super::*;

    fn run(half: usize, order: usize, values: &[f64]) -> Vec<f64> {
        let track: Vec<Vec3> = values.iter().map(|&v| [v, 0.0, -2.0 * v]).collect();
        let smooth = SavitzkyGolay::new(half, order).run(&track);
        assert!(smooth.iter().all(|v| v[1] == 0.0 && (v[2] + 2.0 * v[0]).abs() < 1e-12));
        smooth.into_iter().map(|v| v[0]).collect()
    }

    #[test]
    fn results_equal_those_of_scipy_inside_and_at_the_ends() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/smoothing_golden.json")).unwrap();
        let numbers =
            |v: &serde_json::Value| v.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
        let cases = golden["savitzky_golay"].as_array().unwrap();
        assert!(cases.len() >= 5);
        for case in cases {
            let (half, order) =
                (case["window"].as_u64().unwrap() as usize / 2, case["order"].as_u64().unwrap() as usize);
            for (found, expected) in run(half, order, &numbers(&case["input"])).iter().zip(numbers(&case["output"])) {
                assert!((found - expected).abs() < 1e-9, "window {}: {found} for {expected}", 2 * half + 1);
            }
        }
    }

    #[test]
    fn a_cubic_is_unchanged_and_short_runs_are_accepted() {
        let cubic: Vec<f64> = (0..30).map(f64::from).map(|t| 1.0 + t - 0.2 * t * t + 0.01 * t * t * t).collect();
        for n in [0, 1, 4, 5, 8, 9, 30] {
            for (found, expected) in run(4, 3, &cubic[..n]).iter().zip(&cubic) {
                assert!((found - expected).abs() < 1e-9, "{n} frames");
            }
        }
        let noise: Vec<f64> = (0..7).map(|t| f64::from(t % 2)).collect();
        assert!(run(4, 3, &noise)[3] < 0.8 && run(4, 3, &noise[..4]) == noise[..4]);
    }
}
