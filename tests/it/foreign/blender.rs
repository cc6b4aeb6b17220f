//! BVH, GLB and FBX opened by Blender show the joints of the motion, the latter two also their skin. Blender is a Python module for
//! Python 3.11 (`make blender`; ORATOR_BLENDER names its folder, else `target/blender`).

use crate::fixtures::animation::bvh::{Bvh, worst_mm};
use crate::fixtures::animation::gltf::{Glb, written};
use crate::fixtures::animation::truth::worst_joint_mm;
use crate::fixtures::figures::{FPS, swinging};
use orator_avatar::animate::export::file::{ExportContent, ExportFormat};
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::stage::progress::Silent;
use orator_test_support::skip::blender;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn seen(mut python: Command, file: &Path) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/blender_joints.py");
    let output = python.arg(script).arg(file).arg(FPS.num.to_string()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn blender_sees_the_joints_of_the_motion() {
    let Some(python) = blender() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("swinging.bvh");
    let performance = perform(&swinging(1, 20), None, &AnimationOptions::default());
    let (motion, text) = (performance.motion(), performance.clip.to_bvh());
    std::fs::write(&file, &text).unwrap();
    let seen = seen(python, &file);
    assert!((seen["fps"].as_f64().unwrap() - FPS.per_sec()).abs() < 1e-3);
    assert_eq!(seen["frames"].as_array().unwrap().len(), motion.n_frames());

    let written = Bvh::parse(&text);
    let places = |frame: usize| {
        let bone = |name: &String| {
            // The end of a bone is the tail of the joint before it.
            let (name, end) = name.strip_suffix("End").map_or((name.as_str(), 0), |name| (name, 1));
            std::array::from_fn(|k| seen["frames"][frame][name][end][k].as_f64().unwrap_or(f64::NAN))
        };
        written.names.iter().map(bone).collect()
    };
    let worst = worst_mm(&motion, &written, places);
    eprintln!("BVH: Blender's joints lie within {worst:.4} mm of the motion's");
    assert!(worst < 0.1, "{worst} mm");
}

#[test]
fn blender_sees_the_joints_of_the_glb_and_its_skin_around_them() {
    let Some(python) = blender() else { return };
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 12, Names::Mixamo);
    let seen = seen(python, &path);
    let expected = performance.motion();
    assert_eq!(seen["frames"].as_array().unwrap().len(), expected.n_frames());
    let names = Names::Mixamo.of(&performance.clip.skeleton);
    let mut worst: f64 = 0.0;
    for (frame, bones) in seen["frames"].as_array().unwrap().iter().enumerate() {
        let head = |node: usize| -> [f64; 3] {
            std::array::from_fn(|k| bones[&names[node]][0][k].as_f64().unwrap_or(f64::NAN))
        };
        let neck = head(performance.rig.positions[0]);
        for (joint, &node) in performance.rig.positions.iter().enumerate() {
            let place = head(node);
            for (k, sign) in [1.0, -1.0, -1.0].into_iter().enumerate() {
                let apart = sign * (place[k] - neck[k]) - f64::from(expected.joints[[frame, joint, k]]);
                assert!(apart.is_finite(), "no bone {}", names[node]);
                worst = worst.max(1e3 * apart.abs());
            }
        }
    }
    eprintln!("GLB: Blender's joints lie within {worst:.4} mm of the motion's, along any axis");
    assert!(worst < 0.1, "{worst} mm");

    // Blender's own skinning against plain linear skinning of the file.
    let glb = Glb::read(&path);
    let skinned = glb.skinned(expected.n_frames() - 1);
    assert_eq!(seen["n_vertices"].as_u64(), Some(skinned.len() as u64));
    for k in 0..3 {
        let bound = |n: usize| seen["mesh"][n][k].as_f64().unwrap();
        let (low, high) = skinned.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p[k]), high.max(p[k])));
        assert!((bound(0) - low).abs() < 1e-4 && (bound(1) - high).abs() < 1e-4, "{k}: {} {low}", bound(0));
    }
}

#[test]
fn blender_sees_the_joints_of_the_fbx_and_its_skin() {
    let Some(python) = blender() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("swinging.fbx");
    let performance = perform(&swinging(3, 12), None, &AnimationOptions::default());
    let content = ExportContent { names: Names::Mixamo, ..ExportContent::default() };
    ExportFormat::Fbx.write(&path, &performance, &content, &Silent).unwrap();
    let seen = seen(python, &path);
    assert_eq!(seen["frames"].as_array().unwrap().len(), performance.clip.n_frames());
    assert_eq!(seen["frames"][0].as_object().unwrap().len(), 65);
    // Blender's metres from the file's centimetres.
    let worst = worst_joint_mm(&performance, Names::Mixamo, |frame, name| {
        std::array::from_fn(|k| 100.0 * seen["frames"][frame][name][0][k].as_f64().unwrap_or(f64::NAN))
    });
    eprintln!("FBX: Blender's joints lie within {worst:.4} mm of the motion's");
    assert!(worst < 0.1, "{worst} mm");
    // The same mesh as in the GLB, posed by the same joints.
    let (_, glb) = written(folder.path(), 12, Names::Mixamo);
    let skinned = Glb::read(&glb).skinned(11);
    assert_eq!(seen["n_vertices"].as_u64(), Some(skinned.len() as u64));
    for k in 0..3 {
        let (low, high) = skinned.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p[k]), high.max(p[k])));
        let bound = |n: usize| seen["mesh"][n][k].as_f64().unwrap();
        assert!((bound(0) - low).abs() < 1e-3 && (bound(1) - high).abs() < 1e-3, "{k}: {} {low}", bound(0));
    }
}
