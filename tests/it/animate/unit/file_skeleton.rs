//! Unit tests of `orator_avatar::animate::rig::file_skeleton`.

use orator_avatar::animate::rig::file_skeleton::{FileSkeleton, RestAxes};
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::unit;
use orator_base::math::vec3::{dot, norm, sub};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_formats::bvh::write::BvhClip;

/// The rig without measured bones.
pub(super) fn default_rig() -> Rig {
    let missing = ndarray::Array3::from_elem((1, N_JOINTS, 3), f32::NAN);
    Rig::from_motion(&Motion::from_joints(orator_base::types::time::FrameRate::new(15, 1), missing))
}

#[test]
fn every_convention_moves_the_same_joints() {
    let rig = default_rig();
    let turn = |n: usize| Rotation::about([0.6, 0.0, 0.8], 0.1 * n as f64);
    let clip = BvhClip {
        skeleton: rig.skeleton.clone(),
        fps: orator_base::types::time::FrameRate::new(15, 1),
        root: rig.root,
        travel: Vec::new(),
        local: vec![(0..rig.skeleton.joints.len()).map(turn).collect()],
    };
    let expected = clip.positions(0);
    for (names, axes) in Names::ALL.into_iter().flat_map(|n| [(n, RestAxes::World), (n, RestAxes::Convention)]) {
        let file = FileSkeleton::new(&rig.skeleton, names, axes);
        let found = file.clip(&clip).positions(0);
        for (n, place) in expected.iter().enumerate() {
            assert!(norm(sub(found[file.of_rig[n]], *place)) < 1e-9, "{names:?} {axes:?} {n}");
        }
    }
}

#[test]
fn mixamo_has_65_bones_along_y() {
    let rig = default_rig();
    let file = FileSkeleton::new(&rig.skeleton, Names::Mixamo, RestAxes::Convention);
    assert_eq!(file.skeleton.joints.len(), 65);
    let at = |name: &str| file.skeleton.find(&format!("mixamorig:{name}")).unwrap();
    let places = file.rest_positions(rig.root);
    for (bone, child) in [
        ("Spine1", "Spine2"),
        ("Spine2", "Neck"),
        ("LeftArm", "LeftForeArm"),
        ("RightForeArm", "RightHand"),
        ("LeftHandThumb1", "LeftHandThumb2"),
        ("RightHandPinky3", "RightHandPinky4"),
        ("LeftUpLeg", "LeftLeg"),
        ("RightFoot", "RightToeBase"),
        ("LeftToeBase", "LeftToe_End"),
    ] {
        let along = unit(sub(places[at(child)], places[at(bone)]), 1e-9).unwrap();
        assert!(dot(along, file.rest[at(bone)].axes()[1]) > 1.0 - 1e-9, "{bone}");
        assert_eq!(file.skeleton.joints[at(child)].parent, Some(at(bone)));
    }
    let [x, _, z] = file.rest[at("LeftForeArm")].axes();
    assert!(x[2] < -0.999 && z[1] < -0.999);
    let [x, _, z] = file.rest[at("RightUpLeg")].axes();
    assert!(x[0] < -0.999 && z[2] > 0.999);
    let [x, _, z] = file.rest[at("RightToeBase")].axes();
    assert!(x[0] < -0.999 && z[1] > 0.999);
}
