//! Tests of `orator_avatar::animate::retarget::glb_rig`.

use orator_avatar::animate::retarget::glb_rig::decomposed;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, norm, scale, sub};

/// Matrix of the images of the axes and of the origin.
fn matrix(axes: [Vec3; 3], origin: Vec3) -> [f64; 16] {
    let columns = [axes[0], axes[1], axes[2], origin];
    std::array::from_fn(|n| match n % 4 {
        3 => f64::from(u8::from(n == 15)),
        row => columns[n / 4][row],
    })
}

#[test]
fn a_matrix_is_decomposed_and_shear_and_reflections_are_found() {
    for n in 0..40 {
        let angles = [0.4, -0.7, 1.1].map(|step| step * f64::from(n));
        let turn = Rotation::from_euler([2, 0, 1], angles);
        let factor = 0.01 + 0.3 * f64::from(n);
        let (offset, rest, factors, is_sheared) =
            decomposed(&matrix(turn.axes().map(|axis| scale(axis, factor)), [1.0, -2.0, f64::from(n)]));
        assert_eq!((offset, is_sheared), ([1.0, -2.0, f64::from(n)], false));
        assert!(factors.iter().all(|found| (found - factor).abs() < 1e-9 * factor), "{factors:?}");
        for v in [[1.0, 2.0, -0.5], [0.0, 0.3, 4.0]] {
            assert!(norm(sub(rest.turn(v), turn.turn(v))) < 1e-9, "{rest:?} {turn:?}");
        }
    }
    let [x, y, z] = [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
    assert_eq!(decomposed(&matrix([scale(x, -1.0), y, z], [0.0; 3])).2, [-2.0; 3]);
    assert!(decomposed(&matrix([x, [0.5, 2.0, 0.0], z], [0.0; 3])).3);
    let (_, rest, factors, _) = decomposed(&[0.0; 16]);
    assert!(rest.w.is_finite() && rest.v.iter().all(|v| v.is_finite()) && factors == [0.0; 3]);
}
