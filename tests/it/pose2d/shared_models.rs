//! Models that several workers share: values in batches, the messages of subprocesses, the settings.

use crate::fixtures::onnx_models::models;
use orator::load_config;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::device::DeviceChoice;
use orator_base::types::image::{Image, PixelArea};
use orator_base::types::pose2d::{Keypoint, Pose2d};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{Config, Settings};
use orator_formats::keypoints_npz;
use orator_media::ffmpeg::write::encode::VideoWriter;
use orator_media::opencv::png;
use orator_onnx::{ModelStore, Runtime};
use orator_pipeline::pose2d::models::{choose, runtime};
use orator_pipeline::pose2d::{Chain, Pose2dStage};
use orator_pipeline::process::VERB;
use orator_pipeline::process::message::{Message, Request, UnitRequest, receive_floats, send, send_floats};
use orator_pipeline::process::stage::follow;
use std::cell::Cell;
use std::io::BufReader;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_BIN_EXE_orator");

/// The three frames of the rendered speaker, complete and without a margin.
fn pictures() -> Vec<Image> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/synthetic_speaker.png");
    let sheet = png::read(&file).unwrap();
    let frame = |y: usize, margin: usize| sheet.cropped(PixelArea { x: 0, y, width: 320 - margin, height: 240 });
    [40, 280, 520].into_iter().flat_map(|y| [frame(y, 0), frame(y, 7)]).collect()
}

/// Poses of the pictures, each the first of a shot; every worker processes a share of the pictures.
fn poses(runtime: &Runtime, store: &ModelStore, n_workers: usize) -> Vec<Pose2d> {
    let (pictures, settings) = (pictures(), choose(&Settings::default().pose2d, store).unwrap());
    let work = |pictures: &[Image]| {
        let mut chain = Chain::new(runtime, store, &settings).unwrap();
        let pose = |picture: &Image| {
            chain.begin_shot(None);
            chain.frame(picture).unwrap()
        };
        pictures.iter().map(pose).collect::<Vec<_>>()
    };
    std::thread::scope(|scope| {
        let shares = pictures.chunks(pictures.len() / n_workers);
        let workers: Vec<_> = shares.map(|share| scope.spawn(|| work(share))).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    })
}

#[test]
fn keypoints_in_batches_are_those_of_single_pictures() {
    let Some((store, runtime)) = models() else { return };
    let alone = poses(&runtime, &store, 1);
    let shared = poses(&runtime.in_batches(), &store, 6);
    let distances = |part: fn(&Pose2d) -> &[Keypoint]| {
        let pairs = alone.iter().zip(&shared).flat_map(|(a, b)| part(a).iter().zip(part(b)));
        let seen = pairs.filter(|(a, b)| a.score > 0.0 && b.score > 0.0);
        let mut distances: Vec<f32> = seen.map(|(a, b)| (a.x - b.x).hypot(a.y - b.y)).collect();
        distances.sort_by(f32::total_cmp);
        distances
    };
    let (body, right) = (distances(|pose| &pose.body), distances(|pose| &pose.right_hand));
    let left = distances(|pose| &pose.left_hand);
    let largest = |distances: &[f32]| distances.last().copied().unwrap_or_default();
    eprintln!("px: body {}, hands {} and {}", largest(&body), largest(&left), largest(&right));
    assert!(
        body.len() == 6 * 17 && left.len() + right.len() >= 6 * 21,
        "{} {} {}",
        body.len(),
        left.len(),
        right.len()
    );
    assert!(largest(&body) <= 1e-3, "{}", largest(&body));
    // The square of a hand begins at the wrist; a change of the seventh digit moves its points by some hundredths.
    let hands = [left, right].concat();
    let n_near = hands.iter().filter(|distance| **distance <= 0.5).count();
    assert!(n_near * 100 >= hands.len() * 95, "{n_near} of {}", hands.len());
}

#[test]
fn a_run_computes_shared_models_for_its_subprocess() {
    let infer = |model: &str, input: &[f32]| {
        anyhow::ensure!(model == "double", "no model {model}");
        Ok(input.iter().map(|value| 2.0 * value).collect())
    };
    for (model, is_known) in [("double", true), ("unknown", false)] {
        let (mut sent, mut answer) = (Vec::new(), Some(Vec::new()));
        send(&mut sent, &Message::Inference { model: model.to_owned() }).unwrap();
        send_floats(&mut sent, &[1.0, -2.5]).unwrap();
        send(&mut sent, &Message::Done { line: "done".to_owned(), facts: Default::default() }).unwrap();
        let report = follow(&mut sent.as_slice(), &mut answer, &Silent, infer).unwrap();
        let answer = answer.unwrap();
        if is_known {
            assert_eq!(report.unwrap().line, "done");
            assert_eq!(receive_floats(&mut answer.as_slice()).unwrap(), [2.0, -5.0]);
        } else {
            assert_eq!((report.unwrap_err().to_string(), answer.len()), ("no model unknown".to_owned(), 0));
        }
    }
}

/// Project with the pictures as a video, of which the frames are extracted; its configuration and the video's unit.
fn project(dir: &Path, models: &Path) -> (Config, Unit) {
    let source = dir.join("videos/clip.mp4");
    std::fs::create_dir(dir.join("videos")).unwrap();
    let mut video = VideoWriter::create(&source, 320, 240, FrameRate::new(15, 1), None).unwrap();
    pictures().iter().step_by(2).flat_map(|picture| [picture; 4]).for_each(|picture| video.push(picture).unwrap());
    video.finish().unwrap();
    let file = dir.join("pipeline.toml");
    let text = format!("[models]\ndir = {models:?}\n[[speaker]]\nname = \"host\"\nvideos = [\"videos\"]\n");
    std::fs::write(&file, text).unwrap();
    let run = Command::new(PROGRAM).args(["run", "--to", "extract", "-c"]).arg(&file).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let mut folders = std::fs::read_dir(dir.join("work/extract/host")).unwrap();
    let video = folders.next().unwrap().unwrap().file_name().to_string_lossy().into_owned();
    (load_config(&file, &[]).unwrap(), Unit { speaker: "host".into(), video, source })
}

#[test]
fn a_subprocess_detects_keypoints_with_the_models_of_the_run() {
    let Some((store, runtime)) = models() else { return };
    let dir = tempfile::tempdir().unwrap();
    let (Config { mut settings, file, .. }, unit) = project(dir.path(), store.dir());
    // The CPU answers in place of the GPU.
    settings.models.provider = DeviceChoice::Cuda(0);
    settings.models.onnxruntime = runtime.library().to_owned();
    let inputs = Pose2dStage::new(&settings).unwrap().inputs(&unit).unwrap().into_iter().map(|input| input.path);
    let reads = inputs.chain([store.dir().to_owned(), runtime.library().to_owned()]).map(Into::into).collect();
    let out = dir.path().join("out");
    std::fs::create_dir(&out).unwrap();
    let request = UnitRequest {
        stage: "pose2d".to_owned(),
        speaker: unit.speaker.clone(),
        video: unit.video.clone(),
        source: unit.source.clone().into(),
        part: None,
        settings,
        config_file: file,
        keypoints: None,
        decisions: Vec::new(),
        reads,
        out: out.clone().into(),
        memory: 8 << 30,
    };
    let mut child = Command::new(PROGRAM).arg(VERB).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let (mut stdin, stdout, pid) = (child.stdin.take(), child.stdout.take().unwrap(), child.id());
    send(stdin.as_mut().unwrap(), &Request::Unit(Box::new(request))).unwrap();
    let (ended, end) = channel::<()>();
    let watchdog = std::thread::spawn(move || {
        if end.recv_timeout(Duration::from_secs(120)) == Err(RecvTimeoutError::Timeout) {
            Command::new("kill").args(["-9", &pid.to_string()]).status().unwrap();
        }
    });
    let (shared, n_runs) = (runtime.in_batches().inference.unwrap(), Cell::new(0));
    let infer = |id: &str, input: &[f32]| {
        n_runs.set(n_runs.get() + 1);
        shared(store.manifest().get(id)?, store.dir(), input)
    };
    let report = follow(&mut BufReader::new(stdout), &mut stdin, &Silent, infer).unwrap().unwrap();
    drop((ended, stdin));
    watchdog.join().unwrap();
    child.wait().unwrap();
    assert!(n_runs.get() >= 12, "{} runs: {}", n_runs.get(), report.line);
    let keypoints = keypoints_npz::read(&out.join("keypoints.npz")).unwrap();
    assert_eq!(keypoints.n_frames(), 12);
}

#[test]
fn the_provider_is_part_of_the_settings_unless_it_is_the_cpu() {
    let Some((store, _)) = models() else { return };
    let mut settings = Settings::default();
    settings.models.dir = store.dir().to_owned();
    let unit = Unit { speaker: "host".into(), video: "clip-00000000".into(), source: "clip.mp4".into() };
    let stated = |settings: &Settings| Pose2dStage::new(settings).unwrap().settings(&unit);
    let on_cpu = stated(&settings);
    assert_eq!(on_cpu.get("provider"), None);
    settings.models.provider = DeviceChoice::Cuda(0);
    let mut on_gpu = stated(&settings);
    assert_eq!(on_gpu["provider"], "cuda");
    on_gpu.as_object_mut().unwrap().shift_remove("provider");
    assert_eq!(on_gpu, on_cpu);
    // The library that the tests install has no CUDA provider.
    let error = format!("{:#}", runtime(&settings.models).err().unwrap());
    assert!(error.contains("libonnxruntime.so") && error.contains("onnxruntime-gpu"), "{error}");
    settings.models.provider = DeviceChoice::Auto;
    assert!(runtime(&settings.models).unwrap().1.unwrap().contains("on the CPU: "));
    assert!(runtime(&settings.models).unwrap().0.inference.is_none());
    assert_eq!(stated(&settings), on_cpu);
}
