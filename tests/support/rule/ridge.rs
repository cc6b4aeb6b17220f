//! Ridge regression from the audio of a frame to the motion of the same frame. Without context, its error shows how
//! much of a rule depends on the current frame alone.

use ndarray::{Array2, ArrayView1, ArrayView2, Axis};
use orator_base::math::cholesky::solve;

/// Sums over frames that determine the regression for any penalty.
pub struct RidgeSums {
    /// Gram matrix [n + 1, n + 1] of the inputs and a constant 1.
    inputs: Array2<f64>,
    /// Products [n + 1, m] of inputs and outputs.
    products: Array2<f64>,
}

/// Weights [n + 1, m]; the last row is the offset.
pub struct Ridge(Array2<f64>);

impl RidgeSums {
    /// Empty sums for `n` inputs and `m` outputs.
    pub fn new(n: usize, m: usize) -> Self {
        Self { inputs: Array2::zeros((n + 1, n + 1)), products: Array2::zeros((n + 1, m)) }
    }

    /// Adds frames: inputs [T, n], outputs [T, m].
    pub fn add(&mut self, inputs: ArrayView2<f64>, outputs: ArrayView2<f64>) {
        let ones = Array2::ones((inputs.nrows(), 1));
        let inputs = ndarray::concatenate(Axis(1), &[inputs, ones.view()]).unwrap_or_else(|_| Array2::zeros((0, 0)));
        self.inputs += &inputs.t().dot(&inputs);
        self.products += &inputs.t().dot(&outputs);
    }

    /// Solves the regression with a penalty of `strength` times the mean square of an input, on all weights except the
    /// offset.
    pub fn ridge(&self, strength: f64) -> Ridge {
        let n = self.inputs.nrows() - 1;
        let scale = (0..n).map(|k| self.inputs[[k, k]]).sum::<f64>() / n.max(1) as f64;
        let mut matrix = self.inputs.clone();
        (0..n).for_each(|k| matrix[[k, k]] += strength * scale);
        Ridge(solve(matrix, self.products.clone()))
    }
}

impl Ridge {
    /// Predicts outputs [T, m] from inputs [T, n].
    pub fn predict(&self, inputs: ArrayView2<f64>) -> Array2<f64> {
        let n = self.0.nrows() - 1;
        inputs.dot(&self.0.slice(ndarray::s![..n, ..])) + self.0.row(n)
    }
}

/// Pearson correlation of two series; 0 if one of them is constant.
pub fn correlation(a: ArrayView1<f64>, b: ArrayView1<f64>) -> f64 {
    let n = a.len().min(b.len()).max(1) as f64;
    let mean = |x: ArrayView1<f64>| x.sum() / n;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sums = a.iter().zip(b).fold([0.0; 3], |[ab, aa, bb], (a, b)| {
        let (a, b) = (a - mean_a, b - mean_b);
        [ab + a * b, aa + a * a, bb + b * b]
    });
    let norm = (sums[1] * sums[2]).sqrt();
    if norm > 0.0 { sums[0] / norm } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn a_linear_map_is_recovered_and_shrinks_with_the_penalty() {
        let inputs = Array2::from_shape_fn((50, 2), |(t, k)| ((t * (k + 3)) as f64 * 0.7).sin());
        let outputs = Array2::from_shape_fn((50, 1), |(t, _)| 2.0 * inputs[[t, 0]] - inputs[[t, 1]] + 5.0);
        let mut sums = RidgeSums::new(2, 1);
        sums.add(inputs.slice(ndarray::s![..20, ..]), outputs.slice(ndarray::s![..20, ..]));
        sums.add(inputs.slice(ndarray::s![20.., ..]), outputs.slice(ndarray::s![20.., ..]));
        let exact = sums.ridge(0.0).predict(inputs.view());
        assert!((&exact - &outputs).iter().all(|error| error.abs() < 1e-9));
        let flat = sums.ridge(1e9).predict(inputs.view());
        let mean = outputs.mean().unwrap();
        assert!(flat.iter().all(|v| (v - mean).abs() < 1e-3));
    }

    #[test]
    fn correlation_is_pearsons() {
        let line = array![1.0, 2.0, 3.0, 4.0];
        assert!((correlation(line.view(), (&line * -3.0 + 1.0).view()) + 1.0).abs() < 1e-12);
        assert!((correlation(line.view(), array![1.0, 3.0, 2.0, 4.0].view()) - 0.8).abs() < 1e-12);
        assert_eq!(correlation(line.view(), array![1.0, 1.0, 1.0, 1.0].view()), 0.0);
    }
}
