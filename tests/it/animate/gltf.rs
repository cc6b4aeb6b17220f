//! The GLB parsed without a library: nodes and animation reproduce the joints of the performance, and the skin at rest
//! reproduces the mesh with complete weights. The Khronos validator reports no issues (`make validator`).

use crate::fixtures::animation::gltf::{Glb, vec3, written};
use crate::fixtures::figures::swinging;
use orator_avatar::animate::export::file::{ExportContent, ExportFormat};
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, norm, scale, sub};
use orator_base::stage::progress::Silent;
use orator_test_support::skip::gltf_validator;
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

#[test]
fn nodes_and_animation_reproduce_the_joints_of_the_performance() {
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 40, Names::Own);
    let glb = Glb::read(&path);
    let expected = performance.motion();
    let mut worst: f64 = 0.0;
    for frame in 0..expected.n_frames() {
        let (local, root) = glb.pose(frame);
        let world = glb.world(&local, root);
        let neck = world[performance.rig.positions[0]].1;
        for (joint, &node) in performance.rig.positions.iter().enumerate() {
            let [x, y, z] = sub(world[node].1, neck);
            let position = [x, -y, -z];
            let square =
                (0..3).map(|k| (position[k] - f64::from(expected.joints[[frame, joint, k]])).powi(2)).sum::<f64>();
            worst = worst.max(1e3 * square.sqrt());
        }
    }
    eprintln!("forward kinematics of the GLB: {worst:.5} mm");
    assert!(worst < 0.1, "{worst} mm");
    let rest = glb.world(&vec![Rotation::IDENTITY; performance.rig.skeleton.joints.len() + 1], [0.0; 3]);
    let hand = performance.rig.arms[0].hand;
    assert!(rest[hand].1[0] > 0.4 && rest[hand].1[2].abs() < 0.05, "left is at +x in the T-pose");
}

#[test]
fn the_skin_at_rest_equals_the_mesh_and_weights_sum_to_one() {
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 3, Names::Own);
    let glb = Glb::read(&path);
    let n_joints = performance.rig.skeleton.joints.len();
    let inverse_binds = glb.numbers(&glb.scene["skins"][0]["inverseBindMatrices"]);
    assert_eq!(inverse_binds.len(), n_joints);
    let root = vec3(&glb.node(0)["translation"]);
    let rest = glb.world(&vec![Rotation::IDENTITY; n_joints + 2], root);
    let (mut n_triangles, mut low, mut high) = (0, [f64::MAX; 3], [f64::MIN; 3]);
    let mut joint_weights = vec![0.0; n_joints];
    for part in glb.parts() {
        let of = |name: &str| glb.numbers(&part["attributes"][name]);
        let (points, normals, joints, weights) = (of("POSITION"), of("NORMAL"), of("JOINTS_0"), of("WEIGHTS_0"));
        for (n, point) in points.iter().enumerate() {
            assert_eq!(weights[n].iter().sum::<f64>(), 65_535.0);
            let length = normals[n].iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-5);
            let point: Vec3 = std::array::from_fn(|k| point[k]);
            let mut skinned = [0.0; 3];
            for (&joint, &weight) in joints[n].iter().zip(&weights[n]) {
                let joint = joint as usize;
                let bind: Vec3 = std::array::from_fn(|k| inverse_binds[joint][12 + k]);
                skinned = add(skinned, scale(add(add(point, bind), rest[joint].1), weight / 65_535.0));
                joint_weights[joint] += weight / 65_535.0;
            }
            assert!(norm(sub(skinned, point)) < 1e-5);
            (0..3).for_each(|k| (low[k], high[k]) = (low[k].min(point[k]), high[k].max(point[k])));
        }
        let corners = glb.numbers(&part["indices"]);
        assert!(corners.iter().all(|corner| (corner[0] as usize) < points.len()));
        n_triangles += corners.len() / 3;
    }
    eprintln!("{n_triangles} triangles, {} bytes", std::fs::metadata(&path).unwrap().len());
    assert!((10_000..60_000).contains(&n_triangles) && std::fs::metadata(&path).unwrap().len() < 2_000_000);
    // Soles on the floor, a plausible height, symmetric in x, and feet that point to +z.
    assert!(low[1].abs() < 0.02 && (1.2..2.4).contains(&high[1]) && (low[0] + high[0]).abs() < 0.05);
    assert!(high[2] > -low[2]);
    for (joint, bone) in performance.rig.skeleton.joints.iter().enumerate() {
        assert!(bone.end || joint_weights[joint] > 5.0, "{} has weight {}", bone.name, joint_weights[joint]);
    }
}

#[test]
fn the_face_has_vertex_colours_and_a_mouth_open_target() {
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 3, Names::Vrm);
    let glb = Glb::read(&path);
    let face = &glb.scene["meshes"][1];
    assert_eq!(face["extras"]["targetNames"][0], "mouthOpen");
    let part = &face["primitives"][0];
    let open = glb.numbers(&part["targets"][0]["POSITION"]);
    let points = glb.numbers(&part["attributes"]["POSITION"]);
    let colours = glb.numbers(&part["attributes"]["COLOR_0"]);
    assert!(open.len() == points.len() && colours.len() == points.len());
    // The chin drops by centimetres; eyes, nose and all vertices below the collar do not move.
    let lowest = open.iter().map(|offset| offset[1]).fold(f64::INFINITY, f64::min);
    assert!((-0.04..-0.015).contains(&lowest), "{lowest} m");
    let head = glb
        .world(&vec![Rotation::IDENTITY; performance.rig.skeleton.joints.len() + 2], vec3(&glb.node(0)["translation"]))
        [performance.rig.head]
        .1;
    let fixed = points.iter().zip(&open).filter(|(point, _)| point[1] > head[1] + 0.10 || point[1] < head[1] - 0.05);
    assert!(fixed.clone().count() > 500);
    assert!(fixed.map(|(_, offset)| offset[1].abs()).fold(0.0, f64::max) < 1e-3);
    let vrm = &glb.scene["extensions"]["VRMC_vrm"]["expressions"]["preset"]["aa"]["morphTargetBinds"][0];
    assert_eq!(glb.node(vrm["node"].as_u64().unwrap() as usize)["mesh"], 1);
}

#[test]
fn a_static_joint_has_one_key_and_zero_frames_no_animation() {
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 20, Names::Own);
    let glb = Glb::read(&path);
    let keys = |node: usize| {
        let animation = &glb.scene["animations"][0];
        let channel = animation["channels"]
            .as_array()
            .unwrap()
            .iter()
            .find(|channel| channel["target"]["node"] == node && channel["target"]["path"] == "rotation");
        glb.numbers(&animation["samplers"][channel.unwrap()["sampler"].as_u64().unwrap() as usize]["output"]).len()
    };
    let leg = performance.rig.skeleton.find("LeftLeg").unwrap();
    assert_eq!((keys(leg), keys(performance.rig.arms[0].forearm)), (1, 20));
    let (_, path) = written(folder.path(), 0, Names::Own);
    assert!(Glb::read(&path).scene.get("animations").is_none());
}

const VALIDATE: &str = "
const validator = require(process.argv[1]), fs = require('fs');
const all = process.argv.slice(2).map(file => validator.validateBytes(new Uint8Array(fs.readFileSync(file))));
Promise.all(all).then(reports => console.log(JSON.stringify(reports.map(report => report.issues))));
";

#[test]
fn the_khronos_validator_reports_no_issues() {
    let Some(module) = gltf_validator() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut files: Vec<PathBuf> = Names::ALL.map(|names| written(folder.path(), 12, names).1).to_vec();
    // A single frame, and a motion without any detected joint.
    let one = perform(&swinging(5, 1), None, &AnimationOptions::default());
    let mut undetected = swinging(5, 4);
    undetected.joints.fill(f32::NAN);
    let undetected = perform(&undetected, None, &AnimationOptions::default());
    for (name, performance) in [("one.glb", &one), ("unseen.glb", &undetected)] {
        files.push(folder.path().join(name));
        ExportFormat::Glb.write(&files[files.len() - 1], performance, &ExportContent::default(), &Silent).unwrap();
    }
    for name in ["avatar.vrm", "motion.vrma"] {
        files.push(folder.path().join(name));
        let format = ExportFormat::from_path(&files[files.len() - 1]).unwrap();
        format.write(&files[files.len() - 1], &one, &ExportContent::default(), &Silent).unwrap();
    }
    let output = Command::new("node").args(["-e", VALIDATE]).arg(&module).args(&files).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let reports: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (file, issues) in files.iter().zip(reports.as_array().unwrap()) {
        eprintln!("{}: {issues}", file.file_name().unwrap().display());
        assert_eq!((&issues["numErrors"], &issues["numWarnings"]), (&Value::from(0), &Value::from(0)), "{issues}");
        let is_vrm = ["vrm.glb", "avatar.vrm", "motion.vrma"].iter().any(|name| file.ends_with(name));
        // The ends of bones are empty nodes where there is no skin.
        let is_end = |message: &Value| message["code"] == "NODE_EMPTY" && file.ends_with("motion.vrma");
        let known = |message: &Value| (message["code"] == "UNSUPPORTED_EXTENSION" && is_vrm) || is_end(message);
        assert!(issues["messages"].as_array().unwrap().iter().all(known), "{issues}");
    }
}
