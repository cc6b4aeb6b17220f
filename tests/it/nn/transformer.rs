//! Layer norm, GELU and attention against their definitions.

use orator_nn::cpu::transformer::{attend_heads, gelu, layer_norm, softmax};

fn pattern(n: usize, rate: f64) -> Vec<f32> {
    (0..n).map(|i| (3.0 * (i as f64 * rate).sin()) as f32).collect()
}

#[test]
fn layer_norm_and_gelu_equal_their_definitions() {
    let (rows, gamma, beta) = (pattern(96, 1.3), pattern(48, 0.7), pattern(48, 0.3));
    let mut normalised = vec![0.0; 96];
    layer_norm(&rows, &gamma, &beta, &mut normalised);
    for (i, value) in normalised.iter().enumerate() {
        let row: Vec<f64> = rows[i / 48 * 48..][..48].iter().map(|v| f64::from(*v)).collect();
        let mean = row.iter().sum::<f64>() / 48.0;
        let variance = row.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 48.0;
        let standard = (row[i % 48] - mean) / (variance + 1e-5).sqrt();
        let expected = standard * f64::from(gamma[i % 48]) + f64::from(beta[i % 48]);
        assert!((f64::from(*value) - expected).abs() < 1e-5, "{value}, expected {expected}");
    }
    // Values of `torch.nn.functional.gelu`.
    let mut values = [-6.0f32, -3.0, -1.0, -0.1, 0.0, 0.1, 1.0, 3.0, 6.0];
    gelu(&mut values);
    let expected = [-5.9e-9, -0.004_049_7, -0.158_655_3, -0.046_017_2, 0.0, 0.053_982_8, 0.841_344_7, 2.995_950_3, 6.0];
    assert!(values.iter().zip(expected).all(|(value, expected)| (value - expected).abs() < 1e-6), "{values:?}");
}

#[test]
fn attention_equals_its_definition_for_every_head() {
    let (n_heads, dim, n) = (2, 16, 21);
    let width = n_heads * dim;
    let (query, keys, values) = (pattern(width, 0.9), pattern(n * width, 0.37), pattern(n * width, 0.61));
    let mut context = vec![0.0; width];
    attend_heads(&query, &keys, &values, n_heads, &mut [0.0; 32], &mut context);
    for (c, value) in context.iter().enumerate() {
        let columns = c / dim * dim..(c / dim + 1) * dim;
        let score = |t: usize| columns.clone().map(|k| f64::from(query[k] * keys[t * width + k])).sum::<f64>();
        let weights: Vec<f64> = (0..n).map(|t| score(t).exp()).collect();
        let sum: f64 = weights.iter().enumerate().map(|(t, w)| w * f64::from(values[t * width + c])).sum();
        let expected = sum / weights.iter().sum::<f64>();
        assert!((f64::from(*value) - expected).abs() < 1e-4, "{value}, expected {expected}");
    }
}

#[test]
fn no_result_is_denormal() {
    let falling: Vec<f32> = (0..160).map(|i| -(i as f32)).collect();
    let (mut weights, mut values) = (falling.clone(), falling);
    softmax(&mut weights, 160, 160);
    gelu(&mut values);
    let is_fast = |value: &f32| *value == 0.0 || value.is_normal();
    assert!(weights.iter().chain(&values).all(is_fast), "{weights:?} {values:?}");
    assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6 && weights[40] > 0.0);
}
