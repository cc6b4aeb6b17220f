//! BVH, GLB and FBX imported into Blender have the joints of the motion; GLB and FBX also have their skin. Blender is a
//! module for Python 3.11 (`make blender`) in the folder ORATOR_BLENDER, by default `target/blender`.

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

fn import(mut python: Command, file: &Path) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/blender_joints.py");
    let output = python.arg(script).arg(file).arg(FPS.num.to_string()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn blender_imports_the_joints_of_a_bvh() {
    let Some(python) = blender() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("swinging.bvh");
    let performance = perform(&swinging(1, 20), None, &AnimationOptions::default());
    let (motion, text) = (performance.motion(), performance.clip.to_bvh());
    std::fs::write(&file, &text).unwrap();
    let scene = import(python, &file);
    assert!((scene["fps"].as_f64().unwrap() - FPS.per_sec()).abs() < 1e-3);
    assert_eq!(scene["frames"].as_array().unwrap().len(), motion.n_frames());

    let written = Bvh::parse(&text);
    let positions = |frame: usize| {
        let bone = |name: &String| {
            // In Blender an end joint is the tail of its parent bone.
            let (name, end) = name.strip_suffix("End").map_or((name.as_str(), 0), |name| (name, 1));
            std::array::from_fn(|k| scene["frames"][frame][name][end][k].as_f64().unwrap_or(f64::NAN))
        };
        written.names.iter().map(bone).collect()
    };
    let worst = worst_mm(&motion, &written, positions);
    eprintln!("BVH: Blender's joints lie within {worst:.4} mm of the motion's");
    assert!(worst < 0.1, "{worst} mm");
}

#[test]
fn blender_imports_the_joints_and_the_skin_of_a_glb() {
    let Some(python) = blender() else { return };
    let folder = tempfile::tempdir().unwrap();
    let (performance, path) = written(folder.path(), 12, Names::Mixamo);
    let scene = import(python, &path);
    let expected = performance.motion();
    assert_eq!(scene["frames"].as_array().unwrap().len(), expected.n_frames());
    let names = Names::Mixamo.of(&performance.clip.skeleton);
    let mut worst: f64 = 0.0;
    for (frame, bones) in scene["frames"].as_array().unwrap().iter().enumerate() {
        let head = |node: usize| -> [f64; 3] {
            std::array::from_fn(|k| bones[&names[node]][0][k].as_f64().unwrap_or(f64::NAN))
        };
        let neck = head(performance.rig.positions[0]);
        for (joint, &node) in performance.rig.positions.iter().enumerate() {
            let position = head(node);
            for (k, sign) in [1.0, -1.0, -1.0].into_iter().enumerate() {
                let difference = sign * (position[k] - neck[k]) - f64::from(expected.joints[[frame, joint, k]]);
                assert!(difference.is_finite(), "no bone {}", names[node]);
                worst = worst.max(1e3 * difference.abs());
            }
        }
    }
    eprintln!("GLB: Blender's joints lie within {worst:.4} mm of the motion's, along any axis");
    assert!(worst < 0.1, "{worst} mm");

    // Bounds of the mesh that Blender skins equal those of linear blend skinning of the file.
    let glb = Glb::read(&path);
    let skinned = glb.skinned(expected.n_frames() - 1);
    assert_eq!(scene["n_vertices"].as_u64(), Some(skinned.len() as u64));
    for k in 0..3 {
        let bound = |n: usize| scene["mesh"][n][k].as_f64().unwrap();
        let (low, high) = skinned.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p[k]), high.max(p[k])));
        assert!((bound(0) - low).abs() < 1e-4 && (bound(1) - high).abs() < 1e-4, "{k}: {} {low}", bound(0));
    }
}

#[test]
fn blender_imports_the_joints_and_the_skin_of_an_fbx() {
    let Some(python) = blender() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("swinging.fbx");
    let performance = perform(&swinging(3, 12), None, &AnimationOptions::default());
    let content = ExportContent { names: Names::Mixamo, ..ExportContent::default() };
    ExportFormat::Fbx.write(&path, &performance, &content, &Silent).unwrap();
    let scene = import(python, &path);
    assert_eq!(scene["frames"].as_array().unwrap().len(), performance.clip.n_frames());
    assert_eq!(scene["frames"][0].as_object().unwrap().len(), 65);
    // Blender converts the centimetres of the file to metres.
    let worst = worst_joint_mm(&performance, Names::Mixamo, |frame, name| {
        std::array::from_fn(|k| 100.0 * scene["frames"][frame][name][0][k].as_f64().unwrap_or(f64::NAN))
    });
    eprintln!("FBX: Blender's joints lie within {worst:.4} mm of the motion's");
    assert!(worst < 0.1, "{worst} mm");
    // The mesh and its pose equal those of the GLB.
    let (_, glb) = written(folder.path(), 12, Names::Mixamo);
    let skinned = Glb::read(&glb).skinned(11);
    assert_eq!(scene["n_vertices"].as_u64(), Some(skinned.len() as u64));
    for k in 0..3 {
        let (low, high) = skinned.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p[k]), high.max(p[k])));
        let bound = |n: usize| scene["mesh"][n][k].as_f64().unwrap();
        assert!((bound(0) - low).abs() < 1e-3 && (bound(1) - high).abs() < 1e-3, "{k}: {} {low}", bound(0));
    }
}
