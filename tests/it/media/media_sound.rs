//! Sound on the pictures' clock: rates, channels, offsets, gaps, and a flash with its beep.

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
const PICTURES: FrameRate = FrameRate::new(30, 1);

/// Second of the first sample louder than a tenth.
fn first_loud(sound: &Sound) -> f64 {
    let at = sound.samples.iter().position(|s| s.abs() > 0.1).expect("no sound");
    at as f64 / f64::from(sound.rate)
}

/// Zero crossings upwards a second, in the middle half of the sound: the pitch of a pure tone.
fn pitch(sound: &Sound) -> f64 {
    let n = sound.samples.len();
    let middle = &sound.samples[n / 4..3 * n / 4];
    let n_up = middle.windows(2).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count();
    n_up as f64 * f64::from(sound.rate) / middle.len() as f64
}

/// A clip of 3 s, white and beeping from second `at` on, else black and silent.
fn flash_and_beep(path: &Path, at: f64) {
    let mut sound = tone(RATE, 3.0, 1000.0);
    sound.samples[..(at * f64::from(RATE)) as usize].fill(0.0);
    let mut video = VideoWriter::create(path, 64, 48, PICTURES, Some(&sound)).unwrap();
    for n in 0..90 {
        let level = if PICTURES.secs(n) >= at - 1e-9 { 255 } else { 0 };
        video.push(&Image::filled(64, 48, [level; 3])).unwrap();
    }
    video.finish().unwrap();
}

/// Seconds of flash and beep in a file, at 30 fps.
fn flash_and_beep_secs(path: &Path) -> (f64, f64) {
    let mut frames = FrameReader::open(path, PICTURES).unwrap().map(Result::unwrap);
    let flash = frames.find(|frame| frame.image.data[0] > 128).expect("no flash");
    (PICTURES.secs(flash.frame_idx), first_loud(&read_mono(path, RATE).unwrap().unwrap()))
}

#[test]
fn flash_and_beep_stay_together() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("flash.mp4");
    flash_and_beep(&path, 1.5);
    let (flash, beep) = flash_and_beep_secs(&path);
    assert!((flash - 1.5).abs() < 1e-9 && (beep - 1.5).abs() < 0.005, "flash {flash}, beep {beep}");
    // Other containers, offsets between the streams, an edit list, a clip cut out of the middle.
    for (name, how, tolerance) in [
        ("copy.mkv", "-i flash.mp4 -c copy", 0.005),
        ("opus.webm", "-i flash.mp4 -c:v libvpx -b:v 1M -c:a libopus", 0.01),
        ("offset.ts", "-i flash.mp4 -c copy -muxdelay 1.4", 0.005),
        ("cut.mp4", "-ss 0.7 -i flash.mp4 -c copy", 0.03),
        ("cut_recoded.mp4", "-ss 0.7 -i flash.mp4 -c:v libx264 -c:a aac", 0.03),
        ("mp3.avi", "-i flash.mp4 -c:v mpeg4 -q:v 3 -c:a libmp3lame -ar 44100", 0.06),
    ] {
        if !ffmpeg(dir.path(), &format!("{how} {name}")) {
            continue;
        }
        let (flash, beep) = flash_and_beep_secs(&dir.path().join(name));
        eprintln!("{name}: flash {flash:.4} s, beep {beep:.4} s");
        assert!((flash - beep).abs() <= tolerance, "{name}: flash {flash}, beep {beep}");
    }
}

#[test]
fn a_late_track_is_padded_and_an_early_one_cut() {
    let dir = tempfile::tempdir().unwrap();
    write_numbered(dir.path(), "in.mp4", 60, PICTURES, None);
    wav::write(&dir.path().join("tone.wav"), &tone(RATE, 1.5, 500.0)).unwrap();
    // The sound starts half a second after the pictures.
    if ffmpeg(dir.path(), "-i in.mp4 -itsoffset 0.5 -i tone.wav -map 0:v -map 1:a -c:v copy -c:a pcm_s16le late.mkv") {
        let sound = read_mono(&dir.path().join("late.mkv"), RATE).unwrap().unwrap();
        assert!((first_loud(&sound) - 0.5).abs() < 0.003, "{}", first_loud(&sound));
        assert!((sound.secs() - 2.0).abs() < 0.005, "{}", sound.secs());
    }
    // The pictures start half a second after the sound: its first half second is cut.
    if ffmpeg(dir.path(), "-itsoffset 0.5 -i in.mp4 -i tone.wav -map 0:v -map 1:a -c:v copy -c:a pcm_s16le early.mkv") {
        let sound = read_mono(&dir.path().join("early.mkv"), RATE).unwrap().unwrap();
        assert!((sound.secs() - 1.0).abs() < 0.005, "{}", sound.secs());
        let mut frames = FrameReader::open(&dir.path().join("early.mkv"), PICTURES).unwrap();
        assert_eq!(frames.next().unwrap().unwrap().source_secs, 0.0);
        assert_eq!(1 + frames.count(), 60);
    }
}

#[test]
fn a_gap_in_the_container_is_silence() {
    let dir = tempfile::tempdir().unwrap();
    wav::write(&dir.path().join("tone.wav"), &tone(48_000, 3.0, 500.0)).unwrap();
    // Drops the samples of second 1 to 2 and keeps the times of the rest.
    if !ffmpeg(dir.path(), "-i tone.wav -af aselect='lt(t,1)+gt(t,2)' -c:a pcm_s16le gap.mkv") {
        return;
    }
    let sound = read_mono(&dir.path().join("gap.mkv"), RATE).unwrap().unwrap();
    let loud = |from: f64, to: f64| {
        let n = |secs: f64| (secs * f64::from(RATE)) as usize;
        sound.samples[n(from)..n(to)].iter().fold(0.0f32, |most, s| most.max(s.abs()))
    };
    assert!((sound.secs() - 3.0).abs() < 0.03, "{}", sound.secs());
    assert!(loud(0.1, 0.95) > 0.4 && loud(2.05, 2.9) > 0.4);
    assert!(loud(1.05, 1.95) < 1e-3);
}

#[test]
fn a_jump_in_time_is_damage_not_an_hour_of_silence() {
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
fn rates_and_channels_become_16_khz_mono() {
    let dir = tempfile::tempdir().unwrap();
    wav::write(&dir.path().join("tone.wav"), &tone(48_000, 2.0, 440.0)).unwrap();
    let mut cases = vec![("tone.wav".to_owned(), 1e-9)];
    for (name, how, tolerance) in [
        ("22050.wav", "-ar 22050", 1e-3),
        ("24000.flac", "-ar 24000", 1e-3),
        ("44100.mp3", "-ar 44100", 0.06),
        ("stereo.m4a", "-ar 44100 -ac 2", 0.03),
        ("surround.m4a", "-ac 6", 0.03),
        ("unnamed.wav", "-af pan=4c|c0=c0|c1=c0|c2=c0|c3=c0", 1e-3),
        ("eight.wav", "-ar 8000 -c:a pcm_u8", 1e-3),
    ] {
        if ffmpeg(dir.path(), &format!("-i tone.wav {how} {name}")) {
            cases.push((name.to_owned(), tolerance));
        }
    }
    for (name, tolerance) in cases {
        let sound = read_mono(&dir.path().join(&name), RATE).unwrap().unwrap();
        assert_eq!(sound.rate, RATE);
        assert!((sound.secs() - 2.0).abs() <= tolerance, "{name}: {} s", sound.secs());
        assert!((pitch(&sound) - 440.0).abs() < 2.0, "{name}: {} Hz", pitch(&sound));
        let peak = sound.samples.iter().fold(0.0f32, |most, s| most.max(s.abs()));
        assert!((0.1..0.75).contains(&peak), "{name}: peak {peak}");
    }
}

#[test]
fn wavs_round_trip_to_the_bit_and_streaming_gives_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let (path, out) = (dir.path().join("in.wav"), dir.path().join("out.wav"));
    wav::write(&path, &tone(RATE, 1.2345, 300.0)).unwrap();
    let extracted = extract_wav(&path, 0, &out, RATE).unwrap().unwrap();
    assert_eq!((extracted.secs, extracted.damage), ((1.2345f64 * 16_000.0).round() / 16_000.0, None));
    assert_eq!(std::fs::read(&path).unwrap(), std::fs::read(&out).unwrap());
}

#[test]
fn a_sample_that_is_no_number_is_named_with_its_second() {
    let dir = tempfile::tempdir().unwrap();
    let written = |name: &str, n_channels: u16, spoilt: &dyn Fn(usize) -> Option<f32>| {
        let path = dir.path().join(name);
        let sample_format = hound::SampleFormat::Float;
        let spec = hound::WavSpec { channels: n_channels, sample_rate: 48_000, bits_per_sample: 32, sample_format };
        let mut wav = hound::WavWriter::create(&path, spec).unwrap();
        for n in 0..96_000 * usize::from(n_channels) {
            wav.write_sample(spoilt(n).unwrap_or((n as f32 * 0.01).sin() * 0.3)).unwrap();
        }
        wav.finalize().unwrap();
        path
    };
    assert!(read_mono(&written("whole.wav", 2, &|_| None), RATE).is_ok());
    let one = |at: usize, value: f32| move |n: usize| (n == at).then_some(value);
    for (path, second) in [
        (written("one.wav", 1, &one(72_000, f32::NAN)), "1.50"),
        (written("right.wav", 2, &one(72_001, f32::INFINITY)), "0.75"),
        (written("all.wav", 1, &|_| Some(f32::NAN)), "0.00"),
    ] {
        let out = dir.path().join("out.wav");
        let pieces = SoundStream::open(&path, RATE).last().unwrap().map(drop);
        for read in [read_mono(&path, RATE).map(drop), extract_wav(&path, 0, &out, RATE).map(drop), pieces] {
            let words = format!("{} is damaged: a sample at {second} s is not finite;", path.display());
            let error = format!("{:#}", read.unwrap_err());
            assert!(error.contains(&words), "{error}");
        }
    }
}

#[test]
fn no_sound_is_none_and_no_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = write_numbered(dir.path(), "in.mp4", 5, PICTURES, None);
    let out = dir.path().join("out.wav");
    assert_eq!(extract_wav(&path, 0, &out, RATE).unwrap(), None);
    assert!(!out.exists());
    assert_eq!(read_mono(&path, RATE).unwrap(), None);
}

#[test]
fn real_sound_has_its_length() {
    for (name, secs) in [
        ("data/audio/jfk_whisper_11s.flac", 11.0),
        ("data/audio/talkshow_french.wav", f64::NAN),
        ("data/videos/talk_latentsync_demo1_1080x1920_hevc.mp4", 10.008),
    ] {
        let Some(path) = real_data(name) else { continue };
        let sound = read_mono(&path, RATE).unwrap().unwrap();
        assert!(secs.is_nan() || (sound.secs() - secs).abs() < 0.05, "{name}: {}", sound.secs());
    }
}
