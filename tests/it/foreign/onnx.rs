//! Exported generators in Python (`make readers`) and in headless Chromium (`make web`, `make driver`), by the programs
//! of the guide: their joints are those of generation.

use crate::fixtures::figures::FPS;
use crate::generate::onnx_export::{TOLERANCE, difference, export, sound, write_sequence, write_speaker};
use base64::Engine as _;
use orator::guide::TOPICS;
use orator_base::types::pose3d::Motion;
use orator_formats::{npy, wav};
use orator_gesture::generate::seq2seq::architecture::Architecture;
use orator_nn::gan::generator::Preset;
use orator_test_support::skip::{browser_driver, onnx_web, readers, skip};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Code blocks of the guide in a language.
fn guide(language: &str) -> Vec<String> {
    let page = TOPICS.iter().find(|topic| topic.name == "onnx").unwrap().text;
    let fence = format!("```{language}\n");
    page.split(&fence).skip(1).map(|block| block.split("```").next().unwrap().to_owned()).collect()
}

/// A GAN and a sequence network in folders with their exported files and `speech.wav`, and the joints of generation.
fn exported_folders(dir: &Path) -> [(&'static str, Motion); 2] {
    ["gan", "sequence"].map(|name| {
        let dir = dir.join(name);
        std::fs::create_dir(&dir).unwrap();
        wav::write(&dir.join("speech.wav"), &sound(3.3)).unwrap();
        match name {
            "gan" => write_speaker(&dir.join("host.safetensors"), Preset::Light, FPS, true, false),
            _ => write_sequence(&dir.join("host.safetensors"), Architecture::Adversarial, false),
        }
        export(&dir, "--checkpoint host.safetensors --export model.onnx");
        export(&dir, "--checkpoint host.safetensors --audio speech.wav --out generated.npy");
        (name, npy::read(&dir.join("generated.npy"), FPS).unwrap())
    })
}

#[test]
fn the_programs_of_the_guide_run_exported_models_in_python() {
    let Some(readers) = readers("onnxruntime") else { return };
    let folder = tempfile::tempdir().unwrap();
    let blocks = guide("python");
    for ((name, motion), second) in exported_folders(folder.path()).into_iter().zip([1, 2]) {
        let dir = folder.path().join(name);
        let program = format!("{}{}np.save('joints.npy', joints)\n", blocks[0], blocks[second]);
        let mut python = Command::new("python3");
        let python = python.args(["-c", &program, "speech.wav"]).env("PYTHONPATH", &readers).current_dir(&dir);
        let output = python.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let joints = npy::read(&dir.join("joints.npy"), FPS).unwrap().joints;
        assert_eq!(joints.dim(), motion.joints.dim());
        let worst = difference(&motion, joints.as_slice().unwrap());
        eprintln!("ONNX: {name} in Python: joints differ by {worst:.2e} m");
        assert!(worst < TOLERANCE, "{name}: {worst}");
    }
}

#[test]
fn the_program_of_the_guide_runs_exported_models_in_a_browser() {
    let (Some(web), Some(_)) = (onnx_web(), browser_driver()) else { return };
    if !Path::new("/usr/bin/chromium").exists() {
        return skip("no browser is installed (package chromium)");
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let motions = exported_folders(dir);
    std::fs::write(dir.join("gestures.mjs"), &guide("js")[0]).unwrap();
    let samples: Vec<u8> = sound(3.3).samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
    std::fs::write(dir.join("samples.f32"), samples).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/foreign/onnx_page.mjs");
    let mut node = Command::new("node");
    let output = node.arg(script).arg(dir).args(["gan", "sequence"]).env("ORATOR_WEB", web).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let results: BTreeMap<String, String> = serde_json::from_slice(&output.stdout).unwrap();
    for (name, motion) in motions {
        let bytes = base64::engine::general_purpose::STANDARD.decode(&results[name]).unwrap();
        let joints: Vec<f32> =
            bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
        assert_eq!(joints.len(), motion.n_frames() * 147);
        let worst = difference(&motion, &joints);
        eprintln!("ONNX: {name} in Chromium: joints differ by {worst:.2e} m");
        assert!(worst < TOLERANCE, "{name}: {worst}");
    }
}
