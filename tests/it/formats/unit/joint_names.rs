//! Tests of `orator_formats::skeleton::joint_names`.

use orator_formats::skeleton::joint_names::{match_names, without_numbers};

#[test]
fn numbers_that_distinguish_joints_are_retained() {
    let names = ["Spine_01", "Spine_02", "Neck_03", "Head_04", "LeftHand_05", "LeftHand_06"];
    let bare = ["Spine_01", "Spine_02", "Neck", "Head", "LeftHand_05", "LeftHand_06"];
    assert_eq!(without_numbers(&names), bare);
    let wrists = ["left_wrist", "left_hand", "left_ankle", "left_foot"];
    let found = match_names(&wrists);
    assert_eq!((found["LeftHand"], found["LeftFoot"]), (0, 2), "the joint nearer to the trunk");
}
