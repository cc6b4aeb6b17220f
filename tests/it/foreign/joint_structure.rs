//! Joints of foreign skeletons without known names are matched by the structure of the skeleton.

use orator_base::math::vec3::Vec3;
use orator_formats::skeleton::matched::{MatchJoint, MatchedJoints};

/// Joints of a person: index of the parent, our bone (empty for others), and offset in cm.
const PERSON: [(usize, &str, Vec3); 25] = [
    (0, "", [0.0, 0.0, 0.0]),
    (0, "Hips", [0.0, 95.0, 0.0]),
    (1, "Spine", [0.0, 10.0, 0.0]),
    (2, "", [0.0, 20.0, 0.0]),
    (3, "Neck", [0.0, 22.0, 0.0]),
    (4, "Head", [0.0, 9.0, 2.0]),
    (5, "", [3.0, 9.0, 8.0]),
    (5, "", [-3.0, 9.0, 8.0]),
    (3, "RightShoulder", [-4.0, 15.0, 0.0]),
    (8, "RightArm", [-13.0, 0.0, 0.0]),
    (9, "RightForeArm", [-28.0, 0.0, 0.0]),
    (10, "RightHand", [-25.0, 0.0, 0.0]),
    (3, "LeftShoulder", [4.0, 15.0, 0.0]),
    (12, "LeftArm", [13.0, 0.0, 0.0]),
    (13, "LeftForeArm", [28.0, 0.0, 0.0]),
    (13, "", [14.0, 0.0, 0.0]),
    (14, "LeftHand", [25.0, 0.0, 0.0]),
    (1, "LeftUpLeg", [9.0, -5.0, 0.0]),
    (17, "LeftLeg", [0.0, -42.0, 0.0]),
    (18, "LeftFoot", [0.0, -40.0, 0.0]),
    (19, "", [0.0, -8.0, 14.0]),
    (1, "RightUpLeg", [-9.0, -5.0, 0.0]),
    (21, "RightLeg", [0.0, -42.0, 0.0]),
    (22, "RightFoot", [0.0, -40.0, 0.0]),
    (23, "", [0.0, -8.0, 14.0]),
];
const REQUIRED: [&str; 2] = ["Hips", "LeftHand"];

/// Joints of the person with `axes` applied to each position.
fn person<'a>(names: &'a [String], axes: impl Fn(Vec3) -> Vec3) -> Vec<MatchJoint<'a>> {
    let mut positions: Vec<Vec3> = Vec::new();
    for (n, (parent, _, offset)) in PERSON.iter().enumerate() {
        let from = if n == 0 { [0.0; 3] } else { positions[*parent] };
        positions.push(std::array::from_fn(|k| from[k] + offset[k]));
    }
    let joint = |(n, name): (usize, &'a String)| MatchJoint {
        name,
        parent: (n > 0).then_some(PERSON[n].0),
        position: axes(positions[n]),
        moves: ![6, 7, 20, 24].contains(&n),
    };
    names.iter().enumerate().map(joint).collect()
}

#[test]
fn unknown_names_are_matched_by_structure_in_any_axes() {
    let names: Vec<String> = (0..PERSON.len()).map(|n| format!("bone{n:03}")).collect();
    let axes: [fn(Vec3) -> Vec3; 4] =
        [|v| v, |[x, y, z]| [x, -z, y], |[x, y, z]| [-x, y, -z], |[x, y, z]| [z / 100.0, y / 100.0, -x / 100.0]];
    for axes in axes {
        let found = MatchedJoints::by_name(&person(&names, axes), &REQUIRED);
        for (n, (_, own, _)) in PERSON.iter().enumerate().filter(|(_, (_, own, _))| !own.is_empty()) {
            assert_eq!(found.joints.get(*own), Some(&n), "{own} in {found:?}");
        }
        assert_eq!((found.joints.len(), found.by_structure.len()), (18, 18), "{found:?}");
    }
}

#[test]
fn names_come_first_and_determine_the_sides() {
    let name = |(n, (_, own, _)): (usize, &(usize, &str, Vec3))| match *own {
        "LeftForeArm" => "RightForeArm".to_owned(),
        "LeftHand" => "RightHand".to_owned(),
        _ => format!("bone{n:03}"),
    };
    let names: Vec<String> = PERSON.iter().enumerate().map(name).collect();
    let found = MatchedJoints::by_name(&person(&names, |v| v), &REQUIRED);
    assert_eq!((found.joints["RightForeArm"], found.joints["RightArm"], found.joints["LeftHand"]), (14, 13, 11));
    assert!(found.by_structure.contains("RightArm") && !found.by_structure.contains("RightForeArm"));
    // Nothing required is missing: the structure is not used.
    assert_eq!(MatchedJoints::by_name(&person(&names, |v| v), &["RightHand"]).joints.len(), 2);
}

#[test]
fn skeletons_without_two_arms_or_without_sides_are_not_matched() {
    let names: Vec<String> = (0..PERSON.len()).map(|n| format!("bone{n:03}")).collect();
    let mut joints = person(&names, |v| v);
    joints.iter_mut().for_each(|joint| joint.position = [0.0; 3]);
    assert!(MatchedJoints::by_name(&joints, &REQUIRED).joints.is_empty());
    let chain: Vec<MatchJoint> = (0..40)
        .map(|n| MatchJoint {
            name: "bone",
            parent: (n > 0).then(|| n - 1),
            position: [0.0, n as f64, f64::NAN],
            moves: true,
        })
        .collect();
    assert!(MatchedJoints::by_name(&chain, &REQUIRED).joints.is_empty());
    assert!(MatchedJoints::by_name(&[], &REQUIRED).joints.is_empty());
}
