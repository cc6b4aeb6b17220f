//! Unit tests of `orator_avatar::animate::avatar::patch`.

use orator_avatar::animate::avatar::surface::Surface;
use orator_base::math::vec3::sub;
use orator_base::math::vec3::{dot, norm};

#[test]
fn nets_face_outwards_and_tubes_are_round() {
    let row = |y: f64| (0..3).map(|x| [f64::from(x), y, 0.0]).collect::<Vec<_>>();
    let net = Surface::net(&[row(0.0), row(1.0)]);
    assert!(net.triangles.len() == 4 && net.normals.iter().all(|normal| normal[2] > 0.999));
    assert!(net.mirrored().normals.iter().all(|normal| normal[2] > 0.999));
    for closed in [false, true] {
        let line = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
        let tube = Surface::tube(&line, closed, 0.1, 6);
        for (&point, &normal) in tube.points.iter().zip(&tube.normals) {
            let near = line.map(|at| sub(point, at)).into_iter().min_by(|a, b| norm(*a).total_cmp(&norm(*b)));
            assert!((norm(near.unwrap()) - 0.1).abs() < 1e-9 && dot(near.unwrap(), normal) > 0.0);
        }
    }
}
