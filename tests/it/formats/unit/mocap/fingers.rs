//! Tests of `orator_formats::mocap::fingers`.

use orator_base::types::skeleton::Side;
use orator_formats::bvh::read::Bvh;
use orator_formats::mocap::fingers::{hand, matched_hand, parse_name};
use orator_formats::skeleton::joint_names::match_names;

#[test]
fn joint_names_of_common_rigs_are_parsed() {
    let left = |finger| Some((Side::Left, finger));
    for (name, meant) in [
        ("mixamorig:LeftHandThumb1", left(0)),
        ("LeftHandIndex3_end", left(1)),
        ("LeftInHandMiddle", left(2)),
        ("b_l_ring0", left(3)),
        ("l_pinky_1", left(4)),
        ("LThumb1", left(0)),
        ("lthumb1", left(0)),
        ("lMid1", left(2)),
        ("CC_Base_L_Index1", left(1)),
        ("thumb_01_l", left(0)),
        ("Left Little Proximal", left(4)),
        ("RightHandPinky", Some((Side::Right, 4))),
        ("r.ring.2", Some((Side::Right, 3))),
        ("LeftHand", None),
        ("LeftToeIndex", None),
        ("SpineMiddle", None),
        ("String", None),
        ("Thumb", None),
    ] {
        assert_eq!(parse_name(name), meant, "{name}");
    }
}

/// A left hand: a thumb of three joints; an index finger with a metacarpal joint; a middle finger of four joints,
/// the last bone without length; no other end sites.
const HAND: &str = "HIERARCHY ROOT Hips { OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT LeftHand { OFFSET 50 0 0 CHANNELS 0
      JOINT LeftHandThumb1 { OFFSET 3 0 2 CHANNELS 0 JOINT LeftHandThumb2 { OFFSET 4 0 1 CHANNELS 0
        JOINT LeftHandThumb3 { OFFSET 3 0 0 CHANNELS 0 End Site { OFFSET 2 0 0 } } } }
      JOINT LeftHandIndex { OFFSET 3 0 1 CHANNELS 0 JOINT LeftHandIndex1 { OFFSET 6 0 1 CHANNELS 0
        JOINT LeftHandIndex2 { OFFSET 4 0 0 CHANNELS 0 JOINT LeftHandIndex3 { OFFSET 2 0 0 CHANNELS 0
        End Site { OFFSET 2 0 0 } } } } }
      JOINT LeftHandMiddle1 { OFFSET 9 0 0 CHANNELS 0 JOINT LeftHandMiddle2 { OFFSET 4.5 0 0 CHANNELS 0
        JOINT LeftHandMiddle3 { OFFSET 2.5 0 0 CHANNELS 0 JOINT LeftHandMiddle4 { OFFSET 0 0 0 CHANNELS 0
        End Site { OFFSET 0 0 0 } } } } } } }
    MOTION Frames: 2 Frame Time: 0.04 0 0 0 90 0 0";

#[test]
fn hand_joints_are_ordered_by_finger() {
    let bvh = Bvh::parse(HAND).unwrap();
    let named = hand(&bvh, Side::Left).unwrap().map(|joint| joint.map(|joint| bvh.joints[joint].name.as_str()));
    assert_eq!((named[0], named[4]), (Some("LeftHand"), Some("LeftHandThumb3_end")));
    assert_eq!(named[5], Some("LeftHandIndex1"), "the joint in the palm is no knuckle");
    let ends = (named[11], named[12], named[13]);
    assert_eq!(ends, (Some("LeftHandMiddle3"), None, None), "a bone without length ends nowhere");
    assert_eq!(hand(&bvh, Side::Right), None);
    assert_eq!(hand(&Bvh::parse(&HAND.replace("LeftHand", "Tail")).unwrap(), Side::Left), None);

    // Fingers with numbers instead of names.
    let numbers = [("LeftHandThumb", "LeftFinger1-"), ("LeftHandMiddle", "LeftFinger3-")];
    let numbered = numbers.iter().fold(HAND.to_owned(), |text, (name, number)| text.replace(name, number));
    let numbered = Bvh::parse(&numbered.replace("LeftHandIndex", "Tail")).unwrap();
    assert_eq!(hand(&numbered, Side::Left), None);
    let names: Vec<&str> = numbered.joints.iter().map(|joint| joint.name.as_str()).collect();
    let bones = match_names(&names);
    let joints = matched_hand(&numbered, &bones, Side::Left).unwrap();
    let named = joints.map(|joint| joint.map(|joint| names[joint]));
    assert_eq!(
        named[..5],
        ["LeftHand", "LeftFinger1-1", "LeftFinger1-2", "LeftFinger1-3", "LeftFinger1-3_end"].map(Some)
    );
    assert_eq!((named[5], named[9]), (None, Some("LeftFinger3-1")));
    assert_eq!(matched_hand(&numbered, &bones, Side::Right), None);
}
