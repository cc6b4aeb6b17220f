//! Tests of `orator_base::math::procrustes`.

use orator_base::math::procrustes::{Similarity, matrix_of, similarity};

const POINTS: [[f64; 3]; 5] = [[0.1, 0.2, 0.3], [1.0, -0.4, 0.2], [-0.6, 0.9, 1.1], [0.3, 0.3, -0.8], [2.0, 1.0, 0.5]];

#[test]
fn a_known_similarity_is_recovered() {
    for (w, x, y, z) in [(1.0, 0.0, 0.0, 0.0), (0.3, -0.7, 0.2, 0.6), (0.0, 0.0, 1.0, 0.0), (-0.9, 0.1, 0.1, 0.4f64)] {
        let norm = (w * w + x * x + y * y + z * z).sqrt();
        let truth = Similarity {
            scale: 1.7,
            rotation: matrix_of([w / norm, x / norm, y / norm, z / norm]),
            shift: [3.0, -2.0, 0.5],
        };
        let found = similarity(&POINTS, &POINTS.map(|p| truth.apply(p))).unwrap();
        assert!((found.scale - truth.scale).abs() < 1e-12);
        for i in 0..3 {
            assert!((found.shift[i] - truth.shift[i]).abs() < 1e-12);
            for k in 0..3 {
                assert!((found.rotation[i][k] - truth.rotation[i][k]).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn a_mirror_image_is_not_matched_by_reflection() {
    let mirrored = POINTS.map(|[x, y, z]| [-x, y, z]);
    let found = similarity(&POINTS, &mirrored).unwrap();
    let r = found.rotation;
    let det = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) - r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0])
        + r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
    assert!((det - 1.0).abs() < 1e-9);
    let worst = POINTS.iter().zip(&mirrored).map(|(p, q)| (found.apply(*p)[0] - q[0]).abs()).fold(0.0, f64::max);
    assert!(worst > 0.05);
}

#[test]
fn degenerate_input_gives_none() {
    assert!(similarity(&POINTS[..2], &POINTS[..2]).is_none());
    assert!(similarity(&[[1.0; 3]; 4], &POINTS[..4]).is_none());
    assert!(similarity(&POINTS, &[[f64::NAN; 3]; 5]).is_none());
    assert!(similarity(&POINTS, &POINTS[..4]).is_none());
}
