//! Receivers by others: python-osc reads the bundles (`make readers`).

use crate::fixtures::models::untrained::write_bounded_speaker;
use crate::generate::onnx_export::sound;
use orator_test_support::skip::readers;
use serde_json::Value;
use std::process::Command;

/// Bones that every VRM humanoid must have, in Unity's names.
const REQUIRED: [&str; 15] = [
    "Hips",
    "Spine",
    "Head",
    "LeftUpperArm",
    "LeftLowerArm",
    "LeftHand",
    "RightUpperArm",
    "RightLowerArm",
    "RightHand",
    "LeftUpperLeg",
    "LeftLowerLeg",
    "LeftFoot",
    "RightUpperLeg",
    "RightLowerLeg",
    "RightFoot",
];

#[test]
fn python_osc_reads_every_bundle() -> anyhow::Result<()> {
    let Some(readers) = readers("pythonosc") else { return Ok(()) };
    let dir = tempfile::tempdir()?;
    let [model, wav] = ["model.safetensors", "speech.wav"].map(|name| dir.path().join(name));
    write_bounded_speaker(&model, 0.5);
    super::session::write_wav(&wav, &sound(3.0))?;
    let mut command = Command::new("python3");
    command.arg("fixtures/reference/live_session.py").arg(env!("CARGO_BIN_EXE_orator"));
    command.arg(&model).arg(&wav).arg("5").env("PYTHONPATH", readers);
    let done = command.output()?;
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let found: Value = serde_json::from_slice(&done.stdout)?;
    eprintln!("{found}");
    let vmc = &found["live"]["outputs"][0];
    assert_eq!((&vmc["n_sent"], &vmc["n_dropped"]), (&found["n_bundles"], &0.into()), "{found}");
    let bones: Vec<&str> = found["bones"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert!(bones.len() == 49 && REQUIRED.iter().all(|bone| bones.contains(bone)), "{bones:?}");
    assert!(found["length_error"].as_f64().unwrap() < 1e-5 && found["n_bundles"].as_u64().unwrap() > 200, "{found}");
    // Poses are omitted only where the machine stopped the program for a while.
    let n_omitted = found["live"]["n_omitted"].as_u64().unwrap();
    assert!(found["n_unordered"].as_u64().unwrap() <= n_omitted, "{found}");
    Ok(())
}
