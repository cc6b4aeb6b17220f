//! Unit tests of `orator_base::motion::fk`.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{norm, sub};
use orator_base::motion::fk::Skeleton;

#[test]
fn forward_kinematics_of_a_bent_arm() {
    let mut arm = Skeleton::default();
    let root = arm.push("Shoulder", None, [0.0; 3], false);
    let elbow = arm.push("Elbow", Some(root), [2.0, 0.0, 0.0], false);
    arm.push("Wrist", Some(elbow), [1.0, 0.0, 0.0], true);
    let quarter = Rotation::about([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2);
    let positions = arm.positions([0.0, 0.0, 5.0], &[quarter, quarter, Rotation::IDENTITY]);
    assert!(norm(sub(positions[1], [0.0, 2.0, 5.0])) < 1e-12);
    assert!(norm(sub(positions[2], [-1.0, 2.0, 5.0])) < 1e-12);
    assert_eq!(arm.children(root).collect::<Vec<_>>(), [elbow]);
}
