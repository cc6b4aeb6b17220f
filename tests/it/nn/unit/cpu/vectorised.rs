//! Tests of `orator_nn::cpu::vectorised`.

use orator_nn::cpu::packed_matrix::COLUMNS;
use orator_nn::cpu::vectorised::{DropMask, drop_out, exp_f32, gates_forward};

#[test]
fn gates_equal_their_definition() {
    let width = COLUMNS;
    let value = |i: usize, k: f64| ((i as f64) * k).sin() * 3.0;
    let mut sums: Vec<f32> = (0..8 * width).map(|i| value(i, 1.3) as f32).collect();
    let previous: Vec<f32> = (0..2 * width).map(|i| value(i, 0.7) as f32).collect();
    let (before, mut next) = (sums.clone(), vec![0.0; 2 * width]);
    gates_forward(&mut sums, &previous, &mut next, width);
    for (i, next) in next.iter().enumerate() {
        let at = |gate: usize| f64::from(before[i / width * 4 * width + gate * width + i % width]);
        let sigmoid = |x: f64| 1.0 / (1.0 + (-x).exp());
        let (r, z) = (sigmoid(at(1)), sigmoid(at(2)));
        let n = (at(0) + r * at(3)).tanh();
        let expected = (1.0 - z) * n + z * f64::from(previous[i]);
        assert!((f64::from(*next) - expected).abs() < 1e-6, "{next}, expected {expected}");
    }
}

#[test]
fn dropout_is_independent_of_chunks_and_drops_the_fraction() {
    let mask = DropMask::new(77, 0.3);
    let mut complete = vec![1.0f32; 100_000];
    drop_out(&mut complete, 5, mask);
    let mut pieces = vec![1.0f32; 100_000];
    pieces.chunks_mut(777).enumerate().for_each(|(i, piece)| drop_out(piece, 5 + 777 * i, mask));
    assert_eq!(complete, pieces);
    let dropped = complete.iter().filter(|v| **v == 0.0).count() as f64 / 1e5;
    assert!((dropped - 0.3).abs() < 0.01, "{dropped}");
    assert!((complete.iter().sum::<f32>() / 1e5 - 1.0).abs() < 0.02);
}

#[test]
fn exponentials_are_accurate() {
    for i in -8000..8000 {
        let x = i as f32 * 0.01;
        assert!((exp_f32(x) / x.exp() - 1.0).abs() < 3e-7, "{x}");
    }
    assert!(exp_f32(-1e9) < 1e-37 && exp_f32(1e9) > 1e38);
}
