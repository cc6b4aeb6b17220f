//! Rotations of a BVH file as exponential maps, and back.

use anyhow::Result;
use orator_base::math::vec3::{norm, sub};
use orator_formats::bvh::exponential_maps::{ExponentialMaps, JOINTS, JointMapping};
use orator_formats::bvh::read::Bvh;

/// A skeleton with the joints of GENEA plus hips, legs and fingers, whose angles oscillate; channel order as in
/// the GENEA captures. `legs` scales the motion of the joints that are not features.
fn captured(n_frames: usize, frame_secs: f64, legs: f64) -> Bvh {
    let six = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation";
    let three = "CHANNELS 3 Zrotation Xrotation Yrotation";
    let mut text = format!("HIERARCHY\nROOT Hips\n{{\nOFFSET 0 90 0\n{six}\n");
    let chain = |names: &[&str], step: &str| -> String {
        let open: String = names.iter().map(|name| format!("JOINT {name}\n{{\nOFFSET {step}\n{three}\n")).collect();
        format!("{open}End Site\n{{\nOFFSET {step}\n}}\n{}", "}\n".repeat(names.len()))
    };
    text += &chain(&["LeftUpLeg", "LeftLeg"], "0 -40 0");
    for name in ["Spine", "Spine1", "Spine2", "Spine3"] {
        text += &format!("JOINT {name}\n{{\nOFFSET 0 12 0\n{three}\n");
    }
    text += &chain(&["Neck", "Neck1", "Head"], "0 8 0");
    text += &chain(&["RightShoulder", "RightArm", "RightForeArm", "RightHand", "RightHandIndex1"], "-20 0 0");
    text += &chain(&["LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand", "LeftHandIndex1"], "20 0 0");
    text += &"}\n".repeat(5);
    text += &format!("MOTION\nFrames: {n_frames}\nFrame Time: {frame_secs}\n");
    let names = Bvh::parse(&text.replace(&format!("Frames: {n_frames}"), "Frames: 0")).unwrap().joints;
    for t in 0..n_frames {
        let mut numbers = vec![0.0; 6];
        for (i, joint) in names.iter().enumerate().skip(1).filter(|(_, joint)| !joint.channels.is_empty()) {
            let is_feature = JOINTS.contains(&joint.name.as_str());
            let wide = if is_feature { 1.0 } else { legs };
            let far = if joint.name == "LeftArm" { 170.0 } else { 35.0 };
            let secs = t as f64 * frame_secs;
            for k in 0..3 {
                let at = (1.0 + 0.1 * i as f64) * secs + f64::from(k);
                numbers.push(wide * if k == 1 { 30.0 } else { far } * at.sin());
            }
        }
        let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
        text += &(numbers.join(" ") + "\n");
    }
    Bvh::parse(&text).unwrap()
}

fn fitted(files: &[Bvh], mapping: &JointMapping) -> Result<ExponentialMaps> {
    let file = |(i, file): (usize, &Bvh)| Ok((format!("{i}.bvh"), file.clone()));
    ExponentialMaps::of(files.iter().enumerate().map(file), mapping)
}

#[test]
fn round_trip_preserves_joint_positions() {
    let bvh = captured(301, 1.0 / 60.0, 0.0);
    let maps = fitted(std::slice::from_ref(&bvh), &JointMapping::default()).unwrap();
    maps.check().unwrap();
    assert_eq!(maps.n_columns(), 45);
    let first: Vec<&str> = maps.joints.iter().take(4).map(|&joint| maps.skeleton.joints[joint].name.as_str()).collect();
    assert_eq!(first, ["LeftHand", "LeftForeArm", "LeftArm", "LeftShoulder"]);
    let features = maps.features(&bvh).unwrap();
    assert_eq!(features.dim(), (100, 45));
    assert!(features.iter().all(|v| v.abs() <= 2.0));
    let back = Bvh::parse(&maps.to_bvh(features.view())).unwrap();
    assert_eq!((back.n_frames, back.joints.len()), (100, bvh.joints.len()));
    let known: Vec<&[f64]> = bvh.frames().step_by(3).collect();
    let mut worst: f64 = 0.0;
    for (t, frame) in back.frames().enumerate() {
        for (a, b) in maps.skeleton.positions(frame).into_iter().zip(maps.skeleton.positions(known[t])) {
            worst = worst.max(10.0 * norm(sub(a, b)));
        }
    }
    assert!(worst < 0.05, "{worst} mm");
}

#[test]
fn hips_and_other_joints_stay_fixed() {
    let bvh = captured(61, 1.0 / 60.0, 1.0);
    let maps = fitted(std::slice::from_ref(&bvh), &JointMapping::default()).unwrap();
    let channels = maps.channels(maps.features(&bvh).unwrap().view());
    let first: Vec<f64> = bvh.frames().next().unwrap().to_vec();
    let knee = maps.skeleton.first_channels()[2];
    for frame in &channels {
        assert_eq!(frame[..6], [0.0; 6]);
        assert_eq!(frame[knee..knee + 3], first[knee..knee + 3]);
    }
    let at_24 = captured(49, 1.0 / 24.0, 0.0);
    let (a, b) = (maps.features(&at_24).unwrap(), maps.features(&captured(121, 1.0 / 60.0, 0.0)).unwrap());
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 0.02, "{a} {b}");
    }
}

#[test]
fn joint_mapping_handles_other_skeletons() {
    let bvh = captured(31, 1.0 / 60.0, 0.0);
    let parse = |entries: &[&str]| JointMapping::parse(&entries.iter().map(|e| (*e).to_owned()).collect::<Vec<_>>());
    let fewer = parse(&["Spine3=", "Neck1="]).unwrap();
    assert_eq!(fitted(std::slice::from_ref(&bvh), &fewer).unwrap().n_columns(), 39);
    let error_of = |mapping: &JointMapping| format!("{:#}", fitted(std::slice::from_ref(&bvh), mapping).unwrap_err());
    let text = error_of(&parse(&["Spine3=Chest"]).unwrap());
    assert!(text.contains("no joint Chest") && text.contains("Spine3=NAME") && text.contains("LeftUpLeg"), "{text}");
    assert!(error_of(&parse(&["Spine3=Spine2"]).unwrap()).contains("mapped to two joints"));
    assert!(parse(&["Spine3"]).is_err() && parse(&["Tail=Tail"]).is_err());
    let mut other = bvh.clone();
    other.joints[2].name = "Knee".into();
    let text = format!("{:#}", fitted(&[bvh.clone(), other], &parse(&[]).unwrap()).unwrap_err());
    assert!(text.contains("other joints"), "{text}");
    let mut broken = bvh.clone();
    broken.values[bvh.n_channels + 7] = f64::NAN;
    let text = format!("{:#}", fitted(&[bvh, broken], &parse(&[]).unwrap()).unwrap_err());
    assert!(text.contains("frame 1 ") && text.contains("1.bvh"), "{text}");
}
