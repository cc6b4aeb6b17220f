//! Recordings joined end to end in one file, a picture later than the sound, and stereo of opposite phase.

use crate::fixtures::clips::{ffmpeg, number_of, tone, write_numbered};
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_dataset::config::ExtractConfig;
use orator_formats::media_json::MediaInfo;
use orator_formats::timeline_npz::Timeline;
use orator_formats::wav;
use orator_media::ffmpeg::audio::{read_mono, read_mono_with_note};
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::origin;
use orator_pipeline::extract::ExtractStage;
use std::fs;
use std::path::Path;

const FPS: FrameRate = FrameRate::new(25, 1);
const RATE: u32 = 16_000;

/// Writes a numbered clip of `secs` seconds, whose sound is silent except in its last second.
fn recording(dir: &Path, name: &str, secs: usize) {
    let mut sound = tone(RATE, secs as f64, 500.0);
    sound.samples[..(secs - 1) * RATE as usize].fill(0.0);
    write_numbered(dir, name, 25 * secs, FPS, Some(&sound));
}

/// First time after `from` seconds at which the sound is loud.
fn onset(sound: &Sound, from: f64) -> f64 {
    let first = (from * f64::from(sound.rate)) as usize;
    let found = sound.samples[first..].iter().position(|sample| sample.abs() > 0.1).expect("no sound");
    (first + found) as f64 / f64::from(sound.rate)
}

fn join(dir: &Path, parts: &[&str], name: &str) {
    let bytes: Vec<u8> = parts.iter().flat_map(|part| fs::read(dir.join(part)).unwrap()).collect();
    fs::write(dir.join(name), bytes).unwrap();
}

/// Recordings of 3 s and 2 s whose clocks start at these seconds, as transport streams `long` and `short`, or `None`
/// without ffmpeg.
fn recordings(dir: &Path, options: &str, ending: &str, starts: [f64; 2]) -> Option<[String; 2]> {
    let parts = [("long", 3), ("short", 2)];
    let written = parts.iter().zip(starts).map(|((name, secs), start)| {
        recording(dir, &format!("{name}.mp4"), *secs);
        let part = format!("{name}-{start}.{ending}");
        ffmpeg(dir, &format!("-i {name}.mp4 {options} -output_ts_offset {start} {part}")).then_some(part)
    });
    written.collect::<Option<Vec<String>>>()?.try_into().ok()
}

#[test]
fn joined_recordings_are_read_completely_on_one_clock() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    // The clock starts anew, jumps back and forth by hours, and wraps around after 2^33 ticks within a recording.
    for (options, ending, starts) in [
        ("-c copy", "ts", [0.0, 0.0]),
        ("-c copy", "ts", [700.0, 0.0]),
        ("-c copy", "ts", [0.0, 30_000.0]),
        ("-c copy", "ts", [95_441.5, 20.0]),
        ("-c copy", "ts", [60.0, 95_441.5]),
        ("-c:v mpeg2video -q:v 2 -c:a mp2 -f vob", "mpg", [0.0, 0.0]),
    ] {
        let Some([long, short]) = recordings(dir, options, ending, starts) else { continue };
        let name = format!("joined.{ending}");
        join(dir, &[&long, &short, &long], &name);
        let mut reader = FrameReader::open(&dir.join(&name), FPS).unwrap();
        let numbers: Vec<usize> = reader.by_ref().map(|frame| number_of(&frame.unwrap().image)).collect();
        let expected: Vec<usize> = (0..75).chain(0..50).chain(0..75).collect();
        assert_eq!(numbers, expected, "{name} {starts:?}");
        let joins: Vec<f64> = reader.joins_secs().iter().map(|secs| (secs * 1e3).round() / 1e3).collect();
        assert_eq!((joins, reader.damage()), (vec![3.0, 5.0], None), "{name} {starts:?}");
        assert!(reader.seek(80, 3.2).unwrap_err().to_string().contains("joined recordings"));

        let sound = read_mono(&dir.join(&name), RATE).unwrap().unwrap();
        assert!((sound.secs() - 8.0).abs() < 0.15, "{name} {starts:?}: {} s", sound.secs());
        for (from, at) in [(0.0, 2.0), (3.3, 4.0), (5.3, 7.0)] {
            let found = onset(&sound, from);
            assert!((found - at).abs() < 0.06, "{name} {starts:?}: sound at {found} s, expected {at} s");
        }
    }
}

#[test]
fn a_single_recording_with_a_wrapping_clock_has_no_join() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let Some([long, _]) = recordings(dir, "-c copy", "ts", [95_441.5, 0.0]) else { return };
    let mut reader = FrameReader::open(&dir.join(&long), FPS).unwrap();
    assert_eq!((reader.by_ref().count(), reader.joins_secs(), reader.damage()), (75, Vec::new(), None));
}

#[test]
fn extract_records_a_cut_at_a_join() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let Some([long, short]) = recordings(dir, "-c copy", "ts", [0.0, 40.0]) else { return };
    join(dir, &[&long, &short], "joined.MTS");
    let (unit, out) =
        (Unit { speaker: "host".into(), video: "joined".into(), source: dir.join("joined.MTS") }, dir.join("out"));
    fs::create_dir(&out).unwrap();
    let report = ExtractStage::new(&ExtractConfig::default()).run(&unit, &out, &Silent).unwrap();
    assert!(report.line.starts_with("75 frames") && report.line.contains("2 recordings joined"), "{}", report.line);
    let media = MediaInfo::read(&out.join("media.json")).unwrap();
    assert!((media.duration_secs - 5.0).abs() < 1e-6 && media.damage.is_none(), "{media:?}");
    assert!((media.audio_secs.unwrap() - 5.0).abs() < 0.15, "{media:?}");
    let timeline = Timeline::read(&out.join("timeline.npz")).unwrap();
    assert!(timeline.restart[45] && timeline.shot_score[45] == 1.0 && timeline.spans().len() == 1);
}

#[test]
fn the_delay_of_the_first_picture_is_known() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_numbered(dir, "in.mp4", 50, FPS, None);
    wav::write(&dir.join("tone.wav"), &tone(RATE, 2.5, 500.0)).unwrap();
    assert_eq!([dir.join("in.mp4"), dir.join("tone.wav")].map(|path| origin::start_secs(&path).unwrap()), [0.0; 2]);
    for (name, inputs, expected) in [
        ("late_picture.mkv", "-itsoffset 0.7 -i in.mp4 -i tone.wav", 0.7),
        ("late_sound.mkv", "-i in.mp4 -itsoffset 0.7 -i tone.wav", 0.0),
    ] {
        if ffmpeg(dir, &format!("{inputs} -map 0:v -map 1:a -c:v copy -c:a pcm_s16le {name}")) {
            let found = origin::start_secs(&dir.join(name)).unwrap();
            assert!((found - expected).abs() < 0.002, "{name}: {found}");
        }
    }
}

#[test]
fn stereo_of_opposite_phase_is_not_silent() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let left = tone(44_100, 2.0, 440.0);
    let stereo = |name: &str, gain: f32| {
        let (sample_format, bits_per_sample) = (hound::SampleFormat::Int, 16);
        let spec = hound::WavSpec { channels: 2, sample_rate: left.rate, bits_per_sample, sample_format };
        let mut file = hound::WavWriter::create(dir.join(name), spec).unwrap();
        for sample in &left.samples {
            for value in [*sample, gain * sample] {
                file.write_sample((value * 32_767.0) as i16).unwrap();
            }
        }
        file.finalize().unwrap();
    };
    stereo("opposite.wav", -1.0);
    stereo("alike.wav", 1.0);
    let peak = |path: &Path| {
        let (sound, note) = read_mono_with_note(path, RATE).unwrap().unwrap();
        assert!((sound.secs() - 2.0).abs() < 0.05, "{}", sound.secs());
        (sound.samples.iter().fold(0.0, |most: f32, sample| most.max(sample.abs())), note)
    };
    let (loud, note) = peak(&dir.join("opposite.wav"));
    assert!((0.45..0.55).contains(&loud) && note.unwrap().contains("opposite phase for 2.0 s"), "{loud}");
    assert_eq!(peak(&dir.join("alike.wav")).1, None);
    // Other sample formats and layouts, packed and planar.
    for (name, options) in [
        ("f32.wav", "-c:a pcm_f32le"),
        ("s32.flac", "-sample_fmt s32"),
        ("aac.m4a", "-c:a aac"),
        ("u8.wav", "-c:a pcm_u8"),
    ] {
        if ffmpeg(dir, &format!("-i opposite.wav {options} {name}")) {
            let (loud, note) = peak(&dir.join(name));
            assert!(loud > 0.4 && note.is_some(), "{name}: {loud} {note:?}");
        }
    }
}
