//! `orator animate`, `evaluate` and `import` read and write SMPL-X files by name and content.

use crate::dataset::import::wav;
use crate::fixtures::figures::swinging;
use ndarray::{Array2, Ix2};
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

/// Arrays of Seamless Interaction with the rotations of an SMPL-X file, on every other frame.
fn write_seamless(from: &Path, to: &Path) {
    let poses = Npz::open(from).unwrap().numbers("poses", &[None, Some(165)]).unwrap();
    let poses = poses.into_dimensionality::<Ix2>().unwrap();
    let part = |joint: usize, n: usize| poses.slice(ndarray::s![.., 3 * joint..3 * (joint + n)]).to_owned();
    let mut npz = ndarray_npy::NpzWriter::new(std::fs::File::create(to).unwrap());
    for (key, joint, n) in
        [("global_orient", 0, 1), ("body_pose", 1, 21), ("left_hand_pose", 25, 15), ("right_hand_pose", 40, 15)]
    {
        npz.add_array(format!("smplh:{key}"), &part(joint, n)).unwrap();
    }
    npz.add_array("smplh:is_valid", &Array2::from_elem((poses.nrows(), 1), true)).unwrap();
    npz.finish().unwrap();
}

#[test]
fn tar_files_of_seamless_interaction_are_imported() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let key = "V00_S0001_I00000001_P0000";
    joints_npz::write(&dir.join("joints.npz"), &swinging(4, 90)).unwrap();
    done(dir, "animate joints.npz --out a.smplx.npz --fps 30");
    for name in ["takes", "shards"] {
        std::fs::create_dir(dir.join(name)).unwrap();
    }
    write_seamless(&dir.join("a.smplx.npz"), &dir.join(format!("takes/{key}.npz")));
    wav(&dir.join(format!("takes/{key}.wav")), 6.0, 1);
    let transcript = serde_json::json!({ "id": key, "metadata:vad": [{ "start": 0.0, "end": 2.0 }],
        "metadata:transcript": [{ "start": 0.5, "end": 1.5, "transcript": "hello there",
            "words": [{ "word": "hello", "start": 0.5, "end": 0.9, "score": 0.9 },
                      { "word": "there", "start": 1.0, "end": 1.5, "score": 0.8 }] }] });
    std::fs::write(dir.join(format!("takes/{key}.json")), transcript.to_string()).unwrap();
    std::fs::write(dir.join(format!("takes/{key}.mp4")), [0u8; 3000]).unwrap();
    let mut tar = tar::Builder::new(std::fs::File::create(dir.join("shards/0000.tar")).unwrap());
    for ending in ["json", "mp4", "npz", "wav"] {
        let name = format!("{key}.{ending}");
        tar.append_path_with_name(dir.join("takes").join(&name), name).unwrap();
    }
    tar.finish().unwrap();
    drop(tar);
    std::fs::remove_file(dir.join(format!("takes/{key}.mp4"))).unwrap();

    let options = "--speaker host --validation 0 --test 0";
    let unpacked = done(dir, &format!("import takes {options} --out unpacked"));
    let packed = done(dir, &format!("import shards {options} --out packed"));
    assert_eq!(packed["takes"][0]["file"], format!("shards/0000.tar/{key}.npz"));
    assert_eq!((&packed["secs"], &packed["imported"]), (&unpacked["secs"], &1.into()));
    assert_eq!(done(dir, &format!("import shards {options} --kind smplx --out smplx"))["imported"], 1);
    let shards = ["packed", "unpacked", "smplx"].map(|name| {
        let files = std::fs::read_dir(dir.join(name)).unwrap().map(|entry| entry.unwrap().path());
        let shard = files.into_iter().find(|path| path.extension().is_some_and(|ending| ending == "tar"));
        std::fs::read(shard.unwrap()).unwrap()
    });
    assert!(shards[0] == shards[1] && shards[0] == shards[2], "bytes of the dataset");
    let names = std::fs::read_dir(dir.join("packed")).unwrap().map(|entry| entry.unwrap().file_name());
    assert!(!names.into_iter().any(|name| name == "unpacked"), "temporary files are removed");
    let text = String::from_utf8_lossy(&shards[0]).into_owned();
    assert!(text.contains("hello") && text.contains("there"), "words of the transcript");

    // A truncated file fails with its name, and the others are imported.
    let bytes = std::fs::read(dir.join("shards/0000.tar")).unwrap();
    std::fs::write(dir.join("shards/0001.tar"), &bytes[..bytes.len() - 100_000]).unwrap();
    let (code, facts, printed) = orator(dir, &format!("import shards {options} --out both"));
    assert!(code == 2 && facts["imported"] == 1 && facts["failed"] == 1, "{printed}");
    assert!(printed.contains("0001.tar"), "{printed}");
}
