//! Unit tests of `orator_nn::cpu::tensor`.

use orator_nn::cpu::tensor::{Matrix, matmul};

#[test]
fn products_agree_with_the_definition() {
    let (m, n, depth) = (145, 300, 33);
    let left: Vec<f64> = (0..m * depth).map(|i| (i as f64 * 0.7).sin()).collect();
    let right: Vec<f64> = (0..n * depth).map(|i| (i as f64 * 0.3).cos()).collect();
    let mut product = vec![f64::NAN; m * n];
    // The right side is stored [n, depth].
    matmul(&mut product, Matrix::new(&left, depth), Matrix::new(&right, depth).transposed(), m, n, depth);
    for row in 0..m {
        for column in 0..n {
            let expected: f64 = (0..depth).map(|k| left[row * depth + k] * right[column * depth + k]).sum();
            assert!((product[row * n + column] - expected).abs() < 1e-12);
        }
    }
}
