//! A captured skeleton keeps its head, spine and legs in every animation format; parts that a capture lacks, or that an
//! option replaces, move as without a capture.

use super::animate_verb::done;
use crate::fixtures::animation::gltf::Glb;
use crate::fixtures::figures::FPS;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, dot, norm, scale, sub, unit};
use orator_base::motion::fk::Skeleton;
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::bvh::skeleton::BvhSkeleton;
use orator_formats::bvh::write::BvhClip;
use orator_formats::mocap::motion_file;
use orator_formats::{joints_npz, npy};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

const N_FRAMES: usize = 24;
/// Bones of a written file, and the joints of the capture whose directions they must have.
const BONES: [([&str; 2], [&str; 2]); 10] = [
    (["Spine", "Chest"], ["Spine", "Spine1"]),
    (["Chest", "Neck"], ["Spine1", "Neck"]),
    (["Neck", "Head"], ["Neck", "Head"]),
    (["Head", "HeadEnd"], ["Head", "HeadTop"]),
    (["LeftUpLeg", "LeftLeg"], ["LeftUpLeg", "LeftLeg"]),
    (["LeftLeg", "LeftFoot"], ["LeftLeg", "LeftFoot"]),
    (["LeftFoot", "LeftFootEnd"], ["LeftFoot", "LeftToeBase"]),
    (["RightUpLeg", "RightLeg"], ["RightUpLeg", "RightLeg"]),
    (["RightLeg", "RightFoot"], ["RightLeg", "RightFoot"]),
    (["RightFoot", "RightFootEnd"], ["RightFoot", "RightToeBase"]),
];

/// World rotation and position (cm) of joints by name.
type Pose = BTreeMap<String, (Rotation, Vec3)>;

/// A walking, bowing and turning person whose proportions differ from those of the rig.
pub(super) fn capture(has_legs: bool) -> BvhClip {
    let mut skeleton = Skeleton::default();
    let hips = skeleton.push("Hips", None, [0.0; 3], false);
    let spine = skeleton.push("Spine", Some(hips), [0.0, 9.0, 0.0], false);
    let chest = skeleton.push("Spine1", Some(spine), [0.0, 21.0, -1.0], false);
    let neck = skeleton.push("Neck", Some(chest), [0.0, 23.0, 0.0], false);
    let head = skeleton.push("Head", Some(neck), [0.0, 10.0, 1.5], false);
    let top = skeleton.push("HeadTop", Some(head), [0.0, 18.0, 0.0], false);
    skeleton.push("", Some(top), [0.0, 1.0, 0.0], true);
    for (side, sign) in [("Left", 1.0), ("Right", -1.0)] {
        let mut limb = |parent: usize, joints: &[(&str, Vec3)]| {
            let below = joints.iter().fold(parent, |parent, (part, offset)| {
                skeleton.push(&format!("{side}{part}"), Some(parent), *offset, false)
            });
            skeleton.push("", Some(below), [4.0 * sign, 0.0, 4.0], true);
        };
        let arm = [("Shoulder", [3.0, 18.0, 0.0]), ("Arm", [14.0, 0.0, 0.0]), ("ForeArm", [28.0, 0.0, 0.0])];
        let [shoulder, upper, fore] = arm.map(|(part, [x, y, z])| (part, [sign * x, y, z]));
        limb(chest, &[shoulder, upper, fore, ("Hand", [sign * 25.0, 0.0, 0.0])]);
        if has_legs {
            let (upper, foot) = (("UpLeg", [10.5 * sign, -5.0, 1.0]), ("Foot", [0.0, -40.0, 0.0]));
            limb(hips, &[upper, ("Leg", [0.0, -45.0, 0.0]), foot, ("ToeBase", [0.0, -7.0, 15.0])]);
        }
    }
    let wave = |t: usize, joint: usize, axis: usize, degrees: f64| {
        degrees.to_radians() * (0.21 * t as f64 + 1.3 * joint as f64 + 2.1 * axis as f64).sin()
    };
    let turned = |t: usize, joint: usize| {
        let name = skeleton.joints[joint].name.as_str();
        let hanging = match name {
            "LeftArm" => -55.0,
            "RightArm" => 55.0,
            _ => 0.0,
        };
        let degrees: Vec3 = match name {
            "Hips" => [8.0, 10.0, 25.0],
            "Spine" | "Spine1" => [8.0, 14.0, 6.0],
            "Neck" | "Head" => [8.0, 12.0, 25.0],
            "LeftUpLeg" | "RightUpLeg" => [10.0, 35.0, 10.0],
            "LeftLeg" | "RightLeg" => [0.0, 30.0, 0.0],
            "LeftFoot" | "RightFoot" => [5.0, 15.0, 5.0],
            "LeftArm" | "RightArm" => [20.0, 10.0, 20.0],
            "LeftForeArm" | "RightForeArm" => [5.0, 5.0, 10.0],
            _ => [0.0; 3],
        };
        let angles = std::array::from_fn(|axis| wave(t, joint, axis, degrees[axis]));
        Rotation::about([0.0, 0.0, 1.0], f64::to_radians(hanging)) * Rotation::from_euler([2, 0, 1], angles)
    };
    let frame = |t: usize| (0..skeleton.joints.len()).map(|joint| turned(t, joint)).collect();
    let local: Vec<Vec<Rotation>> = (0..N_FRAMES).map(frame).collect();
    let travel = (0..N_FRAMES).map(|t| [0.0, (0.4 * t as f64).sin(), 3.0 * t as f64]).collect();
    BvhClip { root: [12.0, 97.0, -20.0], travel, fps: FPS, local, skeleton }
}

/// The joints of a clip.
fn poses(clip: &BvhClip) -> Vec<Pose> {
    let pose = |t: usize| {
        let world = clip.skeleton.world(&clip.local[t]).into_iter().zip(clip.positions(t));
        clip.skeleton.joints.iter().map(|joint| joint.name.clone()).zip(world).collect()
    };
    (0..clip.n_frames()).map(pose).collect()
}

fn bvh_poses(path: &Path) -> Vec<Pose> {
    let bvh = Bvh::read(path).unwrap();
    let file = BvhSkeleton::of(&bvh);
    let pose = |(values, positions): (&[f64], Vec<Vec3>)| {
        let mut world: Vec<Rotation> = Vec::new();
        for (joint, first) in file.joints.iter().zip(file.first_channels()) {
            let local = joint.rotation(&values[first..]).unwrap_or(Rotation::IDENTITY);
            world.push(joint.parent.map_or(local, |parent| world[parent] * local));
        }
        let names = file.joints.iter().map(|joint| joint.name.replace("_end", "End"));
        names.zip(world.into_iter().zip(positions)).collect()
    };
    bvh.frames().zip(bvh.positions(Positions::Replace)).map(pose).collect()
}

fn glb_poses(path: &Path) -> Vec<Pose> {
    let glb = Glb::read(path);
    let pose = |t: usize| {
        let (local, root) = glb.pose(t);
        let nodes = glb.scene["nodes"].as_array().unwrap().iter();
        let names = nodes.map(|node| node["name"].as_str().unwrap_or_default().to_owned());
        names.zip(glb.world(&local, root).into_iter().map(|(turn, at)| (turn, scale(at, 100.0)))).collect()
    };
    (0..N_FRAMES).map(pose).collect()
}

fn fbx_poses(path: &Path) -> Vec<Pose> {
    let scene = ufbx::load_memory(&std::fs::read(path).unwrap(), ufbx::LoadOpts::default()).expect("ufbx reads it");
    let names = BONES.iter().flat_map(|(ours, _)| ours.iter()).chain(&["Hips"]);
    let pose = |t: usize| {
        let frame = ufbx::evaluate_scene(&scene, &scene.anim, FPS.secs(t), ufbx::EvaluateOpts::default()).unwrap();
        let joint = |name: &&str| {
            let m = ufbx::find_node(&frame, name).unwrap().node_to_world;
            let turn = Rotation::from_axes([m.m00, m.m10, m.m20], [m.m01, m.m11, m.m21], [m.m02, m.m12, m.m22]);
            ((*name).to_owned(), (turn, [m.m03, m.m13, m.m23]))
        };
        names.clone().map(joint).collect()
    };
    (0..N_FRAMES).map(pose).collect()
}

fn degrees_between(a: Vec3, b: Vec3) -> f64 {
    let [a, b] = [a, b].map(|v| unit(v, 1e-9).unwrap());
    dot(a, b).clamp(-1.0, 1.0).acos().to_degrees()
}

fn direction(pose: &Pose, [from, to]: [&str; 2]) -> Vec3 {
    sub(pose[to].1, pose[from].1)
}

#[test]
fn every_format_has_the_captured_head_spine_and_legs() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let truth = capture(true);
    std::fs::write(dir.join("in.bvh"), truth.to_bvh()).unwrap();
    let facts = done(dir, "in.bvh --out out.bvh out.glb out.fbx out.npy");
    assert_eq!(facts["report"]["captured"], json!(["head", "spine", "legs"]));
    let expected = poses(&truth);
    for (file, found) in [
        ("bvh", bvh_poses(&dir.join("out.bvh"))),
        ("glb", glb_poses(&dir.join("out.glb"))),
        ("fbx", fbx_poses(&dir.join("out.fbx"))),
    ] {
        assert_eq!(found.len(), N_FRAMES, "{file}");
        for (t, (found, expected)) in found.iter().zip(&expected).enumerate() {
            for (ours, theirs) in BONES {
                let degrees = degrees_between(direction(found, ours), direction(expected, theirs));
                assert!(degrees < 1.0, "{file}, frame {t}, {ours:?}: {degrees} degrees");
            }
            for joint in ["Hips", "Head", "LeftFoot", "RightFoot"] {
                let degrees = (found[joint].0.inverse() * expected[joint].0).angle().to_degrees();
                assert!(degrees < 1.0, "{file}, frame {t}, {joint}: {degrees} degrees");
            }
            let mm = 10.0 * norm(sub(found["Hips"].1, expected["Hips"].1));
            assert!(mm < 2.0, "{file}, frame {t}, hips: {mm} mm");
            for side in ["Left", "Right"] {
                let [ours, theirs] = ["FootEnd", "ToeBase"].map(|toe| format!("{side}{toe}"));
                let difference = sub(direction(found, ["Hips", &ours]), direction(expected, ["Hips", &theirs]));
                assert!(10.0 * norm(difference) < 2.0, "{file}, frame {t}, {side} toe: {difference:?} cm");
            }
        }
    }
    // Arms are where they are without the body.
    let motion = motion_file::read(&dir.join("in.bvh"), None).unwrap().motion;
    joints_npz::write(&dir.join("joints.npz"), &motion).unwrap();
    done(dir, "joints.npz --out arms.npy");
    let [with, without] = ["out.npy", "arms.npy"].map(|name| npy::read(&dir.join(name), FPS).unwrap().joints);
    let worst = (&with - &without).iter().fold(0.0f32, |worst, v| worst.max(v.abs()));
    assert!(worst < 1e-4, "{worst} m");
}

#[test]
fn a_capture_with_z_up_keeps_its_postures() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let mut clip = capture(true);
    let expected = poses(&clip);
    let up = Rotation::about([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2);
    clip.skeleton.joints.iter_mut().for_each(|joint| joint.offset = up.turn(joint.offset));
    clip.travel.iter_mut().for_each(|travel| *travel = up.turn(*travel));
    clip.local.iter_mut().flatten().for_each(|turn| *turn = up * *turn * up.inverse());
    clip.root = up.turn(clip.root);
    std::fs::write(dir.join("in.bvh"), clip.to_bvh()).unwrap();
    done(dir, "in.bvh --out out.bvh");
    for (t, (found, expected)) in bvh_poses(&dir.join("out.bvh")).iter().zip(&expected).enumerate() {
        // The take is turned about the vertical to face the camera.
        for (ours, theirs) in BONES {
            let rise = |bone: Vec3| bone[1] / norm(bone);
            let difference = rise(direction(found, ours)) - rise(direction(expected, theirs));
            assert!(difference.abs() < 0.01, "frame {t}, {ours:?}: {difference}");
        }
        let heights = [found, expected].map(|pose| pose["Hips"].1[1]);
        assert!((heights[0] - heights[1]).abs() < 0.2, "frame {t}: {heights:?} cm");
    }
}

#[test]
fn a_capture_is_unchanged_on_its_own_skeleton() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    // The shoulders are below the neck at rest and the head in front of it; only the limbs move.
    let mut clip = capture(true);
    for name in ["Hips", "Spine", "Spine1", "Neck", "Head"] {
        let joint = clip.skeleton.find(name).unwrap();
        clip.local.iter_mut().for_each(|frame| frame[joint] = Rotation::IDENTITY);
    }
    std::fs::write(dir.join("in.bvh"), clip.to_bvh()).unwrap();
    done(dir, "in.bvh --retarget in.bvh --out out.bvh --smoothing none --no-constraints");
    let found = bvh_poses(&dir.join("out.bvh"));
    assert_eq!(found.len(), N_FRAMES);
    for (t, (found, expected)) in found.iter().zip(&poses(&clip)).enumerate() {
        for joint in ["Head", "LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightHand", "LeftFoot"] {
            let difference = sub(direction(found, ["Hips", joint]), direction(expected, ["Hips", joint]));
            assert!(10.0 * norm(difference) < 0.1, "frame {t}, {joint}: {difference:?} cm");
        }
    }
}

#[test]
fn missing_and_replaced_parts_move_as_without_a_capture() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let parts = |args: &str| done(dir, args)["report"]["captured"].clone();
    std::fs::write(dir.join("in.bvh"), capture(true).to_bvh()).unwrap();
    assert_eq!(parts("in.bvh --out a.bvh --neutral-head"), json!(["spine", "legs"]));
    assert_eq!(parts("in.bvh --out a.bvh --legs standing"), json!(["head", "spine"]));
    assert!(parts("in.bvh --out a.bvh --shoulder-yaw removed").is_null());
    std::fs::write(dir.join("upper.bvh"), capture(false).to_bvh()).unwrap();
    assert_eq!(parts("upper.bvh --out a.bvh"), json!(["head", "spine"]));
    let found = bvh_poses(&dir.join("a.bvh"));
    let slid = |pose: &Pose| norm(sub(pose["LeftFoot"].1, found[0]["LeftFoot"].1));
    assert!(found.iter().map(slid).fold(0.0, f64::max) < 0.05, "the feet stand on the floor");

    // A skeleton without hips and legs gives the bytes of its joints.
    std::fs::write(dir.join("arms.bvh"), capture(false).to_bvh().replace("ROOT Hips", "ROOT Base")).unwrap();
    assert!(parts("arms.bvh --out a.bvh a.fbx").is_null());
    joints_npz::write(&dir.join("joints.npz"), &motion_file::read(&dir.join("arms.bvh"), None).unwrap().motion)
        .unwrap();
    done(dir, "joints.npz --out b.bvh b.fbx");
    for ending in ["bvh", "fbx"] {
        let [a, b] = ["a", "b"].map(|name| std::fs::read(dir.join(format!("{name}.{ending}"))).unwrap());
        assert!(a == b, "{ending}");
    }
    let printed = |input: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        let output = command.args(["animate", input, "--out", "c.bvh"]).current_dir(dir).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
    };
    let (captured, arms) = (printed("in.bvh"), printed("arms.bvh"));
    assert!(captured.contains("from the capture: head, spine, legs") && !captured.contains("at rest"), "{captured}");
    assert!(arms.contains("head: at rest") && !arms.contains("from the capture"), "{arms}");
}
