//! `orator animate`, `evaluate` and `import` read and write SMPL-X files by name and content.

use crate::dataset::import::wav;
use crate::fixtures::figures::swinging;
use orator_formats::mocap::motion_file;
use orator_formats::npz::Npz;
use orator_formats::{joints_npz, npy};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Exit code, JSON and printed text.
fn orator(dir: &Path, args: &str) -> (i32, Value, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.arg("--json").args(args.split_whitespace()).current_dir(dir).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.code().unwrap_or(-1), serde_json::from_slice(&output.stdout).unwrap_or_default(), printed)
}

fn done(dir: &Path, args: &str) -> Value {
    let (code, json, printed) = orator(dir, args);
    assert_eq!(code, 0, "{args}: {printed}");
    json
}

#[test]
fn verbs_read_and_write_smplx_files() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    joints_npz::write(&dir.join("joints.npz"), &swinging(4, 90)).unwrap();
    let facts = done(dir, "animate joints.npz --out a.smplx.npz a.npz --fps 30");
    assert_eq!(facts["next"], "orator animate joints.npz --out a.mp4");
    let mut npz = Npz::open(&dir.join("a.smplx.npz")).unwrap();
    for (key, shape) in [
        ("poses", vec![180, 165]),
        ("trans", vec![180, 3]),
        ("betas", vec![300]),
        ("expressions", vec![180, 100]),
        ("mocap_frame_rate", vec![]),
        ("orator_rest_joints", vec![65, 3]),
    ] {
        assert_eq!(npz.numbers(key, &[]).unwrap().shape(), shape, "{key}");
    }
    let text = |key: &str, npz: &mut Npz| npz.text(key).unwrap();
    assert_eq!((text("model", &mut npz), text("gender", &mut npz)), ("smplx2020".to_owned(), "neutral".to_owned()));

    // The content decides what an .npz is, and the captured body is kept.
    std::fs::rename(dir.join("a.smplx.npz"), dir.join("talk.npz")).unwrap();
    let facts = done(dir, "animate talk.npz --out talk.bvh b.smplx.npz");
    assert_eq!(facts["report"]["captured"], serde_json::json!(["head", "spine", "legs"]));
    assert_eq!((&facts["n_frames"], &facts["fps_assumed"]), (&180.into(), &false.into()));
    let (code, _, printed) = orator(dir, "animate talk.npz --out b.bvh --units cm");
    assert!(code == 1 && printed.contains("--units applies to .bvh files"), "{printed}");
    let (code, _, printed) = orator(dir, "animate talk.npz --out b.bvh --input-fps 25");
    assert!(code == 1 && printed.contains("has a frame rate of 30 fps"), "{printed}");

    // Files are paired without the ending, and are equal up to rounding.
    for (name, file) in [("truth/talk.npz", "a.npz"), ("prediction/talk.smplx.npz", "b.smplx.npz")] {
        std::fs::create_dir_all(dir.join(name).parent().unwrap()).unwrap();
        std::fs::rename(dir.join(file), dir.join(name)).unwrap();
    }
    let facts = done(dir, "evaluate --truth truth --prediction prediction");
    assert_eq!((&facts["n_clips"], &facts["n_frames"]), (&1.into(), &180.into()));
    assert_eq!(facts["metrics"][0]["values"]["prediction"]["value"], 1.0, "every keypoint is correct");

    // A folder of rotations becomes a folder of rotations; each name loses its complete ending.
    done(dir, "animate prediction --format bvh,smplx.npz --out out");
    assert!(dir.join("out/talk.bvh").is_file() && motion_file::read(&dir.join("out/talk.smplx.npz"), None).is_ok());
    let (code, _, printed) = orator(dir, "lift talk.npz --out talk.smplx.npz");
    assert_ne!(code, 0, "{printed}");

    // An import finds the sound of the same name.
    std::fs::create_dir(dir.join("takes")).unwrap();
    std::fs::copy(dir.join("out/talk.smplx.npz"), dir.join("takes/talk.smplx.npz")).unwrap();
    npy::write(&dir.join("takes/other.npy"), &swinging(1, 9)).unwrap();
    wav(&dir.join("takes/talk.wav"), 6.0, 1);
    let facts = done(dir, "import takes --speaker host --out dataset --kind smplx --validation 0 --test 0");
    assert_eq!(
        (&facts["imported"], &facts["rejected"], &facts["failed"]),
        (&1.into(), &0.into(), &0.into()),
        "{facts}"
    );
    done(dir, "dataset verify --deep dataset");
    let known = motion_file::read(&dir.join("takes/talk.smplx.npz"), None).unwrap().motion;
    done(dir, "animate dataset --out back.npz");
    assert_eq!(2 * joints_npz::read(&dir.join("back.npz")).unwrap().n_frames(), known.n_frames());
}
