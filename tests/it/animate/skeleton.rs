//! Skeletons of other programs: a file with other joint names, without a neck, with matrices or with the humanoid of
//! VRM gives the result of the original file.

use super::animate_verb::{animate, done};
use super::captured_body::capture;
use crate::fixtures::animation::gltf::{Glb, written};
use crate::fixtures::figures::{FPS, swinging};
use crate::foreign::retargeted::{glb_file, glb_with_armature};
use ndarray::{Array3, ArrayView1, s};
use orator_avatar::animate::retarget::bone_map::BoneMap;
use orator_avatar::animate::retarget::retargeted::RetargetRig;
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::{AnimationOptions, Constraints, Performance, Smoothing, perform};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, norm, scale, sub};
use orator_base::types::skeleton::{L_SHOULDER, NECK, R_SHOULDER};
use orator_formats::mocap::motion_file;
use orator_formats::npy;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const ARMS: [&str; 6] = ["LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm", "RightHand"];

fn motion() -> Performance {
    let exact =
        AnimationOptions { smoothing: Smoothing::None, constraints: Constraints::NONE, ..AnimationOptions::default() };
    perform(&swinging(4, 12), None, &exact)
}

/// A BVH file whose joints have other names.
fn renamed(text: &str, rename: impl Fn(usize, &str) -> String) -> String {
    let mut n_joints = 0;
    let mut line = |line: &str| match line.trim().split_once(' ') {
        Some((kind @ ("ROOT" | "JOINT"), name)) => {
            n_joints += 1;
            format!("{kind} {}\n", rename(n_joints, name))
        }
        _ => format!("{line}\n"),
    };
    text.lines().map(&mut line).collect()
}

/// Joints [T, 49, 3] and notes of a BVH file.
fn read(folder: &Path, text: &str) -> (Array3<f32>, Vec<String>) {
    let path = folder.join("take.bvh");
    std::fs::write(&path, text).unwrap();
    let read = motion_file::read(&path, None).unwrap();
    (read.motion.joints, read.notes)
}

/// The joint in the convention of another program: prefix, names of the arms, suffix.
fn translated(prefix: &str, own: &str, side: [&str; 2], parts: &[(&str, &str)], suffix: &str) -> String {
    let sides = [("Left", side[0]), ("Right", side[1])];
    let (part, side) =
        sides.iter().find_map(|(name, side)| Some((own.strip_prefix(*name)?, *side))).unwrap_or((own, ""));
    let part = parts.iter().find(|(known, _)| *known == part).map_or(part, |(_, other)| *other);
    format!("{prefix}{side}{part}{suffix}")
}

#[test]
fn a_bvh_of_any_convention_gives_the_joints_of_the_original() {
    let folder = tempfile::tempdir().unwrap();
    let text = motion().clip.to_bvh();
    let (expected, notes) = read(folder.path(), &text);
    assert!(notes.is_empty(), "{notes:?}");
    let words = ["Left", "Right"];
    let vroid = [("Arm", "UpperArm"), ("ForeArm", "LowerArm"), ("UpLeg", "UpperLeg"), ("Leg", "LowerLeg")];
    let smpl =
        [("Arm", "shoulder"), ("ForeArm", "elbow"), ("Hand", "wrist"), ("Shoulder", "collar"), ("Hips", "Pelvis")];
    type Parts<'a> = &'a [(&'a str, &'a str)];
    let conventions: [(&str, [&str; 2], Parts, &str); 6] = [
        ("Character1_", words, &[], ""),
        ("mixamorig", words, &[], ""),
        ("Take_7.", words, &[], ""),
        ("", ["l_", "r_"], &[], "_JNT"),
        ("J_Bip_", ["L_", "R_"], &vroid, ""),
        ("m_avg_", ["L_", "R_"], &smpl, ""),
    ];
    for (prefix, sides, parts, suffix) in conventions {
        let other = renamed(&text, |_, own| translated(prefix, own, sides, parts, suffix));
        let (joints, notes) = read(folder.path(), &other);
        assert!(joints == expected && notes.is_empty(), "{prefix} {suffix}: {notes:?}");
        let numbered = renamed(&text, |n, own| translated(prefix, own, sides, parts, suffix) + &format!("_{n:03}"));
        assert!(read(folder.path(), &numbered).0 == expected, "{prefix} {suffix} with numbers");
    }
}

#[test]
fn a_neck_that_is_missing_is_the_middle_of_the_shoulders() {
    let folder = tempfile::tempdir().unwrap();
    let text = motion().clip.to_bvh();
    let (expected, _) = read(folder.path(), &text);
    let (joints, notes) = read(folder.path(), &text.replace("Neck", "Pole"));
    assert!(notes.len() == 1 && notes[0].contains("the middle of the shoulders"), "{notes:?}");
    for (frame, original) in joints.outer_iter().zip(expected.outer_iter()) {
        let middle = (&original.row(L_SHOULDER) + &original.row(R_SHOULDER)) / 2.0;
        let is_close = |a: ArrayView1<f32>, b: ArrayView1<f32>| (&a - &b).iter().all(|v| v.abs() < 1e-5);
        for (joint, position) in frame.outer_iter().enumerate().filter(|(joint, _)| *joint != NECK) {
            assert!(is_close(position, (&original.row(joint) - &middle).view()), "joint {joint}: {position}");
        }
        assert!(frame.row(NECK).iter().all(|v| *v == 0.0));
    }
    // An animation of rigid shoulders has these joints, the trunk and the head of the capture, and the note.
    let (joints, _) = read(folder.path(), &capture(true).to_bvh().replace("Neck", "Pole"));
    let facts = done(folder.path(), "take.bvh --out out.npy --smoothing none --no-constraints");
    assert_eq!(facts["report"]["captured"], json!(["head", "spine", "legs"]));
    assert!(facts["notes"][0].as_str().unwrap().contains("no neck"), "{facts}");
    let animated = npy::read(&folder.path().join("out.npy"), FPS).unwrap().joints;
    let difference = &animated.slice(s![.., 1..7, ..]) - &joints.slice(s![.., 1..7, ..]);
    let worst = difference.iter().fold(0.0f32, |worst, v| worst.max(v.abs()));
    assert!(worst < 1e-4, "{worst} m");
}

#[test]
fn a_bvh_with_unknown_names_is_read_by_its_structure() {
    let folder = tempfile::tempdir().unwrap();
    let text = motion().clip.to_bvh();
    let (expected, _) = read(folder.path(), &text);
    let (joints, notes) = read(folder.path(), &renamed(&text, |n, _| format!("osso{n}")));
    assert!(notes.len() == 1 && notes[0].contains("LeftForeArm = osso"), "{notes:?}");
    assert_eq!(joints.slice(s![.., ..7, ..]), expected.slice(s![.., ..7, ..]));
    let facts = done(folder.path(), "take.bvh --out out.npy");
    assert_eq!(facts["report"]["captured"], json!(["head", "spine", "legs"]));
}

/// Moved joints of a GLB file, by frame and joint, and the map that was found.
fn moved(path: &Path, performance: &Performance) -> (Vec<Vec<Vec3>>, BoneMap) {
    let rig = RetargetRig::open(path).unwrap();
    let map = BoneMap::detect(rig.rig()).unwrap();
    let (frames, _) = rig.moved(performance, &map).unwrap();
    (frames.iter().map(|local| rig.rig().positions(local)).collect(), map)
}

/// A changed copy of a GLB file.
fn changed(path: &Path, name: &str, change: impl FnOnce(&mut Value)) -> PathBuf {
    let Glb { mut scene, bytes } = Glb::read(path);
    change(&mut scene);
    let path = path.with_file_name(name);
    std::fs::write(&path, glb_file(&scene, &bytes)).unwrap();
    path
}

fn nodes(scene: &mut Value) -> impl Iterator<Item = (usize, &mut Value)> {
    scene["nodes"].as_array_mut().unwrap().iter_mut().enumerate()
}

fn worst(found: &[Vec<Vec3>], expected: &[Vec<Vec3>]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let pairs = found.iter().flatten().zip(expected.iter().flatten());
    pairs.fold(0.0, |worst, (a, b)| norm(sub(*a, *b)).max(worst))
}

fn numbers<const N: usize>(value: &Value, default: [f64; N]) -> [f64; N] {
    if value.is_null() { default } else { std::array::from_fn(|k| value[k].as_f64().unwrap()) }
}

#[test]
fn nodes_with_matrices_move_like_nodes_with_rotations() {
    let folder = tempfile::tempdir().unwrap();
    let performance = motion();
    let original = glb_with_armature(folder.path());
    let (expected, map) = moved(&original, &performance);
    let with_matrices = changed(&original, "matrices.glb", |scene| {
        for (_, node) in nodes(scene) {
            let [x, y, z, w] = numbers(&node["rotation"], [0.0, 0.0, 0.0, 1.0]);
            let factors = numbers(&node["scale"], [1.0; 3]);
            let axes = Rotation { w, v: [x, y, z] }.axes();
            let mut columns: Vec<f64> =
                (0..3).flat_map(|k| scale(axes[k], factors[k]).into_iter().chain([0.0])).collect();
            columns.extend(numbers(&node["translation"], [0.0; 3]).into_iter().chain([1.0]));
            let node = node.as_object_mut().unwrap();
            ["rotation", "scale", "translation"].iter().for_each(|key| drop(node.remove(*key)));
            node.insert("matrix".to_owned(), json!(columns));
        }
    });
    let (found, found_map) = moved(&with_matrices, &performance);
    assert!(worst(&found, &expected) < 1e-6 && found_map == map, "{} m", worst(&found, &expected));
    let out = folder.path().join("out.glb");
    RetargetRig::open(&with_matrices).unwrap().write(&out, &performance, &map).unwrap();
    let glb = Glb::read(&out);
    let targets = glb.scene["animations"][0]["channels"].as_array().unwrap();
    let is_moved = |node: usize| targets.iter().any(|channel| channel["target"]["node"] == node);
    for node in 0..glb.scene["nodes"].as_array().unwrap().len() {
        assert_eq!(glb.node(node).get("matrix").is_none(), is_moved(node), "node {node}");
        assert_eq!(glb.node(node).get("translation").is_some(), is_moved(node), "node {node}");
    }
    // The written file has the rest pose of the original.
    let (again, _) = moved(&out, &performance);
    assert!(worst(&again, &expected) < 1e-6);
}

#[test]
fn uneven_scale_matters_on_mapped_bones_and_their_ancestors_only() {
    let folder = tempfile::tempdir().unwrap();
    let performance = motion();
    let original = glb_with_armature(folder.path());
    let (expected, _) = moved(&original, &performance);
    let scaled = |target: &str, factors: Vec3| {
        changed(&original, "scaled.glb", |scene| {
            let props = json!([{ "name": "Hat", "scale": [1.0, 3.0, 1.0] }, { "matrix": [
                -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0] }]);
            let all = scene["nodes"].as_array_mut().unwrap();
            all.extend(props.as_array().unwrap().iter().cloned());
            let node = all.iter_mut().find(|node| node["name"].as_str().is_some_and(|name| name.ends_with(target)));
            node.unwrap()["scale"] = json!(factors);
        })
    };
    let (found, _) = moved(&scaled("Hat", [2.0, -1.0, 1.0]), &performance);
    let n_joints = expected[0].len();
    let found: Vec<Vec<Vec3>> = found.into_iter().map(|frame| frame[..n_joints].to_vec()).collect();
    assert!(worst(&found, &expected) < 1e-9);
    for (target, factors) in [("Armature", [0.01, 0.01, 0.02]), ("LeftForeArm", [-1.0; 3])] {
        let rig = RetargetRig::open(&scaled(target, factors)).unwrap();
        let error = BoneMap::detect(rig.rig()).unwrap_err().to_string();
        assert!(error.contains("scale") && error.contains(target) && error.contains("uniform positive"), "{error}");
    }
}

#[test]
fn a_glb_of_any_names_and_a_humanoid_move_like_the_original() {
    let folder = tempfile::tempdir().unwrap();
    let performance = motion();
    let (_, original) = written(folder.path(), 0, Names::Own);
    let (expected, map) = moved(&original, &performance);
    let named = |rename: &dyn Fn(usize, &str) -> String, name: &str| {
        changed(&original, name, |scene| {
            for (n, node) in nodes(scene) {
                node["name"] = json!(rename(n, node["name"].as_str().unwrap_or_default()));
            }
        })
    };
    let files = [
        named(&|n, own| format!("mixamorig:{own}_{n:02}"), "sketchfab.glb"),
        named(&|_, own| format!("mixamorig_{own}"), "godot.glb"),
        named(&|_, own| format!("Actor {own} jnt"), "both.glb"),
    ];
    for path in files {
        let (found, found_map) = moved(&path, &performance);
        assert!(found == expected && found_map == map, "{}", path.display());
    }
    // VRM states the bones; the names of its nodes have no meaning.
    let (_, avatar) = written(folder.path(), 0, Names::Vrm);
    let (expected, map) = moved(&avatar, &performance);
    let unnamed = |scene: &mut Value| nodes(scene).for_each(|(n, node)| node["name"] = json!(format!("N{n}")));
    let current = changed(&avatar, "current.vrm", unnamed);
    let former = changed(&avatar, "former.vrm", |scene| {
        unnamed(scene);
        let bones = scene["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"].as_object().unwrap().clone();
        let former = |bone: &str| bone.replace("ThumbProximal", "ThumbIntermediate").replace("Metacarpal", "Proximal");
        let bones = bones.iter().map(|(bone, node)| json!({ "bone": former(bone), "node": node["node"] }));
        scene["extensions"] = json!({ "VRM": { "humanoid": { "humanBones": bones.collect::<Vec<_>>() } } });
    });
    for path in [current, former] {
        let (found, found_map) = moved(&path, &performance);
        assert!(found == expected && found_map == map, "{}", path.display());
    }
    // Without the extension the structure shows the arms, and the map marks them.
    let without = changed(&avatar, "unnamed.glb", |scene| {
        unnamed(scene);
        scene["extensions"] = json!({});
    });
    let (_, found) = moved(&without, &performance);
    assert!(ARMS.iter().all(|bone| found.joint(bone) == map.joint(bone)), "{found:?}");
    let text = found.text(RetargetRig::open(&without).unwrap().rig(), &performance.rig.skeleton);
    assert!(text.contains("# found by structure") && found.notes()[0].contains("check the bone map"), "{text}");
}

#[test]
fn a_draft_of_the_map_is_written_if_a_bone_is_not_found() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    npy::write(&dir.join("a.npy"), &swinging(1, 8)).unwrap();
    done(dir, "a.npy --out rig.bvh avatar.vrm");
    // A VRM avatar is written with the animation.
    let facts = done(dir, "a.npy --retarget avatar.vrm --out moved.vrm moved.glb");
    assert!(!facts["notes"].to_string().contains("skeleton"), "{facts}");
    assert!(Glb::read(&dir.join("moved.vrm")).scene["animations"][0]["channels"].is_array());
    // One forearm has an unknown name and another length than the other.
    let text = std::fs::read_to_string(dir.join("rig.bvh")).unwrap().replace("LeftForeArm", "Crank");
    let (head, rest) = text.split_once("JOINT LeftHand\n").unwrap();
    let (_, rest) = rest.split_once("CHANNELS").unwrap();
    let text = format!("{head}JOINT LeftHand\n{{\nOFFSET 3 0 0\nCHANNELS{rest}");
    std::fs::write(dir.join("odd.bvh"), text).unwrap();
    let (code, _, errors) = animate(dir, "a.npy --retarget odd.bvh --out x.bvh --write-bone-map bones.toml");
    assert!(code == 1 && errors.contains("no joint found for LeftForeArm"), "{errors}");
    let draft = std::fs::read_to_string(dir.join("bones.toml")).unwrap();
    assert!(draft.contains("# LeftForeArm = \"\"") && draft.contains("# Joints without a bone: \"Crank\""), "{draft}");
    std::fs::write(dir.join("bones.toml"), draft.replace("# LeftForeArm = \"\"", "LeftForeArm = \"Crank\"")).unwrap();
    done(dir, "a.npy --retarget odd.bvh --out x.bvh --bone-map bones.toml");
}
