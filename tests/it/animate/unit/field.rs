//! Unit tests of `orator_avatar::animate::avatar::field`.

use orator_avatar::animate::avatar::field::{Form, RoundCone, smooth_union};

#[test]
fn distances_match_the_shape() {
    let limb = RoundCone::new([[0.0; 3], [4.0, 0.0, 0.0]], [1.0, 1.0]);
    assert!((limb.distance([2.0, 3.0, 0.0]) - 2.0).abs() < 1e-12);
    assert!((limb.distance([6.0, 0.0, 0.0]) - 1.0).abs() < 1e-12);
    let flattened = limb.flattened([0.0, 0.0, 1.0], 0.5);
    assert!(flattened.distance([1.0, 0.0, 0.5]).abs() < 1e-12 && flattened.distance([1.0, 1.0, 0.0]).abs() < 1e-12);
    let form = Form::default().with(limb, 0.0).cut([3.0, 0.0, 0.0], [1.0, 0.0, 0.0], 1e-6);
    assert!(form.distance([3.5, 0.0, 0.0]) > 0.49 && form.distance([2.9, 0.0, 0.0]) < 0.0);
    assert!(smooth_union(0.1, 0.1, 1.0) < 0.1 && (smooth_union(0.1, 2.0, 1.0) - 0.1).abs() < 1e-12);
}
