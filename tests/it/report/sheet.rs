//! Contact sheets: a page holds what it should, the same again is the same, and files that do not belong together are
//! refused with the reason.

use crate::fixtures::clips::write_sized;
use crate::fixtures::figures::{FPS, swinging};
use ndarray::{Array1, Array2, Array3, s};
use orator_base::stage::progress::Silent;
use orator_base::types::image::Image;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use orator_formats::keypoints_npz;
use orator_formats::keypoints_npz::Extras;
use orator_formats::{joints_npz, npy};
use orator_pipeline::lift::quality;
use orator_report::sheet::sheet::SheetClip;
use orator_test_support::project::Project;
use std::path::Path;

const SIZE: [usize; 2] = [320, 240];

/// Keypoints of the motion seen from the front, 150 px a metre, hands as they are.
fn keypoints(motion: &Motion) -> Keypoints {
    let see = |points: &mut Array3<f32>, point: usize, joint: usize| {
        for t in 0..motion.n_frames() {
            let [x, y] = [0, 1].map(|axis| motion.joints[[t, joint, axis]] * 150.0);
            points.slice_mut(s![t, point, ..]).assign(&ndarray::arr1(&[x + 160.0, y + 80.0, 0.9]));
        }
    };
    let mut body = Array3::zeros((motion.n_frames(), 17, 3));
    for (point, joint) in [(5, 4), (7, 5), (9, 6), (6, 1), (8, 2), (10, 3)] {
        see(&mut body, point, joint);
    }
    let [left_hand, right_hand] = [7, 28].map(|root| {
        let mut hand = Array3::zeros((motion.n_frames(), 21, 3));
        (0..21).for_each(|point| see(&mut hand, point, root + point));
        hand
    });
    let image_size = SIZE.map(|px| px as u32);
    Keypoints { fps: motion.fps, image_size, body, left_hand, right_hand }
}

fn pages(video: &Path, keypoints: &Keypoints, motion: &Motion, every_secs: f64) -> anyhow::Result<Vec<Image>> {
    let clip = SheetClip { title: "a clip", video, pictures: Default::default(), keypoints, motion, figure: None };
    let mut pages = Vec::new();
    clip.pages(every_secs, &Silent, |number, n_pages, page| {
        assert!(number == pages.len() && number < n_pages);
        pages.push(page.clone());
        Ok(())
    })?;
    Ok(pages)
}

#[test]
fn pages_hold_ten_moments_each_and_repeat_to_the_byte() {
    let dir = tempfile::tempdir().unwrap();
    let video = write_sized(dir.path(), "a.mp4", 75, FrameRate::new(30, 1), SIZE, None);
    let mut motion = swinging(3, 38);
    motion.joints.slice_mut(s![10..20, 4.., ..]).fill(f32::NAN);
    motion.mask.slice_mut(s![10..20, 4..]).fill(false);
    let keypoints = keypoints(&swinging(3, 38));
    let drawn = pages(&video, &keypoints, &motion, 0.2).unwrap();
    assert_eq!(drawn.len(), 2, "13 moments");
    assert_eq!(drawn[0].width, drawn[1].width);
    assert!(drawn[0].height > drawn[1].height && drawn[0].width <= 2400);
    assert_eq!(drawn, pages(&video, &keypoints, &motion, 0.2).unwrap());
    assert_eq!(pages(&video, &keypoints, &motion, 60.0).unwrap().len(), 1);
    let figures = quality::measure(&motion, &keypoints).unwrap();
    assert!(figures.right.wrist_off_mm < 1.0 && figures.left.missing > 0.2, "{figures:?}");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let video = write_sized(dir.path(), "a.mp4", 60, FrameRate::new(30, 1), SIZE, None);
    let motion = swinging(1, 30);
    let seen = keypoints(&motion);
    let says = |keypoints: &Keypoints, motion: &Motion, every: f64, words: &str| {
        let error = format!("{:#}", pages(&video, keypoints, motion, every).unwrap_err());
        assert!(error.contains(words), "{error}");
    };
    says(&seen, &swinging(1, 29), 1.0, "29 frames, the keypoints have 30");
    says(&keypoints(&swinging(1, 0)), &swinging(1, 0), 1.0, "no frames");
    says(&seen, &Motion { fps: FrameRate::new(25, 1), ..motion.clone() }, 1.0, "25 fps, the keypoints at 15 fps");
    let fast = FrameRate::new(60, 1);
    let (seen_fast, motion_fast) = (Keypoints { fps: fast, ..seen.clone() }, Motion { fps: fast, ..motion.clone() });
    says(&seen_fast, &motion_fast, 1.0, "expected the same clip");
    let long = swinging(1, 300);
    says(&keypoints(&long), &long, 1.0, "20.00 s");
    for every in [0.0, -1.0, f64::NAN, f64::INFINITY, 0.01] {
        says(&seen, &motion, every, "at least 0.067 s");
    }
    let nothing = Keypoints { body: Array3::zeros((30, 17, 3)), ..seen };
    assert_eq!(pages(&video, &nothing, &Motion::from_joints(FPS, motion.joints * f32::NAN), 1.0).unwrap().len(), 1);
}

#[test]
fn the_verb_draws_loose_files_and_says_what_is_missing() {
    let project = Project::with_clips("sheet", 1, 2.0);
    let dir = project.dir();
    let video = write_sized(dir, "loose.mp4", 30, FPS, SIZE, None);
    let motion = swinging(2, 30);
    let extras = Extras {
        time_secs: Array1::zeros(30),
        person: Array2::zeros((30, 5)),
        n_people: Array1::ones(30),
        identity: Array1::zeros(30),
        other_hand: Array2::from_elem((30, 2), false),
        face: None,
    };
    keypoints_npz::write(&dir.join("k.npz"), &keypoints(&motion), &extras).unwrap();
    npy::write(&dir.join("j.npy"), &motion).unwrap();
    joints_npz::write(&dir.join("j.npz"), &motion).unwrap();
    let video = video.to_string_lossy().into_owned();
    let loose = ["sheet", "--video", &video, "--keypoints", "k.npz", "--joints"];
    for joints in ["j.npy", "j.npz"] {
        let answer = project.answer(&[&loose[..], &[joints, "--out", "deep/s.png", "--every", "0.1"]].concat());
        assert_eq!(answer.code, 0, "{}", answer.errors);
        assert!(dir.join("deep/s_000.png").exists() && dir.join("deep/s_001.png").exists());
        let metrics = &answer.json["clips"][0]["metrics"];
        assert_eq!(metrics["left"]["missing_percent"], 0.0, "{metrics}");
    }
    let fails = |args: &[&str], words: &str| {
        let answer = project.answer(args);
        assert!(answer.code == 1 && answer.errors.contains(words), "{}", answer.errors);
    };
    fails(&["sheet"], "not lifted yet; run `orator run --to lift");
    fails(&["sheet", "--video", "nobody"], "no video is named nobody");
    fails(&[&loose[..], &["k.npz"]].concat(), "no array `pose3d`");
    fails(&[&loose[..], &["j.npy", "--out", "sheet.jpg"]].concat(), "ends in .png");
    fails(&["sheet", "--keypoints", "k.npz"], "--joints");
}
