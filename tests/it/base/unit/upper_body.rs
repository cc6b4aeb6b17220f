//! Unit tests of `orator_base::motion::upper_body`.

use orator_base::motion::upper_body::{Pose, REFERENCE_SIZE, metres_per_unit, size};

#[test]
fn metres_give_the_reference_size() {
    let pose: Pose = std::array::from_fn(|j| [j as f64, (j * j) as f64, 1.0]);
    let grow = metres_per_unit(&[pose]);
    assert!((size(&pose.map(|p| orator_base::math::vec3::scale(p, grow))) - REFERENCE_SIZE).abs() < 1e-12);
    assert_eq!(metres_per_unit(&[]), 1.0);
}
