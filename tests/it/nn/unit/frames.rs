//! Unit tests of `orator_nn::cpu::frames`.

use orator_nn::cpu::frames::transpose;

#[test]
fn transposition_equals_its_definition() {
    for (batch, rows, columns) in [(1, 1, 1), (2, 3, 70), (3, 65, 33), (1, 1, 40)] {
        let x: Vec<f64> = (0..batch * rows * columns).map(|i| i as f64).collect();
        let y = transpose(&x, rows, columns);
        for (i, value) in x.iter().enumerate() {
            let (sample, row, column) = (i / (rows * columns), i / columns % rows, i % columns);
            assert_eq!(y[(sample * columns + column) * rows + row], *value);
        }
    }
}
