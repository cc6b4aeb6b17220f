//! Joint names in the conventions of other programs.

use orator_formats::skeleton::joint_names::{find, match_names};

/// Names of the left side and the centre, in the order of `BONES`; a dash for a bone that a skeleton lacks.
const BONES: &str = "Hips Spine Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg LeftFoot \
                     LeftHandThumb1 LeftHandIndex2 LeftHandPinky3";

/// Conventions with their names of `BONES`, a line each.
const CONVENTIONS: &str = "\
    Ready Player Me: Hips Spine Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftUpLeg LeftLeg \
    LeftFoot LeftHandThumb1 LeftHandIndex2 LeftHandPinky3\n\
    VRM 0.x: hips spine neck head leftShoulder leftUpperArm leftLowerArm leftHand leftUpperLeg leftLowerLeg \
    leftFoot leftThumbProximal leftIndexIntermediate leftLittleDistal\n\
    VRoid: J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Neck J_Bip_C_Head J_Bip_L_Shoulder J_Bip_L_UpperArm \
    J_Bip_L_LowerArm J_Bip_L_Hand J_Bip_L_UpperLeg J_Bip_L_LowerLeg J_Bip_L_Foot J_Bip_L_Thumb1 \
    J_Bip_L_Index2 J_Bip_L_Little3\n\
    Unreal: pelvis spine_01 neck_01 head clavicle_l upperarm_l lowerarm_l hand_l thigh_l calf_l foot_l \
    thumb_01_l index_02_l pinky_03_l\n\
    Character Creator: CC_Base_Hip CC_Base_Spine01 CC_Base_NeckTwist01 CC_Base_Head CC_Base_L_Clavicle \
    CC_Base_L_Upperarm CC_Base_L_Forearm CC_Base_L_Hand CC_Base_L_Thigh CC_Base_L_Calf CC_Base_L_Foot \
    CC_Base_L_Thumb1 CC_Base_L_Index2 CC_Base_L_Pinky3\n\
    MakeHuman: root spine05 neck01 head clavicle.L upperarm01.L lowerarm01.L wrist.L upperleg01.L \
    lowerleg01.L foot.L finger1-1.L finger2-2.L finger5-3.L\n\
    Rigify, the original bones: ORG-spine ORG-spine.001 ORG-spine.004 ORG-spine.006 ORG-shoulder.L \
    ORG-upper_arm.L ORG-forearm.L ORG-hand.L ORG-thigh.L ORG-shin.L ORG-foot.L ORG-thumb.01.L \
    ORG-f_index.02.L ORG-f_pinky.03.L\n\
    MotionBuilder: Character1_Hips Character1_Spine Character1_Neck Character1_Head Character1_LeftShoulder \
    Character1_LeftArm Character1_LeftForeArm Character1_LeftHand Character1_LeftUpLeg Character1_LeftLeg \
    Character1_LeftFoot Character1_LeftHandThumb1 Character1_LeftHandIndex2 Character1_LeftHandPinky3\n\
    DeepMotion: hips_JNT spine_JNT neck_JNT head_JNT l_shoulder_JNT l_arm_JNT l_forearm_JNT l_hand_JNT \
    l_upleg_JNT l_leg_JNT l_foot_JNT l_handThumb1_JNT l_handIndex2_JNT l_handPinky3_JNT\n\
    Rokoko: Hips Spine1 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftThigh LeftShin LeftFoot \
    LeftFinger1Metacarpal LeftFinger2Medial LeftFinger5Distal\n\
    Perception Neuron: Robot_Hips Robot_Spine Robot_Neck Robot_Head Robot_LeftShoulder Robot_LeftArm \
    Robot_LeftForeArm Robot_LeftHand Robot_LeftUpLeg Robot_LeftLeg Robot_LeftFoot Robot_LeftHandThumb1 \
    Robot_LeftHandIndex2 Robot_LeftHandPinky3\n\
    Biped: ValveBiped.Bip01_Pelvis ValveBiped.Bip01_Spine ValveBiped.Bip01_Neck1 ValveBiped.Bip01_Head1 \
    ValveBiped.Bip01_L_Clavicle ValveBiped.Bip01_L_UpperArm ValveBiped.Bip01_L_Forearm \
    ValveBiped.Bip01_L_Hand ValveBiped.Bip01_L_Thigh ValveBiped.Bip01_L_Calf ValveBiped.Bip01_L_Foot \
    ValveBiped.Bip01_L_Finger0 ValveBiped.Bip01_L_Finger11 ValveBiped.Bip01_L_Finger42\n\
    SMPL-X: pelvis spine1 neck head left_collar left_shoulder left_elbow left_wrist left_hip left_knee \
    left_ankle left_thumb1 left_index2 left_pinky3\n\
    SMPL in Maya: m_avg_Pelvis m_avg_Spine1 m_avg_Neck m_avg_Head m_avg_L_Collar m_avg_L_Shoulder \
    m_avg_L_Elbow m_avg_L_Wrist m_avg_L_Hip m_avg_L_Knee m_avg_L_Ankle - - -\n\
    CMU: root lowerback lowerneck head lclavicle lhumerus lradius lwrist lfemur ltibia lfoot - - -\n\
    Bandai-Namco: Hips Spine Neck Head Shoulder_L UpperArm_L LowerArm_L Hand_L UpperLeg_L LowerLeg_L Foot_L \
    - - -\n\
    Daz: hip abdomen neck head lCollar lShldr lForeArm lHand lThigh lShin lFoot lThumb1 lIndex2 lPinky3\n\
    BEAT: b_root - b_neck0 b_head b_l_shoulder b_l_arm b_l_forearm b_l_wrist b_l_upleg b_l_leg b_l_foot \
    b_l_thumb1 b_l_index2 b_l_pinky3";

#[test]
fn every_convention_is_matched_bone_by_bone() {
    for (convention, names) in CONVENTIONS.lines().filter_map(|line| line.split_once(": ")) {
        // The first joint is one without a bone; numbers as of Sketchfab are appended in the second variant.
        let parts: Vec<&str> = names.split_whitespace().collect();
        let all: Vec<&str> = std::iter::once("Armature").chain(parts.iter().copied().filter(|n| *n != "-")).collect();
        let numbered: Vec<String> = all.iter().enumerate().map(|(k, name)| format!("{name}_0{k}")).collect();
        let numbered: Vec<&str> = numbered.iter().map(String::as_str).collect();
        for names in [&all, &numbered] {
            let found = match_names(names);
            for (bone, part) in BONES.split_whitespace().zip(&parts).filter(|(_, part)| **part != "-") {
                let name = found.get(bone).map(|joint| all[*joint]);
                assert!(name.is_some_and(|name| name == *part), "{convention}, {bone}: {name:?} in {names:?}");
            }
        }
    }
}

#[test]
fn a_prefix_and_a_suffix_of_any_spelling_are_removed() {
    let stems = "Hips Spine Neck Head LeftArm LeftForeArm LeftHand RightArm RightForeArm RightHand";
    for [prefix, suffix] in
        [["mixamorig", ""], ["mixamorig_", ""], ["Armature|", ""], ["The Hero 2 ", ""], ["", "_jnt"], ["rig:", "Bone"]]
    {
        let names: Vec<String> = stems.split(' ').map(|stem| format!("{prefix}{stem}{suffix}")).collect();
        // Joints outside the mapped part have neither.
        let names: Vec<&str> = ["Camera", "Light_01"].into_iter().chain(names.iter().map(String::as_str)).collect();
        let found = match_names(&names);
        for (k, stem) in stems.split(' ').enumerate() {
            assert_eq!(found.get(stem), Some(&(k + 2)), "{prefix} {suffix}: {stem}");
        }
    }
    assert_eq!(
        find(&["Neck", "", "LeftLeg", "Tail"]),
        [Some(0), None, None, None, None, None, None, None, None, Some(2)]
    );
    assert!(match_names(&["", "Bone1", "Bone2"]).is_empty());
}
