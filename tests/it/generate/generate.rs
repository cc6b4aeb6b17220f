//! `orator generate` from the command line with an untrained speaker: every output format, from every kind of audio;
//! invalid input gives a clear error, exit code 1 and no output.

use crate::fixtures::animation::bvh::{Bvh, worst_mm};
use crate::fixtures::clips;
use crate::fixtures::figures::{FPS, swinging};
use crate::fixtures::models::untrained::{generate, write_untrained_speaker};
use crate::fixtures::networks::value;
use candle_core::{Device, Tensor};
use ndarray::{Axis, s};
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::audio::mel;
use orator_base::types::sound::Sound;
use orator_formats::checkpoint;
use orator_formats::mocap::motion_file;
use orator_formats::{authors_txt, npy};
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::generator::mel_frames;
use orator_gesture::generate::model::SpeakerMetadata;
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::generate::representation::Representation;
use orator_media::ffmpeg::probe;
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::params::Params;

#[test]
fn one_audio_file_gives_every_output_format() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    std::fs::create_dir(dir.join("training")).unwrap();
    write_untrained_speaker(&checkpoint::path(&dir.join("training"), 20));
    orator_formats::wav::write(&dir.join("speech.wav"), &clips::tone(16_000, 2.05, 220.0)).unwrap();

    let outs = "--out made/a.npy made/a.txt --out made/a.bvh --out made/a.mp4";
    let output = generate(dir, &format!("--json --checkpoint training --audio speech.wav {outs}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((facts["n_frames"].as_u64(), facts["speaker"].as_str()), (Some(30), Some("host")));
    assert_eq!(facts["checkpoint"], "training/step-0000020.safetensors");
    assert_eq!(facts["outputs"].as_array().unwrap().len(), 4);

    let out = dir.join("made");
    let motion = npy::read(&out.join("a.npy"), FPS).unwrap();
    assert_eq!(authors_txt::read(&out.join("a.txt"), FPS).unwrap(), motion);
    let bvh = Bvh::parse(&std::fs::read_to_string(out.join("a.bvh")).unwrap());
    let animated = perform(&motion, None, &AnimationOptions::default()).motion();
    let worst = worst_mm(&animated, &bvh, |frame| bvh.places(frame));
    assert!(worst < 0.1, "{worst} mm");
    let film = probe::probe(&out.join("a.mp4")).unwrap();
    assert!((film.duration_secs.unwrap() - 2.05).abs() < 0.1);
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 6, "no temporary file remains");
    for name in ["a.npy", "a.txt"] {
        let read = motion_file::read(&out.join(name), None).unwrap();
        assert!(read.has_rate && read.motion.fps == FPS, "{name}");
    }

    // Other kinds of audio: an mp3 of telephone quality, the track of a video.
    for command in ["-i speech.wav -ar 8000 phone.mp3", "-i made/a.mp4 -c copy talk.mov"] {
        if clips::ffmpeg(dir, command) {
            let sound = command.rsplit(' ').next().unwrap();
            let output = generate(dir, &format!("--checkpoint training --audio {sound} --out {sound}.bvh"));
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            assert!(String::from_utf8_lossy(&output.stdout).contains("next: orator generate --checkpoint training"));
            let n_frames = Bvh::parse(&std::fs::read_to_string(dir.join(format!("{sound}.bvh"))).unwrap()).frames.len();
            assert!((29..=32).contains(&n_frames), "{sound}: {n_frames} frames");
        }
    }
}

#[test]
fn errors_name_the_invalid_input_and_leave_no_output() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_untrained_speaker(&dir.join("host.safetensors"));
    orator_formats::wav::write(&dir.join("speech.wav"), &clips::tone(16_000, 0.5, 220.0)).unwrap();
    orator_formats::wav::write(&dir.join("click.wav"), &clips::tone(16_000, 0.03, 220.0)).unwrap();
    clips::write_numbered(dir, "silent.mp4", 4, FPS, None);
    std::fs::write(dir.join("broken.safetensors"), "no weights").unwrap();
    std::fs::write(dir.join("notes.mp3"), "no sound").unwrap();
    std::fs::write(dir.join("empty.wav"), "").unwrap();
    std::fs::create_dir(dir.join("nothing")).unwrap();

    let cases = [
        ("--checkpoint host.safetensors --audio speech.wav --out a.mov", ".npy (joints), .txt"),
        ("--checkpoint host.safetensors --audio speech.wav --out noending", "noending"),
        ("--checkpoint host.safetensors --audio speech.wav --out a.bvh --out a.bvh", "listed twice"),
        ("--checkpoint host.safetensors --audio silent.mp4 --out silent.mp4", "audio input"),
        ("--checkpoint host.safetensors --audio silent.mp4 --out a.bvh", "silent.mp4 has no audio track"),
        ("--checkpoint host.safetensors --audio gone.wav --out a.bvh", "gone.wav does not exist"),
        ("--checkpoint host.safetensors --audio nothing --out a.bvh", "nothing is not a file"),
        ("--checkpoint host.safetensors --audio notes.mp3 --out a.bvh", "notes.mp3"),
        ("--checkpoint host.safetensors --audio empty.wav --out a.bvh", "empty.wav"),
        ("--checkpoint host.safetensors --audio click.wav --out a.bvh", "too short"),
        (
            "--checkpoint host.safetensors --audio speech.wav --out speech.wav/a.bvh",
            "cannot create the folder speech.wav",
        ),
        ("--checkpoint gone.safetensors --audio speech.wav --out a.bvh", "gone.safetensors does not exist"),
        ("--checkpoint nothing --audio speech.wav --out a.bvh", "no checkpoint in nothing"),
        ("--checkpoint broken.safetensors --audio speech.wav --out a.bvh", "broken.safetensors"),
        ("--checkpoint host.safetensors --audio speech.wav", "--out"),
    ];
    for (args, expected) in cases {
        let output = generate(dir, args);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{args}: {errors}");
        assert!(errors.contains(expected), "{args}: {errors}");
        assert!(!errors.contains("panicked"), "{args}: {errors}");
    }
    assert!(!dir.join("a.bvh").exists() && !dir.join("a.mov").exists());

    let output = generate(dir, "--json --checkpoint host.safetensors --audio gone.wav --out a.bvh");
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(answer["error"].as_str().unwrap().contains("gone.wav"));
}

#[test]
fn a_checkpoint_generates_from_any_folder() {
    let folder = tempfile::tempdir().unwrap();
    let (training, elsewhere) = (folder.path().join("training"), folder.path().join("elsewhere"));
    std::fs::create_dir(&training).unwrap();
    std::fs::create_dir(&elsewhere).unwrap();
    write_untrained_speaker(&checkpoint::path(&training, 20));
    orator_formats::wav::write(&training.join("speech.wav"), &clips::tone(16_000, 1.0, 220.0)).unwrap();
    let output = generate(&training, "--checkpoint step-0000020.safetensors --audio speech.wav --out made.npy");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let expected = std::fs::read(training.join("made.npy")).unwrap();

    std::fs::rename(checkpoint::path(&training, 20), elsewhere.join("host.safetensors")).unwrap();
    std::fs::rename(training.join("speech.wav"), elsewhere.join("speech.wav")).unwrap();
    std::fs::remove_dir_all(&training).unwrap();
    let output = generate(&elsewhere, "--checkpoint host.safetensors --audio speech.wav --out again.npy");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(std::fs::read(elsewhere.join("again.npy")).unwrap(), expected);
}

/// A speaker with the full size of a preset and pseudo-random weights and running statistics.
fn random_speaker(preset: Preset) -> anyhow::Result<GestureGenerator> {
    let network = Config::from_preset(preset, N_FEATURES);
    let mut params = Params::frozen();
    let generator = Generator::new(&mut params, &network)?;
    let tensors = params.all().map(|(name, var)| Ok((name.to_owned(), value(name, var.dims())?)));
    params.load(&tensors.collect::<candle_core::Result<_>>()?)?;
    let motion = swinging(1, 40);
    let mean = motion.joints.mean_axis(Axis(0)).unwrap();
    let normal = Normalisation::new(&mean, &mean, vec![0.1; N_FEATURES / 3]);
    let metadata = SpeakerMetadata::new("host", FPS, "", network, normal, Representation::Positions);
    Ok(GestureGenerator::new(metadata, generator))
}

/// Features [144, T] of a complete sound in one forward pass.
fn one_pass(speaker: &GestureGenerator, sound: &Sound, n_frames: usize) -> anyhow::Result<ndarray::Array2<f32>> {
    let padded = (n_frames / 32 + 1) * 32;
    let n_samples = mel::n_samples(mel_frames(FPS, padded));
    // Padded with its reflections.
    let reflected = sound.samples.iter().chain(sound.samples.iter().rev().skip(1).take(sound.samples.len() - 2));
    let samples: Vec<f32> = reflected.cycle().take(n_samples).copied().collect();
    let mels = mel::log_mel(&samples);
    let (n, bands) = mels.dim();
    let mels = Tensor::from_vec(mels.iter().copied().collect(), (1, n, bands), &Device::Cpu)?.t()?.contiguous()?;
    let poses = speaker.generator.forward(&mels, &[], padded, false)?.flatten_all()?.to_vec1()?;
    Ok(ndarray::Array2::from_shape_vec((N_FEATURES, padded), poses)?.slice_move(s![.., ..n_frames]))
}

/// Asserts that sounds of the given lengths (seconds) give the same features in chunks of 64 frames as in one pass.
fn assert_chunks_equal_one_pass(preset: Preset, lengths: &[f64]) -> anyhow::Result<()> {
    let speaker = random_speaker(preset)?;
    let sounds = lengths.iter().map(|secs| clips::tone(16_000, *secs, 220.0)).collect::<Vec<_>>();
    let n_frames = |sound: &Sound| (sound.secs() * 15.0 + 1e-6) as usize;
    let references = sounds.iter().map(|sound| one_pass(&speaker, sound, n_frames(sound)));
    let references = references.collect::<anyhow::Result<Vec<_>>>()?;
    let parts = |sound: &Sound| std::iter::once(Ok(sound.samples.clone()));
    for (sound, reference) in sounds.iter().zip(references) {
        let max = reference.iter().fold(0.0f32, |max, v| max.max(v.abs()));
        let mut first = 0;
        for part in speaker.features(parts(sound), sound.samples.len(), &[], 64)? {
            let part = part?;
            let error = &part - &reference.slice(s![.., first..first + part.ncols()]);
            let error = error.iter().fold(0.0f32, |max, v| max.max(v.abs()));
            assert!(error < 1e-5 * max.max(1.0), "{:.1} s, from frame {first}: {error:e} of {max}", sound.secs());
            first += part.ncols();
        }
        assert_eq!(first, n_frames(sound));
    }
    assert_eq!(speaker.motion(&sounds[0], &[])?.n_frames(), n_frames(&sounds[0]));
    assert!(speaker.features(parts(&sounds[0]), sounds[0].samples.len(), &[], 33).is_err());
    Ok(())
}

#[test]
fn chunks_equal_one_pass_with_the_light_network() -> anyhow::Result<()> {
    assert_chunks_equal_one_pass(Preset::Light, &[0.2, 5.03, 21.7])
}

#[test]
fn chunks_equal_one_pass_with_the_published_network() -> anyhow::Result<()> {
    assert_chunks_equal_one_pass(Preset::Paper, &[0.1, 9.1])
}
