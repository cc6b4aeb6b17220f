//! Motion on skeletons of other people's: Blender has their joints where our forward kinematics puts them, and the wrists
//! are where ours are about the shoulders.

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

/// Our avatar's GLB with centimetres under a node that scales and turns by a quarter, as exporters write it.
fn under_an_armature(folder: &Path) -> PathBuf {
    let (_, path) = written(folder, 0, Names::Mixamo);
    let Glb { mut scene, bytes } = Glb::read(&path);
    for node in scene["nodes"].as_array_mut().unwrap() {
        for k in 0..3 {
            if let Some(way) = node["translation"][k].as_f64() {
                node["translation"][k] = json!(100.0 * way);
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

/// Bytes of a GLB file with this scene and data.
fn glb_file(scene: &Value, bytes: &[u8]) -> Vec<u8> {
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
fn nodes_that_do_not_move_take_no_memory_a_frame_and_too_many_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (_, figure) = written(folder.path(), 0, Names::Mixamo);
    let with_nodes = |n: usize| {
        let Glb { mut scene, bytes } = Glb::read(&figure);
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
    // The rotations of all nodes in all frames alone are 165 MiB.
    assert!(memory.bytes_max < 80 << 20, "{} bytes", memory.bytes_max);
    let moved = Glb::read(&out);
    let channels = moved.scene["animations"][0]["channels"].as_array().unwrap();
    assert!((40..100).contains(&channels.len()), "{} channels", channels.len());
    let error = format!("{:#}", RetargetRig::open(&with_nodes(10_000)).unwrap_err());
    assert!(error.contains("10000.glb") && error.contains("nodes, expected at most 10000"), "{error}");
}

#[test]
fn blender_has_the_joints_where_we_put_them() {
    let Some(_) = blender() else { return };
    let folder = tempfile::tempdir().unwrap();
    let performance = motion();
    // Metres and centimetres to millimetres; places of a BVH are taken from its root.
    for (given, mm) in [(PathBuf::from(BVH), 10.0), (under_an_armature(folder.path()), 1000.0)] {
        let rig = RetargetRig::open(&given).unwrap();
        let map = BoneMap::detect(rig.rig()).unwrap();
        let out = folder.path().join("moved").with_extension(given.extension().unwrap());
        rig.write(&out, &performance, &map).unwrap();
        let (frames, moves) = rig.moved(&performance, &map).unwrap();
        assert!(moves.iter().filter(|moves| **moves).count() >= 40);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/blender_joints.py");
        let output = blender().unwrap().arg(script).arg(&out).arg(FPS.num.to_string()).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let seen: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(seen["frames"].as_array().unwrap().len(), frames.len());
        let mut worst: f64 = 0.0;
        for (t, local) in frames.iter().enumerate() {
            let place = |joint: usize| -> Vec3 {
                let name = &rig.rig().joints[joint].name;
                std::array::from_fn(|k| seen["frames"][t][name][0][k].as_f64().unwrap_or(f64::NAN))
            };
            let places = rig.rig().positions(local);
            let moving: Vec<usize> = (0..places.len()).filter(|&joint| rig.rig().joints[joint].moves).collect();
            let from = if mm < 100.0 { sub(place(moving[0]), places[moving[0]]) } else { [0.0; 3] };
            for joint in moving {
                let apart = mm * norm(sub(place(joint), add(places[joint], from)));
                assert!(apart.is_finite(), "no joint {}", rig.rig().joints[joint].name);
                worst = worst.max(apart);
            }
        }
        eprintln!("{}: Blender's joints lie within {worst:.4} mm of ours", given.display());
        assert!(worst < 0.1, "{worst} mm");
    }
}

#[test]
fn the_wrists_keep_their_places_and_a_map_can_be_edited() {
    let performance = motion();
    let ours = &performance.rig.skeleton;
    let rig = RetargetRig::open(Path::new(BVH)).unwrap();
    let map = BoneMap::detect(rig.rig()).unwrap();
    let (frames, _) = rig.moved(&performance, &map).unwrap();
    let at = |own: &str| map.joint(own).unwrap();
    let rest = rig.rig().positions(&vec![Rotation::IDENTITY; rig.rig().joints.len()]);
    let long =
        |places: &[Vec3], [a, b, c]: [usize; 3]| norm(sub(places[a], places[b])) + norm(sub(places[b], places[c]));
    let arm = |side: &str| ["Arm", "ForeArm", "Hand"].map(|bone| format!("{side}{bone}"));
    let their_arm = |side: &str| arm(side).map(|bone| at(&bone));
    let our_arm = |side: &str| arm(side).map(|bone| ours.find(&bone).unwrap());
    let first = performance.clip.positions(0);
    let both = |lengths: [f64; 2]| lengths[0] + lengths[1];
    let share = both(["Left", "Right"].map(|side| long(&rest, their_arm(side))))
        / both(["Left", "Right"].map(|side| long(&first, our_arm(side))));
    let mut n_reached = 0;
    for (t, local) in frames.iter().enumerate() {
        let (theirs, our) = (rig.rig().positions(local), performance.clip.positions(t));
        let middle = |places: &[Vec3], [a, b]: [usize; 2]| scale(add(places[a], places[b]), 0.5);
        let from = middle(&our, ["Left", "Right"].map(|side| our_arm(side)[0]));
        let to = middle(&theirs, ["Left", "Right"].map(|side| their_arm(side)[0]));
        for side in ["Left", "Right"] {
            let goal = add(to, scale(sub(our[our_arm(side)[2]], from), share));
            let [shoulder, elbow, wrist] = their_arm(side);
            let is_in_reach = norm(sub(goal, theirs[shoulder])) < 0.999 * long(&rest, [shoulder, elbow, wrist]);
            n_reached += usize::from(is_in_reach);
            assert!(!is_in_reach || norm(sub(theirs[wrist], goal)) < 1e-6);
        }
    }
    assert!(n_reached >= frames.len(), "{n_reached}");

    let text = map.text(rig.rig(), ours);
    assert_eq!(BoneMap::parse(&text, rig.rig(), ours).unwrap(), map);
    let wrong = |text: &str| format!("{:#}", BoneMap::parse(text, rig.rig(), ours).unwrap_err());
    assert!(wrong("LeftArm = \"Nobody\"").contains("no joint Nobody") && wrong("Tail = \"Hips\"").contains("Tail"));
    assert!(wrong("Hips = \"Hips\"").contains("LeftForeArm") && wrong("Hips").contains("LeftArm ="));
    let error = rig.check_output(Path::new("a.glb")).unwrap_err().to_string();
    assert!(error.contains(".bvh"), "{error}");
}
