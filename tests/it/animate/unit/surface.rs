//! Unit tests of `orator_avatar::animate::avatar::surface`.

use orator_avatar::animate::avatar::field::RoundCone;
use orator_avatar::animate::avatar::surface::Surface;
use orator_base::math::vec3::{cross, dot, norm, scale, sub};

#[test]
fn a_sphere_mesh_is_closed_accurate_and_faces_outwards() {
    let ball = RoundCone::new([[0.3, -0.2, 0.1]; 2], [2.0; 2]);
    let surface = Surface::from_field(&|at| ball.distance(at), [[-1.7, -2.2, -1.9], [2.3, 1.8, 2.1]], 0.3);
    // Six times the signed volume, positive where triangles face outwards.
    let six_volumes = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| surface.points[i as usize]);
        dot(a, cross(b, c))
    };
    let volume = surface.triangles.iter().map(six_volumes).sum::<f64>() / 6.0;
    assert!((volume - 4.0 / 3.0 * std::f64::consts::PI * 8.0).abs() < 0.6);
    for (&point, &normal) in surface.points.iter().zip(&surface.normals) {
        assert!(ball.distance(point).abs() < 1e-3);
        assert!(norm(sub(normal, scale(sub(point, [0.3, -0.2, 0.1]), 0.5))) < 1e-2);
    }
    let mut edges = std::collections::BTreeMap::new();
    for [a, b, c] in &surface.triangles {
        for edge in [[a, b], [b, c], [c, a]] {
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    assert!(edges.iter().all(|([a, b], &n)| n == 1 && edges.get(&[*b, *a]) == Some(&1)));
}
