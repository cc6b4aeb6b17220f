//! An avatar (.vrm) and its motion (.vrma) loaded by three-vrm (`make vrm`): the humanoid is complete, and its joints
//! have the positions of the motion.

use crate::fixtures::animation::truth::worst_joint_mm;
use crate::fixtures::figures::{FPS, swinging};
use orator_avatar::animate::export::file::{ExportContent, ExportFormat};
use orator_avatar::animate::rig::names::Names;
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::stage::progress::Silent;
use orator_test_support::skip::three_vrm;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

#[test]
fn three_vrm_loads_a_complete_humanoid_with_the_motion() {
    let Some(modules) = three_vrm() else { return };
    let folder = tempfile::tempdir().unwrap();
    let performance = perform(&swinging(3, 20), None, &AnimationOptions::default());
    let [avatar, motion] = ["avatar.vrm", "motion.vrma"].map(|name| folder.path().join(name));
    for path in [&avatar, &motion] {
        let format = ExportFormat::from_path(path).unwrap();
        format.write(path, &performance, &ExportContent::default(), &Silent).unwrap();
    }
    // Node resolves modules relative to the script.
    let script = modules.join("vrm_joints.mjs");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/vrm_joints.mjs"), &script).unwrap();
    let output = Command::new("node").arg(&script).args([&avatar, &motion]).arg(FPS.num.to_string()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let loaded: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&loaded["meta"]["metaVersion"], &loaded["meta"]["licenseUrl"]),
        (&Value::from("1"), &Value::from("https://vrm.dev/licenses/1.0/"))
    );
    assert_eq!((&loaded["expressions"][0], loaded["frames"].as_array().unwrap().len()), (&Value::from("aa"), 20));
    let names: Vec<&String> = loaded["frames"][0].as_object().unwrap().keys().collect();
    assert_eq!(names.len(), 49, "{names:?}");
    let worst = worst_joint_mm(&performance, Names::Vrm, |frame, name| {
        let position = &loaded["frames"][frame][name];
        // A VRM humanoid has no end joints.
        let expected = || {
            let joint = Names::Vrm.of(&performance.rig.skeleton).iter().position(|known| known == name).unwrap();
            assert!(performance.rig.skeleton.joints[joint].end, "{name}");
            performance.clip.positions(frame)[joint]
        };
        if position.is_null() { expected() } else { std::array::from_fn(|k| 100.0 * position[k].as_f64().unwrap()) }
    });
    eprintln!("VRM: three-vrm's joints lie within {worst:.5} mm of the motion's");
    assert!(worst < 0.1, "{worst} mm");
}
