//! Contact sheets: number and size of the pages, deterministic output, and errors with the cause for files that do not
//! belong together.

use crate::fixtures::clips::write_sized;
use crate::fixtures::figures::{FPS, swinging};
use ndarray::{Array1, Array2, Array3, s};
use orator_base::stage::ledger::RejectedInterval;
use orator_base::stage::progress::Silent;
use orator_base::stage::rejection::{FrameRejection, Rejection};
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

/// Orthographic front view of the motion with its hands, 150 px per metre.
fn keypoints(motion: &Motion) -> Keypoints {
    let project = |points: &mut Array3<f32>, point: usize, joint: usize| {
        for t in 0..motion.n_frames() {
            let [x, y] = [0, 1].map(|axis| motion.joints[[t, joint, axis]] * 150.0);
            points.slice_mut(s![t, point, ..]).assign(&ndarray::arr1(&[x + 160.0, y + 80.0, 0.9]));
        }
    };
    let mut body = Array3::zeros((motion.n_frames(), 17, 3));
    for (point, joint) in [(5, 4), (7, 5), (9, 6), (6, 1), (8, 2), (10, 3)] {
        project(&mut body, point, joint);
    }
    let [left_hand, right_hand] = [7, 28].map(|root| {
        let mut hand = Array3::zeros((motion.n_frames(), 21, 3));
        (0..21).for_each(|point| project(&mut hand, point, root + point));
        hand
    });
    let image_size = SIZE.map(|px| px as u32);
    Keypoints { fps: motion.fps, image_size, body, left_hand, right_hand, hand_depth: None }
}

fn pages(video: &Path, keypoints: &Keypoints, motion: &Motion, every_secs: f64) -> anyhow::Result<Vec<Image>> {
    pages_with(video, keypoints, motion, every_secs, &[])
}

fn pages_with(
    video: &Path,
    keypoints: &Keypoints,
    motion: &Motion,
    every_secs: f64,
    rejected: &[RejectedInterval],
) -> anyhow::Result<Vec<Image>> {
    let (title, pictures) = ("a clip", Default::default());
    let clip = SheetClip { title, video, pictures, keypoints, motion, rejected, figure: None };
    let mut pages = Vec::new();
    clip.pages(every_secs, &Silent, |number, n_pages, page| {
        assert!(number == pages.len() && number < n_pages);
        pages.push(page.clone());
        Ok(())
    })?;
    Ok(pages)
}

#[test]
fn pages_have_ten_moments_each_and_are_deterministic() {
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
    // The reason stands in the cells without joints only.
    motion.joints.slice_mut(s![10..20, .., ..]).fill(f32::NAN);
    let why = FrameRejection::new(Rejection::HandGap, 0.7, 0.5);
    let sheet = |start: f64, end: f64| {
        pages_with(&video, &keypoints, &motion, 0.2, &[RejectedInterval::new(start, end, why)]).unwrap()
    };
    let unexplained = pages(&video, &keypoints, &motion, 0.2).unwrap();
    assert_ne!(sheet(FPS.secs(10), FPS.secs(20)), unexplained);
    assert_eq!(sheet(0.0, FPS.secs(10)), unexplained);
    let quality = quality::measure(&motion, &keypoints).unwrap();
    assert!(quality.right.wrist_off_mm < 1.0 && quality.left.missing > 0.2, "{quality:?}");
}

#[test]
fn files_that_do_not_belong_together_are_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let video = write_sized(dir.path(), "a.mp4", 60, FrameRate::new(30, 1), SIZE, None);
    let motion = swinging(1, 30);
    let points = keypoints(&motion);
    let fails = |keypoints: &Keypoints, motion: &Motion, every: f64, expected: &str| {
        let error = format!("{:#}", pages(&video, keypoints, motion, every).unwrap_err());
        assert!(error.contains(expected), "{error}");
    };
    fails(&points, &swinging(1, 29), 1.0, "29 frames, the keypoints have 30");
    fails(&keypoints(&swinging(1, 0)), &swinging(1, 0), 1.0, "no frames");
    fails(&points, &Motion { fps: FrameRate::new(25, 1), ..motion.clone() }, 1.0, "25 fps, the keypoints at 15 fps");
    let fast = FrameRate::new(60, 1);
    let (points_fast, motion_fast) =
        (Keypoints { fps: fast, ..points.clone() }, Motion { fps: fast, ..motion.clone() });
    fails(&points_fast, &motion_fast, 1.0, "expected the same clip");
    let long = swinging(1, 300);
    fails(&keypoints(&long), &long, 1.0, "20.00 s");
    for every in [0.0, -1.0, f64::NAN, f64::INFINITY, 0.01] {
        fails(&points, &motion, every, "at least 0.067 s");
    }
    let undetected = Keypoints { body: Array3::zeros((30, 17, 3)), ..points };
    assert_eq!(pages(&video, &undetected, &Motion::from_joints(FPS, motion.joints * f32::NAN), 1.0).unwrap().len(), 1);
}

#[test]
fn the_command_draws_separate_files_and_reports_missing_ones() {
    let project = Project::with_clips("sheet", 1, 2.0);
    let dir = project.dir();
    let video = write_sized(dir, "separate.mp4", 30, FPS, SIZE, None);
    let motion = swinging(2, 30);
    let extras = Extras {
        time_secs: Array1::zeros(30),
        person: Array2::zeros((30, 5)),
        n_persons: Array1::ones(30),
        identity: Array1::zeros(30),
        other_hand: Array2::from_elem((30, 2), false),
        face: None,
    };
    keypoints_npz::write(&dir.join("k.npz"), &keypoints(&motion), &extras).unwrap();
    npy::write(&dir.join("j.npy"), &motion).unwrap();
    joints_npz::write(&dir.join("j.npz"), &motion).unwrap();
    let video = video.to_string_lossy().into_owned();
    let separate = ["sheet", "--video", &video, "--keypoints", "k.npz", "--joints"];
    for joints in ["j.npy", "j.npz"] {
        let answer = project.answer(&[&separate[..], &[joints, "--out", "deep/s.png", "--every", "0.1"]].concat());
        assert_eq!(answer.code, 0, "{}", answer.errors);
        assert!(dir.join("deep/s_000.png").exists() && dir.join("deep/s_001.png").exists());
        let metrics = &answer.json["clips"][0]["metrics"];
        assert_eq!(metrics["left"]["missing_percent"], 0.0, "{metrics}");
    }
    let fails = |args: &[&str], expected: &str| {
        let answer = project.answer(args);
        assert!(answer.code == 1 && answer.errors.contains(expected), "{}", answer.errors);
    };
    fails(&["sheet"], "not lifted yet; run `orator run --to lift");
    fails(&["sheet", "--video", "nobody"], "no video is named nobody");
    fails(&[&separate[..], &["k.npz"]].concat(), "no array `pose3d`");
    fails(&[&separate[..], &["j.npy", "--out", "sheet.jpg"]].concat(), "ends in .png");
    fails(&["sheet", "--keypoints", "k.npz"], "--joints");
}
