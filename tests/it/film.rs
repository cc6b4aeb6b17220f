//! The drawn figure: left is left, everything fits, gaps do no harm, and the mp4 has its frames and its sound.

use crate::figures::{FPS, swinging};
use ndarray::s;
use orator::animate::draw::{LEFT, PAPER, RIGHT};
use orator::animate::video::{self, Film, SIZE};
use orator::media::{audio, probe};
use orator::stage::progress::Silent;
use orator::types::{image::Image, sound::Sound};

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

#[test]
fn the_speakers_left_is_at_the_right_of_the_front_view_and_nothing_is_cut() {
    let motion = swinging(4, 20);
    let film = Film::new(&motion, None);
    for frame in [0, 7, 19] {
        let image = film.frame(frame).unwrap();
        assert_eq!([image.width, image.height], SIZE);
        assert!(middle(&image, 0..850, LEFT) > middle(&image, 0..850, RIGHT));
        assert!((0..SIZE[0]).all(|x| image.pixel(x, 0) == PAPER && image.pixel(x, SIZE[1] - 1) == PAPER));
        assert!((0..SIZE[1]).all(|y| image.pixel(0, y) == PAPER && image.pixel(SIZE[0] - 1, y) == PAPER));
        assert_eq!(image, film.frame(frame).unwrap(), "the same frame twice is the same picture");
    }
}

#[test]
fn missing_joints_and_wild_ones_are_left_out() {
    let mut motion = swinging(4, 4);
    motion.joints.slice_mut(s![0, 7.., ..]).fill(f32::NAN);
    motion.joints.slice_mut(s![1, .., ..]).fill(f32::NAN);
    motion.joints.slice_mut(s![2, 3, ..]).fill(1e30);
    motion.joints.slice_mut(s![3, .., ..]).fill(0.0);
    let film = Film::new(&motion, Some(&Sound { rate: 16_000, samples: vec![] }));
    let blank = film.frame(1).unwrap();
    for frame in 0..4 {
        assert!(frame == 1 || film.frame(frame).unwrap() != blank);
    }
}

#[test]
fn the_mp4_has_every_frame_and_the_sound() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("talk.mp4");
    let motion = swinging(6, 15);
    let samples = (0..16_000).map(|n| (n as f32 * 0.17).sin() * (n as f32 / 16_000.0)).collect();
    video::write(&path, &motion, Some(&Sound { rate: 16_000, samples }), &Silent).unwrap();
    let info = probe::probe(&path).unwrap();
    let secs = info.duration_secs.unwrap();
    assert!((secs - 15.0 / FPS.per_sec()).abs() < 0.1, "{secs} s");
    let sound = audio::read_mono(&path, 16_000).unwrap().expect("a sound track");
    assert!((sound.secs() - 1.0).abs() < 0.1);
    let frames = orator::media::frames::FrameReader::open(&path, FPS).unwrap().count();
    assert_eq!(frames, 15);
}
