//! Films of the avatar, with their frames and their sound; and poses drawn with missing joints.

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

/// Mean column of the pixels that are more of one hue than of the other.
fn middle(image: &Image, columns: std::ops::Range<usize>, hue: [u8; 3]) -> f64 {
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

/// Silent film of a performance alone, seen from the front.
fn alone(performance: &Performance) -> FilmSource<'_> {
    FilmSource { performance, camera: FilmCamera::Front, sound: None, second_panel: SecondPanel::Itself }
}

/// The motion on its rig, neither smoothed nor constrained.
fn unchanged(motion: &Motion) -> Performance {
    let (smoothing, constraints) = (Smoothing::None, Constraints::NONE);
    perform(motion, None, &AnimationOptions { smoothing, constraints, ..AnimationOptions::default() })
}

#[test]
fn a_drawn_pose_has_its_left_at_the_right_and_missing_or_wild_joints_are_left_out() {
    let mut motion = swinging(4, 5);
    let drawn = |motion: &Motion, frame: usize| {
        let mut image = Image::filled(SIZE[0], SIZE[1], PAPER);
        let view = FigureView::front([640.0, 250.0], 400.0);
        draw_pose(&mut image, motion.joints.index_axis(Axis(0), frame), &view).unwrap();
        image
    };
    let image = drawn(&motion, 0);
    assert!(middle(&image, 0..1280, LEFT) > middle(&image, 0..1280, RIGHT));
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
fn the_mp4_has_every_frame_and_the_sound() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("talk.mp4");
    let performance = unchanged(&swinging(6, 15));
    let samples = (0..16_000).map(|n| (n as f32 * 0.17).sin() * (n as f32 / 16_000.0)).collect();
    let sound = Sound { rate: 16_000, samples };
    film::write(&path, FilmSource { sound: Some(&sound), ..alone(&performance) }, &Silent).unwrap();
    let info = probe::probe(&path).unwrap();
    let secs = info.duration_secs.unwrap();
    assert!((secs - 15.0 / FPS.per_sec()).abs() < 0.1, "{secs} s");
    let sound = audio::read_mono(&path, 16_000).unwrap().expect("a sound track");
    assert!((sound.secs() - 1.0).abs() < 0.1);
    let frames = orator_media::ffmpeg::frames::FrameReader::open(&path, FPS).unwrap().count();
    assert_eq!(frames, 15);
}

/// Streams of a file as ffprobe (another program than ours) sees them: kind, start and duration in seconds.
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
fn a_click_at_a_second_stands_at_the_picture_of_that_second() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clicks.mp4");
    // The arms are thrown up at seconds 1, 2 and 3 and fall half a second later.
    let mut motion = swinging(6, 60);
    let still = motion.joints.slice(s![0, .., ..]).to_owned();
    for (frame, mut joints) in motion.joints.outer_iter_mut().enumerate() {
        joints.assign(&still);
        if frame >= 15 && frame % 15 < 7 {
            joints.slice_mut(s![1.., 1]).mapv_inplace(|y| -y);
        }
    }
    let rate = 16_000;
    let sample = |n: usize| (1..4).map(|k| chirp(n as f64 / f64::from(rate) - f64::from(k))).sum::<f64>() as f32;
    let sound = Sound { rate, samples: (0..4 * rate as usize).map(sample).collect() };
    let performance = unchanged(&motion);
    film::write(&path, FilmSource { sound: Some(&sound), ..alone(&performance) }, &Silent).unwrap();

    let streams = streams(&path);
    let of = |kind: &str| streams.iter().find(|stream| stream.0 == kind).unwrap_or_else(|| panic!("no {kind}"));
    let (picture, heard) = (of("video"), of("audio"));
    eprintln!("pictures {:.4} s from {:.4} s, sound {:.4} s from {:.4} s", picture.2, picture.1, heard.2, heard.1);
    assert!((picture.2 - 4.0).abs() < 1e-3 && (picture.2 - heard.2).abs() < FPS.secs(1));
    assert!((picture.1 - heard.1).abs() < 1e-3);

    let read = audio::read_mono(&path, rate).unwrap().expect("a sound track");
    let frames: Vec<Image> = FrameReader::open(&path, FPS).unwrap().map(|frame| frame.unwrap().image).collect();
    // Pixels, one in nine, that differ from the first frame's: the mouth moves few, the arms many.
    let moved = |image: &Image| {
        let places = (0..SIZE[0]).step_by(3).flat_map(|x| (0..620).step_by(3).map(move |y| (x, y)));
        places.filter(|&(x, y)| image.pixel(x, y)[0].abs_diff(frames[0].pixel(x, y)[0]) > 40).count()
    };
    let up: Vec<bool> = frames.iter().map(|image| moved(image) > 400).collect();
    for k in 1..4 {
        let shown = (15 * k - 7..15 * k + 7).find(|&n| up[n]).expect("the arms go up");
        let heard = chirp_begins(&read.samples, rate, k as f64);
        eprintln!("second {k}: shown at {:.4} s, heard at {heard:.4} s", FPS.secs(shown));
        assert_eq!(shown, 15 * k);
        assert!((heard - k as f64).abs() < 0.002, "{heard}");
    }
}

#[test]
fn the_video_beside_the_avatar_is_in_step() {
    let folder = tempfile::tempdir().unwrap();
    let Some(clip) = make(folder.path(), &Kind { secs: 6.0, ..PLAIN }) else { return };
    let path = folder.path().join("beside.mp4");
    let performance = unchanged(&swinging(6, 30));
    let beside = SecondPanel::Video { path: &clip.path, from_secs: 2.0, camera: None };
    film::write(&path, FilmSource { second_panel: beside, ..alone(&performance) }, &Silent).unwrap();
    // A picture of the clip fills the left half: 64 x 48 px become 600 x 450.
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
    let beside = SecondPanel::Video { path: &clip.path, from_secs: 60.0, camera: None };
    let late = FilmSource { second_panel: beside, ..alone(&performance) };
    let error = format!("{:#}", film::write(&path, late, &Silent).unwrap_err());
    assert!(error.contains("lasts 6.0 s"), "{error}");
}

#[test]
fn another_motion_is_drawn_beside_in_the_same_size_until_it_ends() {
    let (motion, mut other) = (swinging(6, 30), swinging(7, 20));
    other.fps = orator_base::types::time::FrameRate::new(30, 1);
    let [performance, other] = [unchanged(&motion), unchanged(&other)];
    let beside = SecondPanel::Motion { performance: &other, labels: ["truth", "prediction"] };
    let mut film = Film::new(FilmSource { second_panel: beside, ..alone(&performance) });
    let half = |image: &Image, from: usize| {
        let places = (from..from + 600).flat_map(|x| (70..610).map(move |y| (x, y)));
        places.filter(|&(x, y)| image.pixel(x, y) != PAPER).count()
    };
    // 20 frames at 30 a second end before frame 10 at 15.
    let (early, late) = (film.frame(5).unwrap(), film.frame(12).unwrap());
    assert!(half(&early, 30) > 500 && half(&early, 660) > 500);
    assert!(half(&late, 30) > 500 && half(&late, 660) == 0);
}

#[test]
fn a_film_beside_its_video_has_the_videos_sound_from_there_on() {
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
    let sound = audio::read_mono(&film, 16_000).unwrap().expect("a sound track");
    let flash = clip.flashes.iter().find(|flash| (2.1..3.8).contains(&flash.on_secs)).expect("a flash in the film");
    let heard = chirp_begins(&sound.samples, 16_000, flash.on_secs - 2.0);
    assert!((heard - (flash.on_secs - 2.0)).abs() < 0.002, "{heard}");
    let removed = orator.args(["--style", "figure"]).output().unwrap();
    let said = String::from_utf8_lossy(&removed.stderr);
    assert!(!removed.status.success() && said.contains("`orator sheet`"), "{said}");
}

#[test]
fn the_avatar_moves_with_the_motion_and_nothing_is_cut() {
    let motion = swinging(4, 12);
    let performance = perform(&motion, None, &AnimationOptions::default());
    let sound = Sound { rate: 16_000, samples: (0..12_800).map(|n| (n as f32 * 0.1).sin()).collect() };
    for camera in [FilmCamera::Front, FilmCamera::ThreeQuarter] {
        let mut film = Film::new(FilmSource { camera, sound: Some(&sound), ..alone(&performance) });
        let (first, last) = (film.frame(0).unwrap(), film.frame(11).unwrap());
        assert_eq!([first.width, first.height], SIZE);
        assert_eq!(first, film.frame(0).unwrap(), "the same frame twice is the same picture");
        // The backdrop has one colour a row; at the sides and above nothing of the body is cut.
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
fn before_its_video_the_avatar_stands_where_the_person_is() {
    let folder = tempfile::tempdir().unwrap();
    let Some(clip) = make(folder.path(), &Kind { secs: 2.0, ..PLAIN }) else { return };
    let motion = swinging(6, 4);
    let neck = [0.05, -0.1, 2.6];
    // The pixel of a joint in a picture of some size, as a plain lens shows it.
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
    let keypoints = Keypoints { fps: FPS, image_size: [64, 48], body, left_hand: hand.clone(), right_hand: hand };
    let camera = SourceCamera::fit(&motion, &keypoints).unwrap();
    let performance = unchanged(&motion);
    let beside = SecondPanel::Video { path: &clip.path, from_secs: 0.0, camera: Some(&camera) };
    let mut film = Film::new(FilmSource { second_panel: beside, ..alone(&performance) });
    let mut video = FrameReader::open(&clip.path, FPS).unwrap();
    for t in 0..4 {
        let image = film.frame(t).unwrap();
        video.advance().unwrap();
        // 64 x 48 px become 826 x 620 in the middle.
        let plain = video.picture(Some([826, 620])).unwrap();
        let is_body = |x: usize, y: usize| image.pixel(227 + x, y) != plain.pixel(x, y);
        assert!((0..620).all(|y| !is_body(0, y) && !is_body(825, y)));
        for [joint, _] in limbs {
            let [x, y] = pixel(t, joint, [826.0, 620.0]).map(|v| v.round() as usize);
            let near = (0..17).flat_map(|dx| (0..17).map(move |dy| (x + dx - 8, y + dy - 8)));
            assert!(near.filter(|&(x, y)| is_body(x, y)).count() > 40, "frame {t}: joint {joint} at {x}, {y}");
        }
    }
}

#[test]
fn two_avatars_stand_beside_each_other_in_one_size() {
    let [one, other] = [6, 7].map(|seed| perform(&swinging(seed, 10), None, &AnimationOptions::default()));
    let beside = SecondPanel::Motion { performance: &other, labels: ["truth", "prediction"] };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.mp4");
    film::write(&path, FilmSource { second_panel: beside, ..alone(&one) }, &Silent).unwrap();
    let frames: Vec<Image> = FrameReader::open(&path, FPS).unwrap().map(|frame| frame.unwrap().image).collect();
    assert_eq!(frames.len(), 10);
    let dark = |from: usize| {
        let all = (from..from + 600).flat_map(|x| (66..600).map(move |y| (x, y)));
        all.filter(|&(x, y)| frames[5].pixel(x, y)[0] < 120).count()
    };
    let (left, right) = (dark(30) as f64, dark(650) as f64);
    assert!(left > 5_000.0 && (left / right - 1.0).abs() < 0.4, "{left} and {right} px");
}
