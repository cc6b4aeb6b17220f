//! Malicious files: names that point outside a folder, playlists that reference other files, counts that exhaust the
//! memory. Each is an error that names the file, and no other file is written or read.

use crate::fixtures::clips::ffmpeg;
use crate::fixtures::samples::constant_sample;
use crate::fixtures::write_dataset::write_dataset;
use ndarray::Array3;
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Split};
use orator_formats::{npy, wav};
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::{audio, probe};
use orator_test_support::project::files_under;
use std::fs;
use std::path::Path;
use std::process::Command;

const FPS: FrameRate = FrameRate::new(15, 1);

/// Exit code and printed text of the program in the folder `dir`.
fn run(dir: &Path, args: &[&str]) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_orator")).current_dir(dir).args(args).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    (output.status.code().unwrap_or(-1), text)
}

/// Replaces every `old` in a file.
fn change(file: &Path, old: &str, new: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(old), "{} in {}", old, file.display());
    fs::write(file, text.replace(old, new)).unwrap();
}

fn dataset(dir: &Path) {
    let samples = [("one-000000", Split::Train), ("two-000000", Split::Test)];
    let samples: Vec<_> = samples.iter().map(|(key, split)| (*split, constant_sample(key, 30, 1))).collect();
    write_dataset(dir, "host", FPS, &samples).unwrap();
}

#[test]
fn names_in_a_dataset_cannot_point_outside_its_folder() {
    let dir = tempfile::tempdir().unwrap();
    let outside = dir.path().join("outside").display().to_string();
    for (file, old, new) in [
        ("index.jsonl", "\"key\":\"one-000000\"", "\"key\":\"../../x\"".to_owned()),
        ("index.jsonl", "\"key\":\"one-000000\"", format!("\"key\":\"{outside}\"")),
        ("index.jsonl", "\"key\":\"one-000000\"", "\"key\":\"..\"".to_owned()),
        ("index.jsonl", "\"key\":\"one-000000\"", "\"key\":\"a\\u0000b\"".to_owned()),
        ("index.jsonl", "\"train-one-0000.tar\"", "\"../data/train-one-0000.tar\"".to_owned()),
        ("info.json", "\"train-one-0000.tar\"", "\"../data/train-one-0000.tar\"".to_owned()),
    ] {
        let data = dir.path().join("in/data");
        fs::create_dir_all(&data).unwrap();
        dataset(&data);
        change(&data.join(file), old, &new);
        let before = files_under(dir.path());
        let (code, errors) = run(dir.path(), &["animate", "in/data", "--format", "npy", "--out", "in/deep/out"]);
        assert!(code == 1 && errors.contains(file) && errors.contains("invalid file name"), "{new}: {errors}");
        assert!(errors.contains("line 1") || file != "index.jsonl", "{errors}");
        assert_eq!(files_under(dir.path()), before, "{new}");
        fs::remove_dir_all(&data).unwrap();
    }
}

#[test]
fn import_rejects_shards_of_other_names() {
    // Shards are hard-linked: a write to a linked `info.json` would change both datasets.
    for (other, expected) in [("../train-one-0000.tar", "invalid file name"), ("info.json", "belongs to another video")]
    {
        assert_shard_rejected(other, expected);
    }
}

fn assert_shard_rejected(other: &str, expected: &str) {
    let dir = tempfile::tempdir().unwrap();
    let data = dir.path().join("data");
    fs::create_dir_all(&data).unwrap();
    dataset(&data);
    let entry = data.join("videos/one.json");
    change(&entry, "\"train-one-0000.tar\"", &format!("{other:?}"));
    if other.starts_with("..") {
        fs::copy(data.join("train-one-0000.tar"), dir.path().join("train-one-0000.tar")).unwrap();
    }
    let hash = |file: &Path| blake3::hash(&fs::read(file).unwrap()).to_hex().to_string();
    let sums = data.join("checksums.b3");
    change(&sums, "  train-one-0000.tar", &format!("  {other}"));
    let text = fs::read_to_string(&sums).unwrap();
    let line = text.lines().find(|line| line.ends_with("videos/one.json")).unwrap();
    change(&sums, line, &format!("{}  videos/one.json", hash(&entry)));
    let (code, errors) = run(dir.path(), &["import", "data", "--out", "deep/er/out", "--speaker", "host"]);
    assert!(code == 2 && errors.contains("one.json") && errors.contains(expected), "{code} {errors}");
    assert!(!dir.path().join("deep/er/train-one-0000.tar").exists());
    assert_eq!(Dataset::open(dir.path().join("deep/er/out")).unwrap().samples(Split::Train).len(), 0);
}

#[test]
fn media_files_cannot_reference_other_files() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let sound = Sound { rate: 16_000, samples: vec![0.1; 16_000] };
    wav::write(&at("secret.wav"), &sound).unwrap();
    assert!(ffmpeg(dir.path(), "-f lavfi -i color=gray:size=64x64:duration=1:rate=10 secret.ts"));
    assert!(ffmpeg(dir.path(), "-f lavfi -i color=gray:size=64x64:duration=1:rate=10 -f image2 picture%d.png"));
    fs::copy(at("picture1.png"), at("a%d.png")).unwrap();
    for n in 1..4 {
        fs::copy(at("picture1.png"), at(&format!("a{n}.png"))).unwrap();
    }
    let secret = at("secret.ts").display().to_string();
    for (name, text) in [
        ("concat.mp4", "ffconcat version 1.0\nfile secret.ts\n".to_owned()),
        ("absolute.wav", format!("ffconcat version 1.0\nfile 'file://{secret}'\n")),
        ("hls.mp4", "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nsecret.ts\n#EXT-X-ENDLIST\n".to_owned()),
        ("list.m3u8", format!("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nfile://{secret}\n#EXT-X-ENDLIST\n")),
        (
            "dash.mp4",
            "<?xml version=\"1.0\"?>\n<MPD xmlns=\"urn:mpeg:dash:schema:mpd:2011\" type=\"static\"><Period/></MPD>\n"
                .to_owned(),
        ),
        (
            "session.mp4",
            "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\nm=audio 4 RTP/AVP 0\n".to_owned(),
        ),
    ] {
        fs::write(at(name), text).unwrap();
        let text = format!("{:#}", probe::probe(&at(name)).unwrap_err());
        assert!(text.contains(name) && text.contains("expected a video or audio file"), "{name}: {text}");
        assert!(audio::read_sound(&at(name)).is_err(), "{name}");
    }
    let text = format!("{:#}", probe::probe(&at("hls.mp4")).unwrap_err());
    assert!(text.contains("list of other files"), "{text}");
    assert!(probe::probe(&at("a%d.png")).is_err());
    assert!(probe::probe(&at("picture1.png")).is_ok() && probe::probe(&at("secret.ts")).is_ok());
}

#[test]
fn an_image_of_implausible_size_is_rejected() {
    let dir = tempfile::tempdir().unwrap();
    assert!(ffmpeg(dir.path(), "-f lavfi -i color=gray:size=64x64:duration=1:rate=10 -frames:v 1 picture.png"));
    let path = dir.path().join("picture.png");
    let mut bytes = fs::read(&path).unwrap();
    bytes[16..20].copy_from_slice(&30_000u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&30_000u32.to_be_bytes());
    fs::write(&path, bytes).unwrap();
    let error = FrameReader::open(&path, FPS).err().expect("the image was read");
    assert!(format!("{error:#}").contains("picture.png"), "{error:#}");
}

#[test]
fn an_unusual_name_in_a_tar_does_not_stop_an_import() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir_all(dir.path().join("in/a")).unwrap();
    dataset(&dir.path().join("in/a"));
    let mut tar = tar::Builder::new(fs::File::create(dir.path().join("in/odd.tar")).unwrap());
    for name in ["Foo Bar-1.json", "..json", "x/..wav", "\u{1b}[2J-1.wav"] {
        let mut header = tar::Header::new_ustar();
        header.set_size(2);
        header.as_ustar_mut().unwrap().name[..name.len()].copy_from_slice(name.as_bytes());
        header.set_cksum();
        tar.append(&header, &b"{}"[..]).unwrap();
    }
    tar.finish().unwrap();
    let (code, text) = run(dir.path(), &["import", "in", "--out", "out", "--speaker", "host"]);
    assert!(code == 2 && text.contains("Foo Bar") && text.contains("2 takes imported"), "{code} {text}");
    assert!(!text.contains('\u{1b}'), "{text:?}");
}

#[test]
fn audio_of_an_implausible_rate_is_rejected() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("slow.wav");
    for rate in [1, 3_999, 768_001] {
        wav::write(&path, &Sound { rate, samples: vec![0.1; 80_000] }).unwrap();
        let text = format!("{:#}", audio::read_sound(&path).unwrap_err());
        let expected = format!("invalid audio sample rate {rate} Hz in {}: expected 4000 to 768000 Hz", path.display());
        assert!(text.contains(&expected), "{text}");
    }
    wav::write(&path, &Sound { rate: 4_000, samples: vec![0.1; 8_000] }).unwrap();
    assert_eq!(audio::read_sound(&path).unwrap().samples.len(), 32_000);
}

#[test]
fn joints_at_implausible_distances_are_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("far.npy");
    for far in [1e6f32, 2e38] {
        let mut joints = constant_sample("a-000000", 30, 1).motion.joints;
        joints[[7, 3, 1]] = far;
        npy::write(&path, &Motion::from_joints(FPS, joints)).unwrap();
        let (code, errors) = run(dir.path(), &["animate", "far.npy", "--out", "far.glb"]);
        assert_eq!(code, 1, "{errors}");
        assert!(errors.contains("far.npy") && errors.contains("frame 7, joint 3"), "{errors}");
        assert!(!dir.path().join("far.glb").exists());
    }
}

#[test]
fn a_failed_video_reserves_no_name_and_prints_no_control_characters() {
    let dir = tempfile::tempdir().unwrap();
    for folder in ["in/a", "in/b"] {
        let folder = dir.path().join(folder);
        fs::create_dir_all(&folder).unwrap();
        dataset(&folder);
    }
    fs::write(dir.path().join("in/a/videos/one.json"), "no JSON").unwrap();
    fs::write(dir.path().join("in/empty.tar"), "").unwrap();
    fs::write(dir.path().join("in/c.bvh"), "\u{1b}[2J\u{7}").unwrap();
    let (code, text) = run(dir.path(), &["import", "in", "--out", "out", "--speaker", "host"]);
    assert_eq!(code, 2, "{text}");
    assert!(text.contains("one.json is not a valid file of a dataset"), "{text}");
    assert!(text.contains("empty.tar: import: it contains no files"), "{text}");
    assert!(text.contains("found `\u{fffd}[2J\u{fffd}`, expected `HIERARCHY`"), "{text:?}");
    let keys: Vec<String> = Split::ALL
        .iter()
        .flat_map(|split| Dataset::open(dir.path().join("out")).unwrap().samples(*split))
        .map(|s| s.key.to_string())
        .collect();
    assert_eq!(keys, ["one-000000", "two-000000"]);
}

/// Runs the program for at most a minute, since it must not wait for a writer or read endlessly.
fn run_with_timeout(dir: &Path, args: &[&str]) -> (i32, String) {
    let mut command = Command::new("timeout");
    let output = command.args(["60", env!("CARGO_BIN_EXE_orator")]).args(args).current_dir(dir).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    (output.status.code().unwrap_or(-1), text)
}

#[test]
fn pipes_and_devices_are_rejected_as_input_files() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let pipe = |name: &str| {
        let _ = fs::remove_file(at(name));
        rustix::fs::mkfifoat(rustix::fs::CWD, at(name), rustix::fs::Mode::RWXU).unwrap();
    };
    let device = |name: &str| {
        let _ = fs::remove_file(at(name));
        std::os::unix::fs::symlink("/dev/zero", at(name)).unwrap();
    };
    fs::create_dir_all(at("kp/talk")).unwrap();
    fs::write(at("kp/talk/a_0_keypoints.json"), "{\"people\": []}").unwrap();
    pipe("kp/talk/a_1_keypoints.json");
    let error = format!("{:#}", orator_formats::keypoints::read(&at("kp/talk")).unwrap_err());
    assert!(error.contains("a_1_keypoints.json: it is a named pipe, expected a regular file"), "{error}");
    for name in ["a.npy", "a.npz", "a.txt", "a.bvh"] {
        for (kind, put) in [("named pipe", &pipe as &dyn Fn(&str)), ("device", &device)] {
            put(name);
            let (code, errors) = run_with_timeout(dir.path(), &["animate", name, "--out", "out.glb"]);
            let expected = format!("it is a {kind}, expected a regular file");
            assert!(code == 1 && errors.contains(name) && errors.contains(&expected), "{code} {errors}");
        }
    }
    for file in ["info.json", "stats.json", "index.jsonl", "checksums.b3", "videos/one.json", "train-one-0000.tar"] {
        fs::create_dir_all(at("data")).unwrap();
        dataset(&at("data"));
        pipe(&format!("data/{file}"));
        for args in [&["dataset", "verify", "data"][..], &["import", "data", "--out", "out", "--speaker", "host"]] {
            let (code, text) = run_with_timeout(dir.path(), args);
            // An import rebuilds the files common to all videos.
            assert!((1..=2).contains(&code) || args[0] == "import" && code == 0, "{file}: {code} {text}");
            let _ = fs::remove_dir_all(at("out"));
        }
        fs::remove_dir_all(at("data")).unwrap();
    }
}

#[test]
fn implausible_numbers_in_a_dataset_are_rejected_by_field() {
    let dir = tempfile::tempdir().unwrap();
    for (file, pointer, value, expected) in [
        ("info.json", "/fps/den", serde_json::json!(0), "invalid frame rate 15/0"),
        ("info.json", "/bone_lengths_metres/3", serde_json::json!(-0.2), "`bone_lengths_metres` has the length -0.2"),
        ("stats.json", "/std/5/1", serde_json::json!(-1.0), "`std` contains -1.0"),
        ("stats.json", "/mean/5/1", serde_json::json!(1e300), "`mean` contains 1e300"),
    ] {
        let data = dir.path().join("data");
        fs::create_dir(&data).unwrap();
        dataset(&data);
        let path = data.join(file);
        let mut fields: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        *fields.pointer_mut(pointer).unwrap() = value;
        fs::write(&path, fields.to_string()).unwrap();
        let error = format!("{:#}", Dataset::open(&data).err().unwrap());
        assert!(error.contains(file) && error.contains(expected), "{pointer}: {error}");
        fs::remove_dir_all(&data).unwrap();
    }
}

#[cfg(unix)]
#[test]
fn searches_of_circular_folder_links_end() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("takes");
    fs::create_dir(&folder).unwrap();
    for name in ["one", "two"] {
        std::os::unix::fs::symlink(".", folder.join(name)).unwrap();
    }
    let far = Array3::<f32>::zeros((4, 49, 3));
    let text = orator_formats::authors_txt::format(&Motion::from_joints(FPS, far));
    fs::write(folder.join("a.txt"), text).unwrap();
    let (code, errors) = run(dir.path(), &["import", "takes", "--out", "out", "--speaker", "host"]);
    assert!(code == 1 && errors.contains("a.txt"), "{code} {errors}");
    let (code, errors) =
        run(dir.path(), &["generate", "--checkpoint", "none", "--audio-folder", "takes", "--out-folder", "motions"]);
    assert!(code == 1 && !errors.is_empty(), "{code} {errors}");
}
