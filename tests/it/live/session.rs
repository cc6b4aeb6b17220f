//! Sessions: poses by the clock, equal to those of the complete sound, at rest in silence; and what users get wrong.

use crate::fixtures::models::untrained::{write_bounded_speaker, write_untrained_speaker};
use crate::generate::onnx_export::sound;
use hound::{SampleFormat, WavSpec, WavWriter};
use orator_avatar::animate::performance::{AnimationOptions, perform_on};
use orator_avatar::animate::solve::smoothing::Smoothing;
use orator_base::math::rotation::Rotation;
use orator_base::stage::progress::Silent;
use orator_base::types::sound::Sound;
use orator_gesture::generate::GestureGenerator;
use orator_live::pose::{HumanoidPose, LiveBody};
use orator_live::session::{self, PoseSink, SinkFacts, TimedPose};
use orator_live::sound::LiveSound;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

#[derive(Default)]
struct Collected {
    poses: Vec<(f64, HumanoidPose)>,
    is_finished: bool,
}

impl PoseSink for Collected {
    fn send(&mut self, pose: &TimedPose) {
        self.poses.push((pose.secs, pose.pose.clone()));
    }

    fn finish(&mut self) {
        self.is_finished = true;
    }

    fn facts(&self) -> SinkFacts {
        SinkFacts { name: "collected", n_sent: self.poses.len() as u64, n_dropped: 0, note: None }
    }
}

pub(super) fn write_wav(path: &Path, sound: &Sound) -> anyhow::Result<()> {
    let format = WavSpec { channels: 1, sample_rate: 16_000, bits_per_sample: 16, sample_format: SampleFormat::Int };
    let mut file = WavWriter::create(path, format)?;
    sound.samples.iter().try_for_each(|sample| file.write_sample((sample * 32_768.0) as i16))?;
    Ok(file.finalize()?)
}

/// Angle between two rotations, degrees.
fn degrees(a: Rotation, b: Rotation) -> f64 {
    let between = a.inverse() * b;
    2.0 * between.v.iter().map(|v| v * v).sum::<f64>().sqrt().min(1.0).asin().to_degrees()
}

fn most_degrees(a: &HumanoidPose, b: &[Rotation]) -> f64 {
    a.rotations.iter().zip(b).map(|(a, b)| degrees(*a, *b)).fold(0.0, f64::max)
}

#[test]
fn poses_are_those_of_the_complete_sound_and_rest_in_silence() -> anyhow::Result<()> {
    let dir = tempfile::tempdir()?;
    let [file, wav] = ["model.safetensors", "speech.wav"].map(|name| dir.path().join(name));
    write_bounded_speaker(&file, 0.5);
    let generator = GestureGenerator::open(&file)?;
    // Three seconds of speech, as many of silence.
    let mut speech = sound(3.0);
    speech.samples.resize(6 * 16_000, 0.0);
    write_wav(&wav, &speech)?;
    let mut collected = Collected::default();
    let body = LiveBody::new(&generator.metadata);
    let (rig, is_bone) = (body.rig.clone(), body.rig.skeleton.joints.iter().map(|joint| !joint.end));
    let is_bone: Vec<bool> = is_bone.collect();
    let report = {
        let speech = LiveSound::default();
        let reader = speech.clone();
        std::thread::spawn(move || reader.read_file(&wav));
        session::run(&generator, body, (&speech, true), &mut [&mut collected], &Silent)?
    };
    eprintln!("{report:?}");
    let poses = &collected.poses;
    assert!(collected.is_finished && report.outputs[0].n_sent == poses.len() as u64);
    let times_are_right = poses.iter().enumerate().all(|(i, (secs, _))| (secs - i as f64 / 60.0).abs() < 1e-9);
    if report.n_omitted == 0 {
        // 90 frames at 15 fps, of which the last is at 89 / 15 s.
        assert!(times_are_right && poses.len() == 89 * 4 + 1, "{} poses", poses.len());
    }
    let motion = generator.motion(&speech, &[])?;
    let options = AnimationOptions { smoothing: Smoothing::None, ..AnimationOptions::default() };
    let clip = perform_on(rig, &motion, None, &options).clip;
    for (secs, pose) in poses.iter().filter(|(secs, _)| (0.4..3.0).contains(secs) && (secs * 15.0).fract() < 1e-6) {
        let frame = &clip.local[(secs * 15.0).round() as usize];
        let own: Vec<Rotation> = frame.iter().zip(&is_bone).filter(|(_, is)| **is).map(|(r, _)| *r).collect();
        let off = most_degrees(pose, &own);
        assert!(off < 0.01, "{secs} s: {off} degrees");
    }
    // At rest at both ends, and no jump in between.
    let rest = LiveBody::new(&generator.metadata).pose(&ndarray::Array2::zeros((144, 1)), 0.0)?;
    let (_, last) = poses.last().unwrap();
    assert!(most_degrees(last, &rest.rotations) < 1e-3);
    let steps: Vec<f64> = poses.windows(2).map(|two| most_degrees(&two[0].1, &two[1].1.rotations)).collect();
    let jumps = steps.iter().copied().fold(0.0, f64::max);
    eprintln!("largest step between poses: {jumps} degrees");
    assert!(jumps < 5.0, "{jumps} degrees");
    Ok(())
}

fn live(checkpoint: &Path, args: &[&str], input: &[u8]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["live", "--checkpoint"]).arg(checkpoint).args(args);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut process = command.spawn().unwrap();
    // The program may end before it has read everything.
    let _ = std::io::Write::write_all(&mut process.stdin.take().unwrap(), input);
    process.wait_with_output().unwrap()
}

#[test]
fn wrong_input_is_explained() -> anyhow::Result<()> {
    let dir = tempfile::tempdir()?;
    let [bounded, complete, wav] = ["bounded", "complete", "speech.wav"].map(|name| dir.path().join(name));
    write_bounded_speaker(&bounded, 0.5);
    write_untrained_speaker(&complete);
    write_wav(&wav, &Sound { rate: 16_000, samples: vec![0.1; 4000] })?;
    let bytes = std::fs::read(&wav)?;
    let nan = dir.path().join("nan.wav");
    let format = WavSpec { channels: 1, sample_rate: 16_000, bits_per_sample: 32, sample_format: SampleFormat::Float };
    let mut file = WavWriter::create(&nan, format)?;
    (0..9000).try_for_each(|i| file.write_sample(if i == 8000 { f32::NAN } else { 0.1 }))?;
    file.finalize()?;
    let nan = nan.to_str().unwrap();
    for (checkpoint, args, input, expected) in [
        (&bounded, &["--lines"][..], &bytes[..], "ffmpeg -i FILE -f s16le"),
        (&bounded, &[], &[], "nothing to send to"),
        (&bounded, &["--vmc", "nowhere"], &[], "HOST:PORT"),
        (&bounded, &["--lines", "--audio", nan], &[], "not finite"),
        (&bounded, &["--lines", "--audio", "missing.wav"], &[], "missing.wav"),
        (&complete, &["--lines"], &[], "gan.look_ahead_secs=0.5"),
        (&wav, &["--lines"], &[], "speech.wav"),
    ] {
        let done = live(checkpoint, args, input);
        let errors = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(1), "{args:?}: {errors}");
        assert!(errors.contains(expected) && !errors.contains("panicked"), "{args:?}: {errors}");
    }
    Ok(())
}

#[test]
fn lines_are_json_and_a_reader_that_leaves_ends_the_session() -> anyhow::Result<()> {
    let dir = tempfile::tempdir()?;
    let model = dir.path().join("model");
    write_bounded_speaker(&model, 0.25);
    let samples: Vec<u8> = sound(1.0).samples.iter().flat_map(|v| ((v * 32_767.0) as i16).to_le_bytes()).collect();
    let done = live(&model, &["--lines"], &samples);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let lines: Vec<serde_json::Value> =
        done.stdout.split(|byte| *byte == b'\n').filter_map(|line| serde_json::from_slice(line).ok()).collect();
    assert!(lines.len() >= 50, "{} lines", lines.len());
    assert!(lines.iter().all(|line| line["rotations"]["leftUpperArm"].as_array().unwrap().len() == 4));
    let summary = String::from_utf8_lossy(&done.stderr);
    assert!(summary.contains("poses sent, 0 dropped"), "{summary}");

    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["live", "--lines", "--checkpoint"]).arg(&model).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut process = command.spawn()?;
    // The source goes on, but the reader leaves after three lines.
    let _open = process.stdin.take();
    let mut poses = BufReader::new(process.stdout.take().unwrap()).lines();
    assert_eq!(poses.by_ref().take(3).filter_map(Result::ok).count(), 3);
    drop(poses);
    let ended = (0..100).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(100));
        process.try_wait().ok().flatten()
    });
    assert!(ended.is_some_and(|status| status.success()), "{ended:?}");
    Ok(())
}
