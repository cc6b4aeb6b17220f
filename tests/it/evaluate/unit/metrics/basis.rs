//! Tests of `orator_gesture::metrics::space::basis`.

use crate::evaluate::unit::fixed_rate::moving;
use ndarray::{Array2, s};
use orator_base::types::skeleton::N_JOINTS;
use orator_gesture::metrics::space::basis::{Basis, N, poses, windows};
use orator_gesture::metrics::space::fixed_rate::{FPS, N_COORDINATES};

const FILE: &[u8] = include_bytes!("../../../../../models/motion_basis.safetensors");

#[test]
fn the_built_in_basis_is_orthonormal() {
    let basis = Basis::parse(FILE).unwrap();
    let gram = basis.directions.t().dot(&basis.directions);
    for ((i, j), v) in gram.indexed_iter() {
        assert!((v - f32::from(u8::from(i == j))).abs() < 1e-4, "{i} {j}: {v}");
    }
    assert!(basis.weights.iter().all(|w| *w > 0.0));
    let cut = format!("{:#}", Basis::parse(&FILE[..FILE.len() / 2]).err().unwrap());
    assert!(!cut.is_empty());
}

#[test]
fn rows_match_products_of_single_windows() {
    let (joints, mask) = (moving(1200), Array2::from_elem((1200, N_JOINTS), true));
    let rows = windows(joints.view(), mask.view(), FPS);
    assert_eq!(rows.dim(), ((1200 - 15) / 4 + 1, N));
    let basis = Basis::parse(FILE).unwrap();
    for n in [0, 1, 255, 256, 296] {
        let window = poses(joints.slice(s![4 * n..4 * n + 15, .., ..]));
        for k in [0, 17, 63] {
            let number = |(i, v): (usize, &f32)| {
                f64::from(*v) * f64::from(basis.weights[i % N_COORDINATES / 3] * basis.directions[[i, k]])
            };
            let sum: f64 = window.iter().enumerate().map(number).sum();
            assert!((sum - rows[[n, k]]).abs() < 1e-3 * (1.0 + sum.abs()), "{n} {k}: {sum} {}", rows[[n, k]]);
        }
    }
}

#[test]
fn translation_of_the_body_has_no_effect() {
    let (joints, mask) = (moving(40), Array2::from_elem((40, N_JOINTS), true));
    let original = windows(joints.view(), mask.view(), FPS);
    let translated = windows((joints + 2.0).view(), mask.view(), FPS);
    assert!(original.iter().zip(&translated).all(|(a, b)| (a - b).abs() < 1e-2));
    assert_eq!(original.nrows(), 7);
}
