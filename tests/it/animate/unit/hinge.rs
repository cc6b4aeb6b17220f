//! Unit tests of `orator_avatar::animate::rig::hinge`.

use orator_avatar::animate::rig::hinge::{Bend, Hinge};
use orator_base::math::vec3::{cross, norm, sub, unit};

#[test]
fn directions_round_trip_through_two_angles() {
    let elbow = Hinge::new([1.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
    // The left forearm bends forward.
    let forward = elbow.rotation(Bend { flexion: 90.0, side: 0.0 }).turn([1.0, 0.0, 0.0]);
    assert!(norm(sub(forward, [0.0, 0.0, 1.0])) < 1e-12);
    let along = unit([0.7, -0.4, 0.5], 0.0).unwrap();
    let thumb = Hinge::new(along, unit(cross(along, [0.0, -0.5, -0.87]), 0.0).unwrap());
    for hinge in [elbow, thumb] {
        let rest = hinge.bend(hinge.along());
        assert!(rest.side.abs() + rest.flexion.abs() < 1e-5);
        for flexion in [-170.0, -90.0, -5.0, 0.0, 60.0, 100.0, 179.0] {
            for side in [-80.0, -20.0, 0.0, 45.0] {
                let bend = Bend { flexion, side };
                let again = hinge.bend(hinge.rotation(bend).turn(hinge.along()));
                assert!((again.flexion - flexion).abs() < 1e-6 && (again.side - side).abs() < 1e-6);
            }
        }
    }
}
