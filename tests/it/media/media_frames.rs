//! Source frames that the frame reader returns: constant and variable rates, rotation, codecs, damaged files.

use crate::fixtures::clips;
use crate::fixtures::clips::{ffmpeg, number_of, write_numbered, write_sized};
use orator_base::types::time::FrameRate;
use orator_media::ffmpeg::frames::{FrameReader, TimedFrame};
use orator_media::ffmpeg::probe::probe;
use orator_test_support::skip::real_data;
use std::path::Path;

const DATASET: FrameRate = FrameRate::new(15, 1);

/// Source frame number and `repeated` flag of each output frame.
fn numbers(path: &Path, fps: FrameRate) -> Vec<(usize, bool)> {
    let frames = FrameReader::open(path, fps).unwrap().map(Result::unwrap);
    frames
        .enumerate()
        .map(|(n, frame)| (assert_eq!(n, frame.frame_idx), number_of(&frame.image), frame.repeated))
        .map(|((), number, repeated)| (number, repeated))
        .collect()
}

/// Expected frames: the source frame with the nearest time, the earlier one of a tie.
fn expected(times: &[f64], end: f64, fps: FrameRate) -> Vec<(usize, bool)> {
    let mut before = usize::MAX;
    let nearest = |n: usize| {
        let distance = |k: &usize| (times[*k] - fps.secs(n)).abs();
        (0..times.len()).fold(0, |best, k| if distance(&k) < distance(&best) - 1e-9 { k } else { best })
    };
    let all = (0..fps.frames_in(end)).map(nearest).collect::<Vec<_>>();
    all.into_iter().map(|k| (k, std::mem::replace(&mut before, k) == k)).collect()
}

#[test]
fn every_source_rate_is_resampled_to_the_nearest_frames() {
    let dir = tempfile::tempdir().unwrap();
    for (num, den, n) in [(10, 1, 21), (15, 1, 30), (25, 1, 50), (30_000, 1_001, 61), (30, 1, 60), (60, 1, 121)] {
        let source = FrameRate::new(num, den);
        let path = write_numbered(dir.path(), &format!("{num}.mp4"), n, source, None);
        let times: Vec<f64> = (0..n).map(|k| source.secs(k)).collect();
        for fps in [DATASET, FrameRate::new(20, 1)] {
            assert_eq!(numbers(&path, fps), expected(&times, source.secs(n), fps), "{source} to {fps}");
        }
        let info = probe(&path).unwrap();
        assert_eq!(info.video.unwrap().fps, Some(source));
        assert!((info.duration_secs.unwrap() - source.secs(n)).abs() < 2e-3);
    }
}

#[test]
fn a_tie_goes_to_the_earlier_frame() {
    let dir = tempfile::tempdir().unwrap();
    let path = write_numbered(dir.path(), "ten.mp4", 4, FrameRate::new(10, 1), None);
    let shown: Vec<usize> = numbers(&path, FrameRate::new(20, 1)).into_iter().map(|(k, _)| k).collect();
    assert_eq!(shown, [0, 0, 1, 1, 2, 2, 3, 3]);
}

#[test]
fn a_variable_rate_is_resampled_by_time_stamps() {
    let dir = tempfile::tempdir().unwrap();
    write_numbered(dir.path(), "in.mp4", 60, FrameRate::new(30, 1), None);
    // Selects frames 0..15 and every fourth later one: 30 fps, then 7.5 fps, given by time stamps only.
    let select = "-i in.mp4 -vf select='lt(n,15)+not(mod(n,4))' -vsync vfr -c:v libx264 -crf 12";
    let selected: Vec<usize> = (0..60).filter(|n| *n < 15 || n % 4 == 0).collect();
    // Matroska has time stamps in milliseconds.
    for (name, ticks) in [("out.mp4", 15_360.0), ("out.mkv", 1000.0)] {
        let times: Vec<f64> = selected.iter().map(|n| (*n as f64 / 30.0 * ticks).round() / ticks).collect();
        if !ffmpeg(dir.path(), &format!("{select} {name}")) {
            continue;
        }
        let read = numbers(&dir.path().join(name), DATASET);
        let all: Vec<(usize, bool)> = expected(&times, 2.0, DATASET).iter().map(|(k, r)| (selected[*k], *r)).collect();
        // The duration of the last frame is estimated by the container.
        let n = read.len().min(all.len());
        assert!(n >= 28, "{name}: {n} frames");
        assert_eq!(read[..n], all[..n], "{name}");
    }
}

#[test]
fn rotated_videos_are_read_upright() {
    let dir = tempfile::tempdir().unwrap();
    write_sized(dir.path(), "in.mp4", 20, FrameRate::new(30, 1), [160, 96], None);
    for (rotate, filter, degrees) in
        [("90", "transpose=clock", 270), ("180", "hflip,vflip", 180), ("270", "transpose=cclock", 90)]
    {
        // Encoded rotated, with metadata that rotates the display back.
        if !ffmpeg(dir.path(), &format!("-i in.mp4 -vf {filter} -c:v libx264 -crf 12 coded.mp4"))
            || !ffmpeg(dir.path(), &format!("-i coded.mp4 -c copy -metadata:s:v rotate={rotate} turned.mp4"))
        {
            continue;
        }
        let path = dir.path().join("turned.mp4");
        let video = probe(&path).unwrap().video.unwrap();
        assert_eq!((video.rotation, video.image_size), (degrees, [160, 96]), "rotate={rotate}");
        let all: Vec<usize> = numbers(&path, DATASET).into_iter().map(|(k, _)| k).collect();
        assert_eq!(all, [0, 2, 4, 6, 8, 10, 12, 14, 16, 18]);
    }
}

#[test]
fn other_codecs_containers_and_odd_sizes_are_read() {
    let dir = tempfile::tempdir().unwrap();
    write_numbered(dir.path(), "in.mp4", 40, FrameRate::new(30, 1), None);
    let every_second: Vec<usize> = (0..20).map(|n| 2 * n).collect();
    for (name, options) in [
        ("hevc.mp4", "-c:v libx265 -x265-params log-level=none"),
        ("vp9.webm", "-c:v libvpx-vp9 -deadline realtime -b:v 2M"),
        ("odd.mkv", "-vf scale=123:61 -pix_fmt yuv444p -c:v ffv1"),
        ("bframes.avi", "-c:v mpeg4 -q:v 2 -bf 2"),
        ("stream.ts", "-c:v libx264 -bf 3"),
    ] {
        if !ffmpeg(dir.path(), &format!("-i in.mp4 {options} {name}")) {
            continue;
        }
        let all: Vec<usize> = numbers(&dir.path().join(name), DATASET).into_iter().map(|(k, _)| k).collect();
        assert_eq!(all[..19], every_second[..19], "{name}");
        assert!((20..=21).contains(&all.len()), "{name}: {} frames", all.len());
    }
}

#[test]
fn all_written_frames_are_read_back_for_single_frames_and_odd_sizes() {
    let dir = tempfile::tempdir().unwrap();
    for (n, size) in [(1, [128, 64]), (2, [33, 17]), (45, [100, 50])] {
        let path = write_sized(dir.path(), "clip.mp4", n, DATASET, size, None);
        let mut reader = FrameReader::open(&path, DATASET).unwrap();
        assert_eq!(reader.image_size(), size.map(|s: usize| s.next_multiple_of(2)));
        let frames: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
        assert_eq!(frames.len(), n);
        assert!(frames.iter().all(|frame| !frame.repeated));
        assert!((reader.duration_secs() - DATASET.secs(n)).abs() < 1e-3, "{}", reader.duration_secs());
        assert_eq!(reader.damage(), None);
        let colour = frames[0].image.pixel(size[0] / 2, size[1] / 4);
        assert!(colour.iter().zip([200, 20, 20]).all(|(a, b)| a.abs_diff(b) < 12), "{colour:?}");
        assert_eq!(number_of(&frames[n - 1].image), n - 1);
    }
}

#[test]
fn writing_the_same_frames_and_audio_gives_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let audio = clips::tone(16_000, 3.0, 440.0);
    for size in [[100, 50], [112, 64], [320, 240]] {
        let write = |_| std::fs::read(write_sized(dir.path(), "clip.mp4", 45, DATASET, size, Some(&audio))).unwrap();
        let all: Vec<Vec<u8>> = (0..4).map(write).collect();
        assert!(all.iter().all(|bytes| *bytes == all[0]), "{size:?}");
    }
}

#[test]
fn frames_can_be_read_at_a_smaller_size() {
    let dir = tempfile::tempdir().unwrap();
    let path = write_numbered(dir.path(), "in.mp4", 20, FrameRate::new(30, 1), None);
    let mut reader = FrameReader::open_with(&path, DATASET, 2).unwrap();
    let mut n = 0;
    while let Some(time) = reader.advance().unwrap() {
        let small = reader.picture(Some([32, 16])).unwrap();
        assert_eq!([small.width, small.height], [32, 16]);
        assert_eq!((number_of(&small), number_of(&reader.picture(None).unwrap())), (2 * n, 2 * n));
        assert!((time.source_secs - n as f64 / 15.0).abs() < 1e-9);
        n += 1;
    }
    assert_eq!(n, 10);
}

#[test]
fn invalid_files_are_errors_with_the_name_and_the_cause() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("empty.mp4"), b"").unwrap();
    std::fs::write(at("text.mp4"), "These are words, not a video.\n".repeat(99)).unwrap();
    clips::write_numbered(dir.path(), "in.mp4", 60, FrameRate::new(30, 1), None);
    let bytes = std::fs::read(at("in.mp4")).unwrap();
    std::fs::write(at("no_index.mp4"), &bytes[..200]).unwrap();
    orator_formats::wav::write(&at("sound.wav"), &clips::tone(16_000, 0.5, 440.0)).unwrap();
    for (name, expected) in [
        ("empty.mp4", "is empty (0 bytes)"),
        ("text.mp4", "is not a media file"),
        ("no_index.mp4", "is truncated"),
        ("missing.mp4", "cannot read"),
        (".", "is a folder"),
        ("sound.wav", "has no video"),
    ] {
        let error = format!("{:#}", FrameReader::open(&at(name), DATASET).err().expect(name));
        assert!(error.contains(expected) && error.contains(name), "{name}: {error}");
    }
    assert!(probe(&at("sound.wav")).unwrap().video.is_none());
}

#[test]
fn a_truncated_file_gives_its_readable_frames_and_a_damage_note() {
    let dir = tempfile::tempdir().unwrap();
    let path = write_numbered(dir.path(), "in.mp4", 250, FrameRate::new(30, 1), None);
    let bytes = std::fs::read(&path).unwrap();
    // The index is at the front, so the readable frames are about proportional to the remaining bytes.
    std::fs::write(&path, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let mut reader = FrameReader::open(&path, DATASET).unwrap();
    let n = reader.by_ref().map(Result::unwrap).enumerate().filter(|(n, f)| number_of(&f.image) == 2 * n).count();
    assert!((20..115).contains(&n), "{n} frames");
    let damage = reader.damage().unwrap();
    assert!(damage.contains("pictures end at"), "{damage}");
}

#[test]
fn a_jump_in_frame_times_is_damage_and_not_filled_with_repeats() {
    let dir = tempfile::tempdir().unwrap();
    write_numbered(dir.path(), "in.mp4", 40, FrameRate::new(30, 1), None);
    let jump = "setpts=if(gte(N\\,20)\\,PTS+2000/TB\\,PTS)";
    if ffmpeg(dir.path(), &format!("-i in.mp4 -vf {jump} -vsync vfr -c:v libx264 -crf 12 jump.mkv")) {
        let mut reader = FrameReader::open(&dir.path().join("jump.mkv"), DATASET).unwrap();
        assert_eq!(reader.by_ref().map(Result::unwrap).count(), 10);
        let damage = reader.damage().unwrap();
        assert!(damage.contains("20 frames with impossible times"), "{damage}");
    }
}

#[test]
fn corrupt_bytes_are_reported_and_the_other_frames_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = write_numbered(dir.path(), "in.mp4", 100, FrameRate::new(30, 1), None);
    let mut bytes = std::fs::read(&path).unwrap();
    // The first frame fills half of the file; the corrupt bytes belong to a later frame.
    let (from, to) = (bytes.len() * 9 / 10, bytes.len() * 9 / 10 + 40);
    bytes[from..to].fill(0xa5);
    std::fs::write(&path, bytes).unwrap();
    let mut reader = FrameReader::open(&path, DATASET).unwrap();
    let n = reader.by_ref().map(Result::unwrap).count();
    let damage = reader.damage().expect("damage");
    assert!(n >= 45, "{n} frames, {damage}");
}

#[test]
fn reading_after_a_seek_equals_reading_from_the_start() {
    let dir = tempfile::tempdir().unwrap();
    let path = write_numbered(dir.path(), "long.mp4", 240, FrameRate::new(30, 1), None);
    let read = |reader: FrameReader| {
        let frame = |frame: TimedFrame| (frame.frame_idx, number_of(&frame.image), frame.source_secs, frame.repeated);
        reader.map(|one| frame(one.unwrap())).collect::<Vec<_>>()
    };
    let fps = FrameRate::new(20, 1);
    let all = read(FrameReader::open(&path, fps).unwrap());
    for from in [0, 1, 77, 158, 159] {
        let mut reader = FrameReader::open(&path, fps).unwrap();
        reader.seek(from, all[from].2).unwrap();
        assert_eq!(read(reader), all[from..], "from {from}");
    }
    let mut reader = FrameReader::open(&path, fps).unwrap();
    for between in [all[77].2 + 0.011, 8.5] {
        let error = reader.seek(77, between).unwrap_err().to_string();
        assert!(error.contains("long.mp4 has no image at"), "{error}");
    }
}

#[test]
fn names_may_contain_colons_and_readers_can_move_between_threads() {
    let dir = tempfile::tempdir().unwrap();
    let path = write_numbered(dir.path(), "talk 10:30, part 1 \u{e9}.mp4", 6, FrameRate::new(30, 1), None);
    let mut reader = FrameReader::open(&path, DATASET).unwrap();
    reader.next().unwrap().unwrap();
    assert_eq!(std::thread::spawn(move || reader.count()).join().unwrap(), 2);
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        let not_utf8 = dir.path().join(std::ffi::OsStr::from_bytes(b"\xff.mp4"));
        std::fs::rename(&path, &not_utf8).unwrap();
        let error = format!("{:#}", FrameReader::open(&not_utf8, DATASET).err().unwrap());
        assert!(error.contains("not UTF-8"), "{error}");
    }
}

#[test]
fn real_clips_have_the_expected_frames() {
    for (name, size, n_frames, repeats) in [
        ("data/videos/talk_latentsync_demo1_1080x1920_hevc.mp4", [1080, 1920], 150, 0),
        ("data/videos/silent/ted_lia_2.mp4", [256, 256], 195, 65),
        ("data/videos/talk_tyson_2cam_17s_720p.mp4", [1280, 720], 259, 0),
    ] {
        let Some(path) = real_data(name) else { continue };
        let mut reader = FrameReader::open_with(&path, DATASET, 0).unwrap();
        assert_eq!(reader.image_size(), size, "{name}");
        let (mut n, mut n_repeated) = (0, 0);
        while let Some(time) = reader.advance().unwrap() {
            n += 1;
            n_repeated += usize::from(time.repeated);
        }
        assert_eq!((n, n_repeated, reader.damage()), (n_frames, repeats, None), "{name}");
    }
}
