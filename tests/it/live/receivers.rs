//! Receivers by others: python-osc reads the bundles (`make readers`).

use crate::fixtures::models::untrained::write_bounded_speaker;
use crate::generate::onnx_export::sound;
use ndarray::Array2;
use orator_gesture::generate::GestureGenerator;
use orator_live::lines::JsonLines;
use orator_live::pose::LiveBody;
use orator_live::session::{PoseSink, TimedPose};
use orator_live::vmc::VmcSocket;
use orator_test_support::skip::readers;
use serde_json::Value;
use std::io::Write;
use std::net::UdpSocket;
use std::process::Command;
use std::time::Instant;

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

/// A writer that accepts nothing.
struct Stuck;

impl Write for Stuck {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        std::thread::sleep(std::time::Duration::from_secs(3600));
        Ok(0)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn receivers_that_are_missing_or_stuck_delay_nobody() -> anyhow::Result<()> {
    let dir = tempfile::tempdir()?;
    let model = dir.path().join("model.safetensors");
    write_bounded_speaker(&model, 0.5);
    let generator = GestureGenerator::open(&model)?;
    let mut body = LiveBody::new(&generator.metadata);
    let closed = UdpSocket::bind("127.0.0.1:0")?.local_addr()?.to_string();
    let mut vmc = VmcSocket::connect(&closed)?.with_bones(body.bones.clone());
    let mut lines = JsonLines::new(Stuck, body.bones.clone());
    let pose = TimedPose { secs: 1.0, pose: body.pose(&Array2::zeros((144, 1)), 1.0)? };
    let started = Instant::now();
    for _ in 0..500 {
        vmc.send(&pose);
        lines.send(&pose);
    }
    assert!(started.elapsed().as_secs() < 10);
    let [vmc, lines] = [vmc.facts(), lines.facts()];
    assert!(vmc.note.is_some_and(|note| note.contains(&closed)) && vmc.n_sent + vmc.n_dropped == 500);
    assert!(lines.n_dropped > 400 && lines.note.is_some(), "{lines:?}");
    Ok(())
}
