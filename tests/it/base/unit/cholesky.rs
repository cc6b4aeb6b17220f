//! Unit tests of `orator_base::math::cholesky`.

use ndarray::array;
use orator_base::math::cholesky::solve;

#[test]
fn the_solution_satisfies_the_equations() {
    let a = array![[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
    let x = array![[1.0, -2.0], [0.5, 3.0], [-1.5, 0.25]];
    let off = solve(a.clone(), a.dot(&x)) - x;
    assert!(off.iter().all(|v| v.abs() < 1e-12), "{off}");
}
