//! Audio on the time axis of the frames: sampling rates, channels, offsets, gaps, and a flash with a simultaneous beep.

use crate::fixtures::clips::{ffmpeg, tone, write_numbered};
use orator_base::types::image::Image;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_formats::wav;
use orator_media::ffmpeg::audio::read_mono;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::sound_stream::SoundStream;
use orator_media::ffmpeg::write::encode::VideoWriter;
use orator_pipeline::sound::extract_wav;
use orator_test_support::skip::real_data;
use std::path::Path;

const RATE: u32 = 16_000;
const FPS: FrameRate = FrameRate::new(30, 1);

/// Time of the first sample above a tenth of full scale, seconds.
fn first_loud(audio: &Sound) -> f64 {
    let at = audio.samples.iter().position(|s| s.abs() > 0.1).expect("no sound");
    at as f64 / f64::from(audio.rate)
}

/// Upward zero crossings per second in the middle half of the audio: the pitch of a pure tone.
fn pitch(audio: &Sound) -> f64 {
    let n = audio.samples.len();
    let middle = &audio.samples[n / 4..3 * n / 4];
    let n_up = middle.windows(2).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count();
    n_up as f64 * f64::from(audio.rate) / middle.len() as f64
}

/// Writes a clip of 3 s that is black and silent, and from second `at` on white with a beep.
fn flash_and_beep(path: &Path, at: f64) {
    let mut audio = tone(RATE, 3.0, 1000.0);
    audio.samples[..(at * f64::from(RATE)) as usize].fill(0.0);
    let mut video = VideoWriter::create(path, 64, 48, FPS, Some(&audio)).unwrap();
    for n in 0..90 {
        let level = if FPS.secs(n) >= at - 1e-9 { 255 } else { 0 };
        video.push(&Image::filled(64, 48, [level; 3])).unwrap();
    }
    video.finish().unwrap();
}

/// Times of flash and beep in a file, seconds.
fn flash_and_beep_secs(path: &Path) -> (f64, f64) {
    let mut frames = FrameReader::open(path, FPS).unwrap().map(Result::unwrap);
    let flash = frames.find(|frame| frame.image.data[0] > 128).expect("no flash");
    (FPS.secs(flash.frame_idx), first_loud(&read_mono(path, RATE).unwrap().unwrap()))
}

#[test]
fn flash_and_beep_stay_synchronised() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("flash.mp4");
    flash_and_beep(&path, 1.5);
    let (flash, beep) = flash_and_beep_secs(&path);
    assert!((flash - 1.5).abs() < 1e-9 && (beep - 1.5).abs() < 0.005, "flash {flash}, beep {beep}");
    // Other containers, stream offsets, an edit list, an excerpt.
    for (name, options, tolerance) in [
        ("copy.mkv", "-i flash.mp4 -c copy", 0.005),
        ("opus.webm", "-i flash.mp4 -c:v libvpx -b:v 1M -c:a libopus", 0.01),
        ("offset.ts", "-i flash.mp4 -c copy -muxdelay 1.4", 0.005),
        ("cut.mp4", "-ss 0.7 -i flash.mp4 -c copy", 0.03),
        ("cut_recoded.mp4", "-ss 0.7 -i flash.mp4 -c:v libx264 -c:a aac", 0.03),
        ("mp3.avi", "-i flash.mp4 -c:v mpeg4 -q:v 3 -c:a libmp3lame -ar 44100", 0.06),
    ] {
        if !ffmpeg(dir.path(), &format!("{options} {name}")) {
            continue;
        }
        let (flash, beep) = flash_and_beep_secs(&dir.path().join(name));
        eprintln!("{name}: flash {flash:.4} s, beep {beep:.4} s");
        assert!((flash - beep).abs() <= tolerance, "{name}: flash {flash}, beep {beep}");
    }
}

#[test]
fn a_late_audio_track_is_padded_and_an_early_one_is_cut() {
    let dir = tempfile::tempdir().unwrap();
    write_numbered(dir.path(), "in.mp4", 60, FPS, None);
    wav::write(&dir.path().join("tone.wav"), &tone(RATE, 1.5, 500.0)).unwrap();
    // The audio starts half a second after the video.
    if ffmpeg(dir.path(), "-i in.mp4 -itsoffset 0.5 -i tone.wav -map 0:v -map 1:a -c:v copy -c:a pcm_s16le late.mkv") {
        let audio = read_mono(&dir.path().join("late.mkv"), RATE).unwrap().unwrap();
        assert!((first_loud(&audio) - 0.5).abs() < 0.003, "{}", first_loud(&audio));
        assert!((audio.secs() - 2.0).abs() < 0.005, "{}", audio.secs());
    }
    // The video starts half a second after the audio, whose first half second is cut.
    if ffmpeg(dir.path(), "-itsoffset 0.5 -i in.mp4 -i tone.wav -map 0:v -map 1:a -c:v copy -c:a pcm_s16le early.mkv") {
        let audio = read_mono(&dir.path().join("early.mkv"), RATE).unwrap().unwrap();
        assert!((audio.secs() - 1.0).abs() < 0.005, "{}", audio.secs());
        let mut frames = FrameReader::open(&dir.path().join("early.mkv"), FPS).unwrap();
        assert_eq!(frames.next().unwrap().unwrap().source_secs, 0.0);
        assert_eq!(1 + frames.count(), 60);
    }
}

#[test]
fn a_gap_in_the_container_becomes_silence() {
    let dir = tempfile::tempdir().unwrap();
    wav::write(&dir.path().join("tone.wav"), &tone(48_000, 3.0, 500.0)).unwrap();
    // Drops the samples from second 1 to 2; the other time stamps are unchanged.
    if !ffmpeg(dir.path(), "-i tone.wav -af aselect='lt(t,1)+gt(t,2)' -c:a pcm_s16le gap.mkv") {
        return;
    }
    let audio = read_mono(&dir.path().join("gap.mkv"), RATE).unwrap().unwrap();
    let loud = |from: f64, to: f64| {
        let n = |secs: f64| (secs * f64::from(RATE)) as usize;
        audio.samples[n(from)..n(to)].iter().fold(0.0f32, |most, s| most.max(s.abs()))
    };
    assert!((audio.secs() - 3.0).abs() < 0.03, "{}", audio.secs());
    assert!(loud(0.1, 0.95) > 0.4 && loud(2.05, 2.9) > 0.4);
    assert!(loud(1.05, 1.95) < 1e-3);
}

#[test]
fn a_jump_in_audio_times_is_damage_and_not_filled_with_silence() {
    let dir = tempfile::tempdir().unwrap();
    wav::write(&dir.path().join("tone.wav"), &tone(48_000, 3.0, 500.0)).unwrap();
    let jump = "asetpts=if(gte(T\\,1)\\,PTS+3600/TB\\,PTS)";
    if ffmpeg(dir.path(), &format!("-i tone.wav -af {jump} -c:a pcm_s16le jump.mkv")) {
        let extracted =
            extract_wav(&dir.path().join("jump.mkv"), 0, &dir.path().join("out.wav"), RATE).unwrap().unwrap();
        assert!((extracted.secs - 1.0).abs() < 0.05, "{} s", extracted.secs);
        assert!(extracted.damage.unwrap().contains("impossible times"));
    }
}

#[test]
fn all_rates_and_channel_layouts_become_16_khz_mono() {
    let dir = tempfile::tempdir().unwrap();
    wav::write(&dir.path().join("tone.wav"), &tone(48_000, 2.0, 440.0)).unwrap();
    let mut cases = vec![("tone.wav".to_owned(), 1e-9)];
    for (name, options, tolerance) in [
        ("22050.wav", "-ar 22050", 1e-3),
        ("24000.flac", "-ar 24000", 1e-3),
        ("44100.mp3", "-ar 44100", 0.06),
        ("stereo.m4a", "-ar 44100 -ac 2", 0.03),
        ("surround.m4a", "-ac 6", 0.03),
        ("unnamed.wav", "-af pan=4c|c0=c0|c1=c0|c2=c0|c3=c0", 1e-3),
        ("eight.wav", "-ar 8000 -c:a pcm_u8", 1e-3),
    ] {
        if ffmpeg(dir.path(), &format!("-i tone.wav {options} {name}")) {
            cases.push((name.to_owned(), tolerance));
        }
    }
    for (name, tolerance) in cases {
        let audio = read_mono(&dir.path().join(&name), RATE).unwrap().unwrap();
        assert_eq!(audio.rate, RATE);
        assert!((audio.secs() - 2.0).abs() <= tolerance, "{name}: {} s", audio.secs());
        assert!((pitch(&audio) - 440.0).abs() < 2.0, "{name}: {} Hz", pitch(&audio));
        let peak = audio.samples.iter().fold(0.0f32, |most, s| most.max(s.abs()));
        assert!((0.1..0.75).contains(&peak), "{name}: peak {peak}");
    }
}

#[test]
fn streaming_a_wav_reproduces_it_exactly() {
    let dir = tempfile::tempdir().unwrap();
    let (path, out) = (dir.path().join("in.wav"), dir.path().join("out.wav"));
    wav::write(&path, &tone(RATE, 1.2345, 300.0)).unwrap();
    let extracted = extract_wav(&path, 0, &out, RATE).unwrap().unwrap();
    assert_eq!((extracted.secs, extracted.damage), ((1.2345f64 * 16_000.0).round() / 16_000.0, None));
    assert_eq!(std::fs::read(&path).unwrap(), std::fs::read(&out).unwrap());
}

#[test]
fn a_non_finite_sample_is_an_error_with_its_time() {
    let dir = tempfile::tempdir().unwrap();
    let written = |name: &str, n_channels: u16, replaced: &dyn Fn(usize) -> Option<f32>| {
        let path = dir.path().join(name);
        let sample_format = hound::SampleFormat::Float;
        let spec = hound::WavSpec { channels: n_channels, sample_rate: 48_000, bits_per_sample: 32, sample_format };
        let mut wav = hound::WavWriter::create(&path, spec).unwrap();
        for n in 0..96_000 * usize::from(n_channels) {
            wav.write_sample(replaced(n).unwrap_or((n as f32 * 0.01).sin() * 0.3)).unwrap();
        }
        wav.finalize().unwrap();
        path
    };
    assert!(read_mono(&written("intact.wav", 2, &|_| None), RATE).is_ok());
    let one = |at: usize, value: f32| move |n: usize| (n == at).then_some(value);
    for (path, second) in [
        (written("one.wav", 1, &one(72_000, f32::NAN)), "1.50"),
        (written("right.wav", 2, &one(72_001, f32::INFINITY)), "0.75"),
        (written("all.wav", 1, &|_| Some(f32::NAN)), "0.00"),
    ] {
        let out = dir.path().join("out.wav");
        let streamed = SoundStream::open(&path, RATE).last().unwrap().map(drop);
        for read in [read_mono(&path, RATE).map(drop), extract_wav(&path, 0, &out, RATE).map(drop), streamed] {
            let expected = format!("{} is damaged: a sample at {second} s is not finite;", path.display());
            let error = format!("{:#}", read.unwrap_err());
            assert!(error.contains(&expected), "{error}");
        }
    }
}

#[test]
fn a_video_without_audio_gives_none_and_no_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = write_numbered(dir.path(), "in.mp4", 5, FPS, None);
    let out = dir.path().join("out.wav");
    assert_eq!(extract_wav(&path, 0, &out, RATE).unwrap(), None);
    assert!(!out.exists());
    assert_eq!(read_mono(&path, RATE).unwrap(), None);
}

#[test]
fn real_audio_has_the_expected_length() {
    for (name, secs) in [
        ("data/audio/jfk_whisper_11s.flac", 11.0),
        ("data/audio/talkshow_french.wav", f64::NAN),
        ("data/videos/talk_latentsync_demo1_1080x1920_hevc.mp4", 10.008),
    ] {
        let Some(path) = real_data(name) else { continue };
        let audio = read_mono(&path, RATE).unwrap().unwrap();
        assert!(secs.is_nan() || (audio.secs() - secs).abs() < 0.05, "{name}: {}", audio.secs());
    }
}
