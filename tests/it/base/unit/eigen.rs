//! Unit tests of `orator_base::math::eigen`.

use ndarray::{Array1, Array2};
use orator_base::math::eigen::{eigenvalues, factor};

fn hash(i: usize, j: usize) -> f64 {
    ((i * 7919 + j * 104_729 + 13) % 1009) as f64 / 1009.0 - 0.5
}

#[test]
fn eigenvalues_of_a_known_matrix() {
    // The tridiagonal matrix of 2 and -1 has the eigenvalues 2 - 2 cos(k pi / (n + 1)).
    let n = 30;
    let chain = Array2::from_shape_fn((n, n), |(i, j)| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    });
    // A reflection makes the matrix dense.
    let v = Array1::from_shape_fn(n, |i| hash(i, 3));
    let square = v.dot(&v);
    let turn = Array2::from_shape_fn((n, n), |(i, j)| f64::from(u8::from(i == j)) - 2.0 * v[i] * v[j] / square);
    let mut found = eigenvalues(turn.dot(&chain).dot(&turn));
    found.sort_by(f64::total_cmp);
    for (k, value) in found.iter().enumerate() {
        let known = 2.0 - 2.0 * (std::f64::consts::PI * (k + 1) as f64 / (n + 1) as f64).cos();
        assert!((value - known).abs() < 1e-12, "{k}: {value} {known}");
    }
}

#[test]
fn degenerate_matrices_terminate() {
    assert!(eigenvalues(Array2::zeros((0, 0))).is_empty());
    assert_eq!(eigenvalues(Array2::zeros((5, 5))), vec![0.0; 5]);
    assert_eq!(eigenvalues(Array2::from_elem((1, 1), 3.0)), vec![3.0]);
    let mut one = eigenvalues(Array2::from_elem((4, 4), 1.0));
    one.sort_by(f64::total_cmp);
    assert!((one[3] - 4.0).abs() < 1e-12 && one[2].abs() < 1e-12);
    assert_eq!(eigenvalues(Array2::from_elem((3, 3), f64::NAN)).len(), 3);
    assert_eq!(factor(&Array2::from_elem((3, 3), f64::NAN)).shape(), [3, 0]);
}

#[test]
fn the_factor_has_the_rank_and_reproduces_the_matrix() {
    let rows = Array2::from_shape_fn((7, 20), |(i, j)| hash(i, j));
    let matrix = rows.t().dot(&rows);
    let f = factor(&matrix);
    assert_eq!(f.shape(), [20, 7]);
    let back = f.dot(&f.t());
    assert!(back.iter().zip(&matrix).all(|(a, b)| (a - b).abs() < 1e-12));
}
