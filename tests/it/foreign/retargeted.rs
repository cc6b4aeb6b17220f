//! Motion retargeted to external skeletons: Blender and the program's forward kinematics agree on the joint positions,
//! and the wrists have the source's positions relative to the shoulders.

use crate::fixtures::animation::gltf::{Glb, written};
use crate::fixtures::figures::{FPS, swinging};
use orator_avatar::animate::retarget::bone_map::BoneMap;
use orator_avatar::animate::retarget::retargeted::RetargetRig;
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::{AnimationOptions, Performance, perform};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, norm, scale, sub};
use orator_test_support::skip::blender;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const BVH: &str = "fixtures/reference/bvh_take.bvh";

fn motion() -> Performance {
    perform(&swinging(5, 12), None, &AnimationOptions::default())
}

/// GLB of the built-in avatar in centimetres, under a root node that scales and rotates it, as exporters write it.
pub(crate) fn glb_with_armature(folder: &Path) -> PathBuf {
    let (_, path) = written(folder, 0, Names::Mixamo);
    let Glb { mut scene, bytes } = Glb::read(&path);
    for node in scene["nodes"].as_array_mut().unwrap() {
        for k in 0..3 {
            if let Some(offset) = node["translation"][k].as_f64() {
                node["translation"][k] = json!(100.0 * offset);
            }
        }
    }
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let armature = scene["nodes"].as_array().unwrap().len();
    let node = json!({ "name": "Armature", "children": [0], "scale": [0.01, 0.01, 0.01], "rotation": [0.0, half, 0.0, half],
        "translation": [0.5, 0.0, 1.0] });
    scene["nodes"].as_array_mut().unwrap().push(node);
    scene["scenes"][0]["nodes"][0] = json!(armature);
    let path = folder.join("armature.glb");
    std::fs::write(&path, glb_file(&scene, &bytes)).unwrap();
    path
}

/// Bytes of a GLB file with this scene and binary chunk.
pub(crate) fn glb_file(scene: &Value, bytes: &[u8]) -> Vec<u8> {
    let mut text = scene.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = b"glTF".to_vec();
    for word in [2, 28 + text.len() + bytes.len(), text.len()] {
        file.extend((word as u32).to_le_bytes());
    }
    file.extend(b"JSON");
    file.extend(&text);
    file.extend((bytes.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(bytes);
    file
}

#[test]
fn static_nodes_need_no_memory_per_frame_and_too_many_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let (_, avatar) = written(folder.path(), 0, Names::Mixamo);
    let with_nodes = |n: usize| {
        let Glb { mut scene, bytes } = Glb::read(&avatar);
        let more = (0..n).map(|k| json!({ "name": format!("prop {k}") }));
        scene["nodes"].as_array_mut().unwrap().extend(more);
        let path = folder.path().join(format!("{n}.glb"));
        std::fs::write(&path, glb_file(&scene, &bytes)).unwrap();
        path
    };
    let performance = perform(&swinging(5, 600), None, &AnimationOptions::default());
    let rig = RetargetRig::open(&with_nodes(9_000)).unwrap();
    let map = BoneMap::detect(rig.rig()).unwrap();
    let out = folder.path().join("moved.glb");
    let memory = allocation_counter::measure(|| rig.write(&out, &performance, &map).unwrap());
    // Rotations of all nodes in all frames would need 165 MiB.
    assert!(memory.bytes_max < 80 << 20, "{} bytes", memory.bytes_max);
    let moved = Glb::read(&out);
    let channels = moved.scene["animations"][0]["channels"].as_array().unwrap();
    assert!((40..100).contains(&channels.len()), "{} channels", channels.len());
    let error = format!("{:#}", RetargetRig::open(&with_nodes(10_000)).unwrap_err());
    assert!(error.contains("10000.glb") && error.contains("nodes, expected at most 10000"), "{error}");
}

#[test]
fn blender_agrees_with_forward_kinematics_on_joint_positions() {
    let Some(_) = blender() else { return };
    let folder = tempfile::tempdir().unwrap();
    let performance = motion();
    // The second value converts to millimetres; positions of the BVH are relative to its root.
    for (skeleton_file, mm) in [(PathBuf::from(BVH), 10.0), (glb_with_armature(folder.path()), 1000.0)] {
        let rig = RetargetRig::open(&skeleton_file).unwrap();
        let map = BoneMap::detect(rig.rig()).unwrap();
        let out = folder.path().join("moved").with_extension(skeleton_file.extension().unwrap());
        rig.write(&out, &performance, &map).unwrap();
        let (frames, moves) = rig.moved(&performance, &map).unwrap();
        assert!(moves.iter().filter(|moves| **moves).count() >= 40);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/blender_joints.py");
        let output = blender().unwrap().arg(script).arg(&out).arg(FPS.num.to_string()).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let scene: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(scene["frames"].as_array().unwrap().len(), frames.len());
        let mut worst: f64 = 0.0;
        for (t, local) in frames.iter().enumerate() {
            let position = |joint: usize| -> Vec3 {
                let name = &rig.rig().joints[joint].name;
                std::array::from_fn(|k| scene["frames"][t][name][0][k].as_f64().unwrap_or(f64::NAN))
            };
            let expected = rig.rig().positions(local);
            let moving: Vec<usize> = (0..expected.len()).filter(|&joint| rig.rig().joints[joint].moves).collect();
            let root_offset = if mm < 100.0 { sub(position(moving[0]), expected[moving[0]]) } else { [0.0; 3] };
            for joint in moving {
                let error = mm * norm(sub(position(joint), add(expected[joint], root_offset)));
                assert!(error.is_finite(), "no joint {}", rig.rig().joints[joint].name);
                worst = worst.max(error);
            }
        }
        eprintln!("{}: Blender's joints lie within {worst:.4} mm of the forward kinematics", skeleton_file.display());
        assert!(worst < 0.1, "{worst} mm");
    }
}

#[test]
fn wrists_are_retargeted_about_the_shoulders_and_maps_are_editable() {
    let performance = motion();
    let source = &performance.rig.skeleton;
    let rig = RetargetRig::open(Path::new(BVH)).unwrap();
    let map = BoneMap::detect(rig.rig()).unwrap();
    let (frames, _) = rig.moved(&performance, &map).unwrap();
    let at = |own: &str| map.joint(own).unwrap();
    let rest = rig.rig().positions(&vec![Rotation::IDENTITY; rig.rig().joints.len()]);
    let reach = |positions: &[Vec3], [a, b, c]: [usize; 3]| {
        norm(sub(positions[a], positions[b])) + norm(sub(positions[b], positions[c]))
    };
    let arm = |side: &str| ["Arm", "ForeArm", "Hand"].map(|bone| format!("{side}{bone}"));
    let target_arm = |side: &str| arm(side).map(|bone| at(&bone));
    let source_arm = |side: &str| arm(side).map(|bone| source.find(&bone).unwrap());
    let first = performance.clip.positions(0);
    let sum = |lengths: [f64; 2]| lengths[0] + lengths[1];
    let share = sum(["Left", "Right"].map(|side| reach(&rest, target_arm(side))))
        / sum(["Left", "Right"].map(|side| reach(&first, source_arm(side))));
    let mut n_reached = 0;
    for (t, local) in frames.iter().enumerate() {
        let (target, source_positions) = (rig.rig().positions(local), performance.clip.positions(t));
        let middle = |positions: &[Vec3], [a, b]: [usize; 2]| scale(add(positions[a], positions[b]), 0.5);
        let source_middle = middle(&source_positions, ["Left", "Right"].map(|side| source_arm(side)[0]));
        let target_middle = middle(&target, ["Left", "Right"].map(|side| target_arm(side)[0]));
        for side in ["Left", "Right"] {
            let expected = add(target_middle, scale(sub(source_positions[source_arm(side)[2]], source_middle), share));
            let [shoulder, elbow, wrist] = target_arm(side);
            let is_in_reach = norm(sub(expected, target[shoulder])) < 0.999 * reach(&rest, [shoulder, elbow, wrist]);
            n_reached += usize::from(is_in_reach);
            assert!(!is_in_reach || norm(sub(target[wrist], expected)) < 1e-6);
        }
    }
    assert!(n_reached >= frames.len(), "{n_reached}");

    let text = map.text(rig.rig(), source);
    assert_eq!(BoneMap::parse(&text, rig.rig(), source).unwrap(), map);
    let error_of = |text: &str| format!("{:#}", BoneMap::parse(text, rig.rig(), source).unwrap_err());
    assert!(
        error_of("LeftArm = \"Nobody\"").contains("no joint Nobody") && error_of("Tail = \"Hips\"").contains("Tail")
    );
    assert!(error_of("Hips = \"Hips\"").contains("LeftForeArm") && error_of("Hips").contains("LeftArm ="));
    let error = rig.check_output(Path::new("a.glb")).unwrap_err().to_string();
    assert!(error.contains(".bvh"), "{error}");
}
