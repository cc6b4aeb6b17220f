//! An avatar (.vrm) and its motion (.vrma) opened by three-vrm: the humanoid is whole, the motion puts its joints where ours
//! are (`make vrm` installs it).

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
fn three_vrm_sees_a_whole_humanoid_that_moves_as_ours() {
    let Some(modules) = three_vrm() else { return };
    let folder = tempfile::tempdir().unwrap();
    let performance = perform(&swinging(3, 20), None, &AnimationOptions::default());
    let [avatar, motion] = ["avatar.vrm", "motion.vrma"].map(|name| folder.path().join(name));
    for path in [&avatar, &motion] {
        let format = ExportFormat::from_path(path).unwrap();
        format.write(path, &performance, &ExportContent::default(), &Silent).unwrap();
    }
    // Node looks for modules beside the script.
    let script = modules.join("vrm_joints.mjs");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/vrm_joints.mjs"), &script).unwrap();
    let output = Command::new("node").arg(&script).args([&avatar, &motion]).arg(FPS.num.to_string()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let seen: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&seen["meta"]["metaVersion"], &seen["meta"]["licenseUrl"]),
        (&Value::from("1"), &Value::from("https://vrm.dev/licenses/1.0/"))
    );
    assert_eq!((&seen["expressions"][0], seen["frames"].as_array().unwrap().len()), (&Value::from("aa"), 20));
    let names: Vec<&String> = seen["frames"][0].as_object().unwrap().keys().collect();
    assert_eq!(names.len(), 49, "{names:?}");
    let worst = worst_joint_mm(&performance, Names::Vrm, |frame, name| {
        let place = &seen["frames"][frame][name];
        // Ends of bones are no joints of a humanoid.
        let expected = || {
            let joint = Names::Vrm.of(&performance.rig.skeleton).iter().position(|known| known == name).unwrap();
            assert!(performance.rig.skeleton.joints[joint].end, "{name}");
            performance.clip.positions(frame)[joint]
        };
        if place.is_null() { expected() } else { std::array::from_fn(|k| 100.0 * place[k].as_f64().unwrap()) }
    });
    eprintln!("VRM: three-vrm's joints lie within {worst:.5} mm of the motion's");
    assert!(worst < 0.1, "{worst} mm");
}
