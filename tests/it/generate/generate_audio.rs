//! Kinds of audio for `orator generate`: streamed audio gives the motion of loaded audio, telephone quality is noted,
//! and files without a sample are errors.

use crate::fixtures::clips;
use crate::fixtures::figures::FPS;
use crate::fixtures::models::untrained::{generate, write_untrained_speaker};
use orator_base::types::sound::Sound;
use orator_formats::npy;
use orator_formats::wav;
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::generator::CHUNK;
use orator_media::ffmpeg::audio::read_mono;
use orator_media::ffmpeg::sound_stream::{SoundStream, n_samples};

#[test]
fn streamed_audio_gives_the_motion_of_loaded_audio() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_untrained_speaker(&dir.join("host.safetensors"));
    let speaker = GestureGenerator::open(&dir.join("host.safetensors")).unwrap();
    // More than a chunk of frames; less than the reflected end; another rate.
    for (rate, secs) in [(16_000, 150.0), (16_000, 1.3), (44_100, 3.7)] {
        let mut sound = clips::tone(rate, secs, 220.0);
        for (i, sample) in sound.samples.iter_mut().enumerate() {
            *sample *= ((i * 7919) % 100_003) as f32 / 100_003.0;
        }
        let path = dir.join("speech.wav");
        wav::write(&path, &sound).unwrap();
        let loaded = read_mono(&path, 16_000).unwrap().unwrap();
        let (n, note) = n_samples(&path, 16_000).unwrap().unwrap();
        assert_eq!(note, None);
        assert_eq!(n, loaded.samples.len());
        let mut n_done = 0;
        let streamed = speaker
            .motion_from_stream(SoundStream::open(&path, 16_000), n, &[], CHUNK, &mut |n| n_done += n)
            .unwrap()
            .0;
        assert_eq!(streamed, speaker.motion(&loaded, &[]).unwrap());
        assert_eq!(n_done, streamed.n_frames());
        assert!(generate(dir, "--checkpoint host.safetensors --audio speech.wav --out a.npy").status.success());
        assert_eq!(npy::read(&dir.join("a.npy"), FPS).unwrap(), streamed);
    }
    let mut stream = SoundStream::open(&dir.join("speech.wav"), 16_000);
    assert!(stream.next().unwrap().is_ok(), "a stream may be dropped before its end");
    drop(stream);
    assert!(SoundStream::open(&dir.join("gone.wav"), 16_000).next().unwrap().is_err());
}

#[test]
fn only_telephone_quality_gives_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_untrained_speaker(&dir.join("host.safetensors"));
    for (rate, is_narrow) in [(8_000, true), (22_050, false)] {
        wav::write(&dir.join("speech.wav"), &clips::tone(rate, 1.0, 220.0)).unwrap();
        let output = generate(dir, "--checkpoint host.safetensors --audio speech.wav --out a.bvh");
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && printed.contains("are empty (above 4000 Hz)") == is_narrow, "{printed}");
    }
}

#[test]
fn audio_files_without_a_sample_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_untrained_speaker(&dir.join("host.safetensors"));
    wav::write(&dir.join("empty.wav"), &Sound { rate: 16_000, samples: Vec::new() }).unwrap();
    std::fs::write(dir.join("nothing.mp3"), "").unwrap();
    std::fs::write(dir.join("text.mp3"), "this is no sound, whatever its name says\n".repeat(50)).unwrap();
    // A tag without audio data.
    let mut tag = b"ID3\x04\x00\x00\x00\x00\x00\x40".to_vec();
    tag.extend([0; 64]);
    std::fs::write(dir.join("tag.mp3"), tag).unwrap();
    let mut files = vec!["empty.wav", "nothing.mp3", "text.mp3", "tag.mp3"];
    if clips::ffmpeg(dir, "-f lavfi -i anullsrc=r=16000:cl=mono -t 0 zero.mp3") {
        files.push("zero.mp3");
    }
    for file in files {
        let output = generate(dir, &format!("--checkpoint host.safetensors --audio {file} --out a.bvh"));
        let printed = String::from_utf8_lossy(&output.stderr).into_owned();
        eprintln!("{printed}");
        assert!(output.status.code() == Some(1) && printed.contains(file), "{file}: {printed}");
        assert!(!dir.join("a.bvh").exists());
    }
}
