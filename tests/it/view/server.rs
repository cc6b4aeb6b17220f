//! The server of `orator view`: what it reads from a project, what it generates, and hostile requests.

use crate::fixtures::models::untrained::write_untrained_speaker;
use crate::fixtures::viewer::Viewer;
use orator_test_support::project::Project;
use serde_json::{Value, json};
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

pub(super) fn view(project: &Project, more: &[&str]) -> Viewer {
    Viewer::start(project.command(&[&["view"], more].concat()))
}

/// Project with a processed video and an untrained model of the speaker.
pub(super) fn processed() -> Project {
    let project = Project::with_clips("view", 1, 12.0);
    let run = project.run(&[]);
    assert_eq!(run.code, 0, "{}", run.errors);
    let model = project.work().join("gan/host");
    fs::create_dir_all(&model).unwrap();
    write_untrained_speaker(&model.join("best.safetensors"));
    let lines = [
        r#"{"step":1,"l1":0.9,"adversarial":0.5,"discriminator":0.7}"#,
        r#"{"step":2,"l1":0.8,"adversarial":0.4,"discriminator":0.6}"#,
        r#"{"step":2,"validation":{"generator":{"l1":0.7,"pck":0.4},"mean_pose":{"l1":0.9},"score":2.5,"alarm":"collapsed"}}"#,
    ];
    fs::write(model.join("metrics.jsonl"), lines.join("\n") + "\n").unwrap();
    project
}

/// The result `id` once it is done.
fn finished(viewer: &Viewer, id: &str) -> Value {
    let begun = Instant::now();
    loop {
        let results = viewer.json("api/results");
        let result = results["results"].as_array().unwrap().iter().find(|result| result["id"] == id).unwrap().clone();
        if ["done", "failed"].contains(&result["state"].as_str().unwrap()) && result["film"] != "queued" {
            return result;
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "{result}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn a_project_is_shown_and_its_model_generates() {
    let project = processed();
    let viewer = view(&project, &[]);
    let facts = viewer.json("api/project");
    assert_eq!(
        (&facts["editable"], &facts["speakers"][0], &facts["file"]),
        (&false.into(), &"host".into(), &Value::Null)
    );
    let videos = viewer.json("api/videos")["videos"].take();
    assert_eq!((videos.as_array().unwrap().len(), &videos[0]["state"]), (1, &"done".into()));
    let path = format!("api/videos/{}", videos[0]["id"].as_str().unwrap());
    let video = viewer.json(&path);
    let n_frames = video["n_frames"].as_u64().unwrap() as usize;
    let duration = video["duration_secs"].as_f64().unwrap();
    assert!(n_frames > 170 && (duration - 12.0).abs() < 0.2, "{n_frames} frames, {duration} s");
    let secs = |list: &Value| -> f64 {
        let span = |span: &Value| span[1].as_f64().unwrap() - span[0].as_f64().unwrap();
        list.as_array().unwrap().iter().map(span).sum()
    };
    let (accepted, rejected) = (secs(&video["accepted"]), secs(&video["rejected"]));
    assert!((accepted + rejected - duration).abs() < 1e-6 && accepted > 3.0, "{accepted} + {rejected}");
    assert!(
        video["has_motion"] == true
            && secs(&video["strokes"].as_array().unwrap().iter().map(|s| json!([s[2], s[3]])).collect()) > 1.0
    );

    let (status, wave) = viewer.get(&format!("{path}/wave"));
    assert!(status == 200 && wave.len().abs_diff(240) <= 2 && wave.iter().any(|peak| *peak > 10), "{}", wave.len());
    // Rows of 59 points with x, y and score, at most those of the video.
    let (status, bytes) = viewer.get(&format!("{path}/keypoints?start=3&n=5"));
    assert_eq!((status, bytes.len()), (200, 5 * 59 * 3 * 4));
    let first: Vec<f32> = bytes.chunks_exact(4).map(|v| f32::from_le_bytes(v.try_into().unwrap())).take(9).collect();
    let nose = &first[..3];
    assert!((0.0..1280.0).contains(&nose[0]) && nose[2] > 0.3, "{nose:?}");
    assert_eq!(viewer.get(&format!("{path}/keypoints?start={n_frames}&n=9")).1.len(), 0);
    assert_eq!(viewer.get(&format!("{path}/keypoints?start=18446744073709551615&n=9")).1.len(), 0);
    let start = video["accepted"][0][0].as_f64().unwrap();
    let (status, glb) = viewer.get(&format!("{path}/avatar.glb?start_secs={start}&end_secs={}", start + 2.0));
    assert!(status == 200 && glb.starts_with(b"glTF") && glb.len() > 100_000, "{status}");
    let name = videos[0]["id"].as_str().unwrap();
    let source = fs::read(project.clips().remove(0)).unwrap();
    assert!(viewer.get(&format!("media/{name}")).1 == source, "the bytes of the video file");

    let stages = viewer.json("api/stages");
    assert_eq!((&stages["stages"][0]["name"], &stages["stages"][0]["done"]), (&"extract".into(), &1.into()));
    let training = viewer.json("api/trainings")["trainings"][0].take();
    assert_eq!(
        (&training["name"], &training["state"], &training["step"]),
        (&"gan/host".into(), &"ended".into(), &2.into())
    );
    assert_eq!((&training["best_step"], &training["alarms"][0]), (&2.into(), &"collapsed".into()));
    let curves = viewer.json("api/training?name=gan/host&after=1");
    assert_eq!((curves["train"].as_array().unwrap().len(), &curves["train"][0]["discriminator"]), (1, &0.6.into()));
    assert_eq!(
        (&curves["validations"][0]["mean_pose_l1"], &curves["validations"][0]["pck"]),
        (&0.9.into(), &0.4.into())
    );

    // A dropped sound, and a clip of the dataset beside the truth.
    let wav = fs::read(project.written("extract", "clip-1", "audio.wav")).unwrap();
    let (status, reply) =
        viewer.post("api/results?checkpoint=gan/host&name=talk.MP3", "application/octet-stream", &wav);
    assert_eq!(status, 200, "{reply}");
    let id = reply["id"].as_str().unwrap();
    let result = finished(&viewer, id);
    assert_eq!(result["files"], json!(["speech.mp3", "motion.bvh", "motion.glb", "motion.vrma"]), "{result}");
    assert!(viewer.get(&format!("results/{id}/motion.glb")).1.starts_with(b"glTF"));
    assert!(viewer.get(&format!("results/{id}/motion.bvh")).1.starts_with(b"HIERARCHY"));
    assert_eq!((&result["seed"], &result["film"], &result["speaker"]), (&Value::Null, &"".into(), &Value::Null));
    let seeded = viewer.post("api/results?checkpoint=gan/host&seed=3&name=x.wav", "application/octet-stream", &wav).1;
    let seeded = finished(&viewer, seeded["id"].as_str().unwrap());
    assert!(seeded["message"].as_str().unwrap().contains("has no variants"), "{seeded}");
    assert_eq!(viewer.get(&format!("results/{id}/motion.mp4")).0, 404);
    assert_eq!(viewer.post(&format!("api/results/{id}/video"), "", b"").0, 200);
    assert!(finished(&viewer, id)["files"].as_array().unwrap().contains(&"motion.mp4".into()));
    let pair = viewer.post("api/pair?name=gan/host", "", b"").1;
    let pair = finished(&viewer, pair["id"].as_str().unwrap());
    assert_eq!(pair["files"], json!(["speech.wav", "truth.glb", "generated.glb"]), "{pair}");
    // Sounds that cannot be read are reported on the page.
    let broken = viewer.post("api/results?checkpoint=gan/host&name=x.mp3", "application/octet-stream", b"no sound").1;
    let broken = finished(&viewer, broken["id"].as_str().unwrap());
    assert!(broken["state"] == "failed" && !broken["message"].as_str().unwrap().is_empty(), "{broken}");
}

/// Status of the reply to raw bytes; 0 if the connection was closed without a reply.
fn raw(address: &str, bytes: &[u8]) -> u16 {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let _ = stream.write_all(bytes);
    let mut reply = [0; 12];
    let read = stream.read_exact(&mut reply);
    if read.is_err() { 0 } else { std::str::from_utf8(&reply[9..]).unwrap().parse().unwrap() }
}

#[test]
fn hostile_requests_reach_nothing() {
    let project = Project::with_clips("view-hostile", 1, 2.0);
    let viewer = view(&project, &[]);
    let address = viewer.address().to_owned();
    let token = viewer.url.trim_end_matches('/').rsplit('/').next().unwrap().to_owned();
    let name = viewer.json("api/videos")["videos"][0]["id"].as_str().unwrap().to_owned();
    let get = |target: &str, host: &str| {
        raw(&address, format!("GET {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").as_bytes())
    };
    assert_eq!(get(&format!("/{token}/api/project"), &address), 200);
    // Without the token, or with a wrong one, nothing is found; other hosts are rejected.
    let wrong = "0".repeat(32);
    for target in [
        "/",
        "/api/project",
        &format!("/{wrong}/api/project"),
        &format!("/{}/api/project", &token[1..]),
        &format!("/{}/", token.to_uppercase().replace(|c: char| c.is_ascii_digit(), "A")),
    ] {
        assert_eq!(get(target, &address), 404, "{target}");
    }
    for host in ["evil.example", "127.0.0.1.evil.example", "192.0.2.1"] {
        assert_eq!(get(&format!("/{token}/api/project"), host), 421, "{host}");
    }
    let escapes = [
        "media/host/../../../etc/passwd",
        "media/host/..%2f..%2fpipeline.toml",
        "media/host/%2fetc%2fpasswd",
        "media/..%2f..%2f/x",
        "media/host/unknown",
        "api/videos/other/unknown",
        "results/../pipeline.toml",
        "results/0000000000000000/motion.glb",
        "results/%2e%2e/%2e%2e",
        "file",
        "file-audio",
        "three.js/../../../x",
    ];
    for path in escapes {
        assert_eq!(get(&format!("/{token}/{path}"), &address), 404, "{path}");
    }
    for query in ["start=0&n=100000", "start=-1&n=1", "start=x&n=1", "start=0"] {
        assert_eq!(get(&format!("/{token}/api/videos/{name}/keypoints?{query}"), &address), 400, "{query}");
    }
    for query in ["start_secs=NaN&end_secs=1", "start_secs=0&end_secs=1e9", "start_secs=2&end_secs=1", "start_secs=inf"]
    {
        assert_eq!(get(&format!("/{token}/api/videos/{name}/avatar.glb?{query}"), &address), 400, "{query}");
    }
    for (path, expected) in [
        ("api/results?checkpoint=../../etc&name=x.wav", 400),
        ("api/results?checkpoint=gan/none&name=x.wav", 400),
        ("api/results", 400),
        ("api/pair?name=../dataset/host", 400),
        ("api/results/unknown/video", 404),
    ] {
        assert_eq!(viewer.post(path, "application/octet-stream", b"x").0, expected, "{path}");
    }
    // A range of the video file, and ranges that are not single ones.
    let size = fs::metadata(project.clips().remove(0)).unwrap().len();
    let ranged = |range: &str| {
        let head = format!(
            "GET /{token}/media/{name} HTTP/1.1\r\nHost: {address}\r\nRange: {range}\r\nConnection: close\r\n\r\n"
        );
        raw(&address, head.as_bytes())
    };
    assert_eq!([ranged("bytes=5-9"), ranged("bytes=-3"), ranged(&format!("bytes={size}-"))], [206, 206, 416]);
    assert_eq!([ranged("bytes=0-1,3-4"), ranged("lines=1-2"), ranged("bytes=9-5")], [200, 200, 200]);
    // Read-only without --edit.
    let decision = format!(r#"{{"video":"{name}","action":"reject","start_secs":0.0,"end_secs":1.0}}"#);
    assert_eq!(viewer.post("api/decisions", "application/json", decision.as_bytes()).0, 403);
    assert_eq!(viewer.delete("api/decisions/00000000"), 403);
    assert!(!project.dir().join("decisions.toml").exists());
    let header =
        |name: &str, value: &str| format!("GET /{token}/ HTTP/1.1\r\nHost: {address}\r\n{name}: {value}\r\n\r\n");
    assert_eq!(raw(&address, header("Cookie", &"x".repeat(100_000)).as_bytes()), 431);
    for garbage in [&b"\x16\x03\x01\x02\x00\x01"[..], b"GET\r\n\r\n", b"\0\0\0\0\r\n\r\n"] {
        assert_eq!(raw(&address, garbage), 400);
    }
    assert_eq!(get(&format!("/{token}/api/project"), &address), 200, "the server goes on");
}

#[test]
fn a_single_file_is_shown() {
    let project = Project::with_clips("view-file", 0, 1.0);
    let motion = crate::fixtures::figures::swinging(2, 30);
    orator_formats::npy::write(&project.dir().join("talk.npy"), &motion).unwrap();
    fs::write(project.dir().join("talk.wav"), b"RIFF").unwrap();
    let viewer = view(&project, &["talk.npy"]);
    let facts = viewer.json("api/project");
    assert_eq!(facts["file"], json!({ "name": "talk.npy", "kind": "glb", "audio": true }));
    assert!(viewer.get("file").1.starts_with(b"glTF") && viewer.get("file-audio").1 == b"RIFF");
    assert_eq!(viewer.get("api/videos").0, 404);
    let refused = |name: &str, expected: &str| {
        let answer = project.answer(&["view", name]);
        assert!(answer.code == 1 && answer.errors.contains(expected), "{name}: {}", answer.errors);
    };
    refused("none.glb", "none.glb is not a file");
    fs::write(project.dir().join("notes.md"), "x").unwrap();
    refused("notes.md", "expected .glb, .vrm");
    fs::write(project.dir().join("broken.bvh"), "x").unwrap();
    refused("broken.bvh", "broken.bvh");
    assert!(Path::new(&project.dir().join("talk.npy")).is_file());
}
