//! Films of the avatar, with their frames and audio; and poses drawn with missing joints.

use crate::fixtures::figures::{FPS, swinging};
use crate::fixtures::media::sync_clips::{Kind, PLAIN, chirp, chirp_begins, make};
use ndarray::{Array3, Axis, s};
use orator_avatar::animate::draw::figure::{FigureView, LEFT, PAPER, RIGHT, draw_pose};
use orator_avatar::animate::export::film;
use orator_avatar::animate::export::film::{Film, FilmSource, SIZE, SecondPanel};
use orator_avatar::animate::export::film_avatar::FilmCamera;
use orator_avatar::animate::export::film_source::SourceCamera;
use orator_avatar::animate::{AnimationOptions, Constraints, Performance, Smoothing, perform};
use orator_base::stage::progress::Silent;
use orator_base::types::image::Image;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, R_ELBOW, R_SHOULDER, R_WRIST};
use orator_base::types::sound::Sound;
use orator_formats::npy;
use orator_media::ffmpeg::frames::FrameReader;
use orator_media::ffmpeg::{audio, probe};
use std::path::Path;
use std::process::Command;

/// Mean column of the pixels with the hue of `hue`: warm (red above blue) or cold.
fn mean_column(image: &Image, columns: std::ops::Range<usize>, hue: [u8; 3]) -> f64 {
    let warm = |rgb: [u8; 3]| i32::from(rgb[0]) - i32::from(rgb[2]);
    let (mut sum, mut n) = (0.0, 0.0);
    for y in 60..600 {
        for x in columns.clone() {
            let found = warm(image.pixel(x, y));
            if found.abs() > 60 && (found > 0) == (warm(hue) > 0) {
                (sum, n) = (sum + x as f64, n + 1.0);
            }
        }
    }
    assert!(n > 200.0, "only {n} pixels of {hue:?}");
    sum / n
}

/// Source of a silent film with one panel, from the front.
fn single_panel(performance: &Performance) -> FilmSource<'_> {
    FilmSource { performance, camera: FilmCamera::Front, sound: None, second_panel: SecondPanel::Itself }
}

/// The motion on its rig, neither smoothed nor constrained.
fn unchanged(motion: &Motion) -> Performance {
    let (smoothing, constraints) = (Smoothing::None, Constraints::NONE);
    perform(motion, None, &AnimationOptions { smoothing, constraints, ..AnimationOptions::default() })
}

#[test]
fn a_pose_is_drawn_from_the_front_and_invalid_joints_are_omitted() {
    let mut motion = swinging(4, 5);
    let drawn = |motion: &Motion, frame: usize| {
        let mut image = Image::filled(SIZE[0], SIZE[1], PAPER);
        let view = FigureView::front([640.0, 250.0], 400.0);
        draw_pose(&mut image, motion.joints.index_axis(Axis(0), frame), &view).unwrap();
        image
    };
    let image = drawn(&motion, 0);
    assert!(mean_column(&image, 0..1280, LEFT) > mean_column(&image, 0..1280, RIGHT));
    motion.joints.slice_mut(s![0, 7.., ..]).fill(f32::NAN);
    motion.joints.slice_mut(s![1, .., ..]).fill(f32::NAN);
    motion.joints.slice_mut(s![2, 3, ..]).fill(1e30);
    motion.joints.slice_mut(s![3, .., ..]).fill(0.0);
    let blank = drawn(&motion, 1);
    for frame in [0, 2, 3, 4] {
        assert_ne!(drawn(&motion, frame), blank, "frame {frame}");
    }
}

#[test]
fn the_mp4_has_all_frames_and_the_audio() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("talk.mp4");
    let performance = unchanged(&swinging(6, 15));
    let samples = (0..16_000).map(|n| (n as f32 * 0.17).sin() * (n as f32 / 16_000.0)).collect();
    let sound = Sound { rate: 16_000, samples };
    film::write(&path, FilmSource { sound: Some(&sound), ..single_panel(&performance) }, &Silent).unwrap();
    let info = probe::probe(&path).unwrap();
    let secs = info.duration_secs.unwrap();
    assert!((secs - 15.0 / FPS.per_sec()).abs() < 0.1, "{secs} s");
    let sound = audio::read_mono(&path, 16_000).unwrap().expect("an audio track");
    assert!((sound.secs() - 1.0).abs() < 0.1);
    let frames = orator_media::ffmpeg::frames::FrameReader::open(&path, FPS).unwrap().count();
    assert_eq!(frames, 15);
}

/// Streams of a file as reported by ffprobe: kind, start and duration in seconds.
fn streams(path: &Path) -> Vec<(String, f64, f64)> {
    let entries = "stream=codec_type,start_time,duration";
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-of", "csv=p=0", "-show_entries", entries])
        .arg(path)
        .output()
        .expect("ffprobe");
    let line = |line: &str| {
        let words: Vec<&str> = line.split(',').collect();
        (words[0].to_owned(), words[1].parse().unwrap(), words[2].parse().unwrap())
    };
    String::from_utf8(output.stdout).unwrap().lines().map(line).collect()
}

#[test]
fn audio_clicks_coincide_with_the_frames_of_their_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clicks.mp4");
    // The arms are raised at seconds 1, 2 and 3 and fall half a second later.
    let mut motion = swinging(6, 60);
    let rest_pose = motion.joints.slice(s![0, .., ..]).to_owned();
    for (frame, mut joints) in motion.joints.outer_iter_mut().enumerate() {
        joints.assign(&rest_pose);
        if frame >= 15 && frame % 15 < 7 {
            joints.slice_mut(s![1.., 1]).mapv_inplace(|y| -y);
        }
    }
    let rate = 16_000;
    let sample = |n: usize| (1..4).map(|k| chirp(n as f64 / f64::from(rate) - f64::from(k))).sum::<f64>() as f32;
    let sound = Sound { rate, samples: (0..4 * rate as usize).map(sample).collect() };
    let performance = unchanged(&motion);
    film::write(&path, FilmSource { sound: Some(&sound), ..single_panel(&performance) }, &Silent).unwrap();

    let streams = streams(&path);
    let of = |kind: &str| streams.iter().find(|stream| stream.0 == kind).unwrap_or_else(|| panic!("no {kind}"));
    let (video_stream, audio_stream) = (of("video"), of("audio"));
    eprintln!(
        "video {:.4} s from {:.4} s, audio {:.4} s from {:.4} s",
        video_stream.2, video_stream.1, audio_stream.2, audio_stream.1
    );
    assert!((video_stream.2 - 4.0).abs() < 1e-3 && (video_stream.2 - audio_stream.2).abs() < FPS.secs(1));
    assert!((video_stream.1 - audio_stream.1).abs() < 1e-3);

    let read = audio::read_mono(&path, rate).unwrap().expect("an audio track");
    let frames: Vec<Image> = FrameReader::open(&path, FPS).unwrap().map(|frame| frame.unwrap().image).collect();
    // Changed pixels against the first frame, sampled one in nine: few by the mouth, many by the arms.
    let moved = |image: &Image| {
        let pixels = (0..SIZE[0]).step_by(3).flat_map(|x| (0..620).step_by(3).map(move |y| (x, y)));
        pixels.filter(|&(x, y)| image.pixel(x, y)[0].abs_diff(frames[0].pixel(x, y)[0]) > 40).count()
    };
    let up: Vec<bool> = frames.iter().map(|image| moved(image) > 400).collect();
    for k in 1..4 {
        let shown = (15 * k - 7..15 * k + 7).find(|&n| up[n]).expect("the arms go up");
        let onset = chirp_begins(&read.samples, rate, k as f64);
        eprintln!("second {k}: shown at {:.4} s, audible at {onset:.4} s", FPS.secs(shown));
        assert_eq!(shown, 15 * k);
        assert!((onset - k as f64).abs() < 0.002, "{onset}");
    }
}

#[test]
fn the_source_video_panel_is_in_sync_with_the_avatar() {
    let folder = tempfile::tempdir().unwrap();
    let Some(clip) = make(folder.path(), &Kind { secs: 6.0, ..PLAIN }) else { return };
    let path = folder.path().join("beside.mp4");
    let performance = unchanged(&swinging(6, 30));
    let panel = SecondPanel::Video { path: &clip.path, from_secs: 2.0, camera: None };
    film::write(&path, FilmSource { second_panel: panel, ..single_panel(&performance) }, &Silent).unwrap();
    // A frame of the clip fills the left half: 64 x 48 px are scaled to 600 x 450.
    let read = |image: &Image| {
        let bit = |block: usize| {
            let (x, y) = (4.0 + 8.0 * (block % 8) as f64, 24.0 + 6.0 + 12.0 * (block / 8) as f64);
            usize::from(image.pixel((30.0 + x * 9.375) as usize, (113.0 + y * 9.375) as usize)[1] > 128) << block
        };
        (0..16).map(bit).sum::<usize>()
    };
    let film = FrameReader::open(&path, FPS).unwrap();
    for (n, frame) in film.enumerate() {
        assert_eq!(read(&frame.unwrap().image), 60 + 2 * n, "frame {n}");
    }
    let panel = SecondPanel::Video { path: &clip.path, from_secs: 60.0, camera: None };
    let late = FilmSource { second_panel: panel, ..single_panel(&performance) };
    let error = format!("{:#}", film::write(&path, late, &Silent).unwrap_err());
    assert!(error.contains("lasts 6.0 s"), "{error}");
}

#[test]
fn a_second_motion_is_drawn_in_its_panel_until_it_ends() {
    let (motion, mut other) = (swinging(6, 30), swinging(7, 20));
    other.fps = orator_base::types::time::FrameRate::new(30, 1);
    let [performance, other] = [unchanged(&motion), unchanged(&other)];
    let panel = SecondPanel::Motion { performance: &other, labels: ["truth", "prediction"] };
    let mut film = Film::new(FilmSource { second_panel: panel, ..single_panel(&performance) });
    let half = |image: &Image, from: usize| {
        let pixels = (from..from + 600).flat_map(|x| (70..610).map(move |y| (x, y)));
        pixels.filter(|&(x, y)| image.pixel(x, y) != PAPER).count()
    };
    // 20 frames at 30 fps end before frame 10 at 15 fps.
    let (early, late) = (film.frame(5).unwrap(), film.frame(12).unwrap());
    assert!(half(&early, 30) > 500 && half(&early, 660) > 500);
    assert!(half(&late, 30) > 500 && half(&late, 660) == 0);
}

#[test]
fn a_film_with_source_video_has_its_audio_from_the_start_time() {
    let folder = tempfile::tempdir().unwrap();
    let Some(clip) = make(folder.path(), &Kind { secs: 6.0, ..PLAIN }) else { return };
    let [motion, film] = ["motion.npy", "film.mp4"].map(|name| folder.path().join(name));
    npy::write(&motion, &swinging(6, 30)).unwrap();
    let mut orator = Command::new(env!("CARGO_BIN_EXE_orator"));
    orator.arg("animate").arg(&motion).arg("--out").arg(&film).arg("--compare").arg(&clip.path);
    let output = orator.args(["--compare-start", "2"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lengths: Vec<f64> = streams(&film).into_iter().map(|stream| stream.2).collect();
    assert!(lengths.len() == 2 && lengths.iter().all(|secs| (secs - 2.0).abs() < FPS.secs(1)), "{lengths:?}");
    let sound = audio::read_mono(&film, 16_000).unwrap().expect("an audio track");
    let flash = clip.flashes.iter().find(|flash| (2.1..3.8).contains(&flash.on_secs)).expect("a flash in the film");
    let onset = chirp_begins(&sound.samples, 16_000, flash.on_secs - 2.0);
    assert!((onset - (flash.on_secs - 2.0)).abs() < 0.002, "{onset}");
}

#[test]
fn the_avatar_follows_the_motion_and_is_not_cropped() {
    let motion = swinging(4, 12);
    let performance = perform(&motion, None, &AnimationOptions::default());
    let sound = Sound { rate: 16_000, samples: (0..12_800).map(|n| (n as f32 * 0.1).sin()).collect() };
    for camera in [FilmCamera::Front, FilmCamera::ThreeQuarter] {
        let mut film = Film::new(FilmSource { camera, sound: Some(&sound), ..single_panel(&performance) });
        let (first, last) = (film.frame(0).unwrap(), film.frame(11).unwrap());
        assert_eq!([first.width, first.height], SIZE);
        assert_eq!(first, film.frame(0).unwrap(), "drawing a frame again gives the same image");
        // The backdrop has one colour per row: the body reaches neither the sides nor the top.
        for image in [&first, &last] {
            assert!((0..600).all(|y| image.pixel(2, y) == image.pixel(0, y)));
            assert!((0..600).all(|y| image.pixel(1277, y) == image.pixel(0, y)));
            assert!((0..1280).all(|x| (0..12).all(|y| image.pixel(x, y) == image.pixel(0, y))));
        }
        let body_px = |image: &Image| {
            (0..1280)
                .flat_map(|x| (0..600).map(move |y| (x, y)))
                .filter(|&(x, y)| image.pixel(x, y) != image.pixel(0, y))
                .count()
        };
        assert!(body_px(&first) > 40_000, "{}", body_px(&first));
        let moved = first.data.iter().zip(&last.data).filter(|(a, b)| a.abs_diff(**b) > 30).count();
        assert!(moved > 3_000, "{moved}");
    }
}

#[test]
fn the_avatar_over_the_source_video_covers_the_person() {
    let folder = tempfile::tempdir().unwrap();
    let Some(clip) = make(folder.path(), &Kind { secs: 2.0, ..PLAIN }) else { return };
    let motion = swinging(6, 4);
    let neck = [0.05, -0.1, 2.6];
    // Pixel of a joint in an image of the given size, with a pinhole camera.
    let pixel = |t: usize, joint: usize, [width, height]: [f64; 2]| {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(motion.joints[[t, joint, k]]) + neck[k]);
        [(width - 1.0) / 2.0 + 1.2 * width * x / z, (height - 1.0) / 2.0 + 1.2 * width * y / z]
    };
    let mut body = Array3::zeros((4, 17, 3));
    let limbs = [[R_SHOULDER, 6], [R_ELBOW, 8], [R_WRIST, 10], [L_SHOULDER, 5], [L_ELBOW, 7], [L_WRIST, 9]];
    for (t, [joint, point]) in (0..4).flat_map(|t| limbs.map(|limb| (t, limb))) {
        let [x, y] = pixel(t, joint, [64.0, 48.0]);
        body.slice_mut(s![t, point, ..]).assign(&ndarray::arr1(&[x as f32, y as f32, 0.9]));
    }
    let hand = Array3::zeros((4, 21, 3));
    let keypoints =
        Keypoints { fps: FPS, image_size: [64, 48], body, left_hand: hand.clone(), right_hand: hand, hand_depth: None };
    let camera = SourceCamera::fit(&motion, &keypoints).unwrap();
    let performance = unchanged(&motion);
    let panel = SecondPanel::Video { path: &clip.path, from_secs: 0.0, camera: Some(&camera) };
    let mut film = Film::new(FilmSource { second_panel: panel, ..single_panel(&performance) });
    let mut video = FrameReader::open(&clip.path, FPS).unwrap();
    for t in 0..4 {
        let image = film.frame(t).unwrap();
        video.advance().unwrap();
        // 64 x 48 px are scaled to 826 x 620 in the centre.
        let background = video.picture(Some([826, 620])).unwrap();
        let is_body = |x: usize, y: usize| image.pixel(227 + x, y) != background.pixel(x, y);
        assert!((0..620).all(|y| !is_body(0, y) && !is_body(825, y)));
        for [joint, _] in limbs {
            let [x, y] = pixel(t, joint, [826.0, 620.0]).map(|v| v.round() as usize);
            let near = (0..17).flat_map(|dx| (0..17).map(move |dy| (x + dx - 8, y + dy - 8)));
            assert!(near.filter(|&(x, y)| is_body(x, y)).count() > 40, "frame {t}: joint {joint} at {x}, {y}");
        }
    }
}

#[test]
fn two_avatars_are_drawn_side_by_side_at_equal_size() {
    let [one, other] = [6, 7].map(|seed| perform(&swinging(seed, 10), None, &AnimationOptions::default()));
    let panel = SecondPanel::Motion { performance: &other, labels: ["truth", "prediction"] };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.mp4");
    film::write(&path, FilmSource { second_panel: panel, ..single_panel(&one) }, &Silent).unwrap();
    let frames: Vec<Image> = FrameReader::open(&path, FPS).unwrap().map(|frame| frame.unwrap().image).collect();
    assert_eq!(frames.len(), 10);
    let dark = |from: usize| {
        let all = (from..from + 600).flat_map(|x| (66..600).map(move |y| (x, y)));
        all.filter(|&(x, y)| frames[5].pixel(x, y)[0] < 120).count()
    };
    let (left, right) = (dark(30) as f64, dark(650) as f64);
    assert!(left > 5_000.0 && (left / right - 1.0).abs() < 0.4, "{left} and {right} px");
}
