//! A BVH opened by Blender shows the joints of the motion. Runs with a Python that has `bpy` (Python 3.11,
//! `pip install bpy`): the one that ORATOR_BLENDER_PYTHON names, or `.venv/bin/python`.

use crate::bvh::{Bvh, worst_mm};
use crate::figures::{FPS, swinging};
use orator::animate::{Options, perform};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn python_with_blender() -> Option<PathBuf> {
    let named = std::env::var_os("ORATOR_BLENDER_PYTHON").map(PathBuf::from);
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    named.into_iter().chain([beside]).find(|python| {
        let mut ask = Command::new(python);
        ask.args(["-c", "import bpy"]).stdout(Stdio::null()).stderr(Stdio::null());
        ask.status().is_ok_and(|status| status.success())
    })
}

#[test]
fn blender_sees_the_joints_of_the_motion() {
    let Some(python) = python_with_blender() else {
        eprintln!("SKIPPED: blender_sees_the_joints_of_the_motion: no Python with bpy (set ORATOR_BLENDER_PYTHON)");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("swinging.bvh");
    let motion = swinging(1, 20);
    let text = perform(&motion, None, &Options::default()).clip.to_bvh();
    std::fs::write(&file, &text).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/blender_joints.py");
    let output = Command::new(python).arg(script).arg(&file).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let seen: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
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
    eprintln!("Blender's joints lie within {worst:.4} mm of the motion's");
    assert!(worst < 0.1, "{worst} mm");
}
