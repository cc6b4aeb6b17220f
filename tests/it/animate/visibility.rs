//! Motion of a video: everything visible is lifted, limbs that are not visible are marked in films and files, and
//! fingers with many impossible angles are reported.

use super::animate_verb::done;
use crate::fixtures::figures::swinging;
use ndarray::s;
use orator_avatar::animate::export::film::{Film, FilmSource, SIZE, SecondPanel};
use orator_avatar::animate::export::film_avatar::FilmCamera;
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::stage::workdir;
use orator_base::types::image::Image;
use orator_base::types::skeleton::{L_HAND, L_WRIST, R_ELBOW, R_HAND, R_WRIST};
use orator_formats::joints_npz;
use orator_test_support::project::Project;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of red pixels below the waveform.
fn red_pixels(image: &Image) -> usize {
    let pixels = (685..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    pixels.map(|(x, y)| image.pixel(x, y)).filter(|rgb| i32::from(rgb[0]) - i32::from(rgb[2]) > 60).count()
}

#[test]
fn limbs_that_are_not_visible_are_marked_in_film_and_files() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let mut motion = swinging(1, 40);
    motion.mask.slice_mut(s![10..20, R_HAND + 1..]).fill(false);
    motion.mask.slice_mut(s![30.., R_ELBOW]).fill(false);
    joints_npz::write(&dir.join("a.npz"), &motion).unwrap();
    done(dir, "a.npz --out b.npz b.json");
    assert_eq!(joints_npz::read(&dir.join("b.npz")).unwrap().mask, motion.mask);
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(dir.join("b.json")).unwrap()).unwrap();
    assert_eq!(json["hidden"], serde_json::json!({ "right arm": [[30, 40]], "right hand": [[10, 20]] }));
    // At twice the rate there are twice as many frames.
    done(dir, "a.npz --out c.json --fps 30");
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(dir.join("c.json")).unwrap()).unwrap();
    assert_eq!(json["hidden"]["right hand"], serde_json::json!([[20, 40]]));

    let performance = perform(&motion, None, &AnimationOptions::default());
    let (camera, second_panel) = (FilmCamera::Front, SecondPanel::Itself);
    let mut film = Film::new(FilmSource { performance: &performance, camera, sound: None, second_panel });
    let red = [5, 15, 35].map(|frame| red_pixels(&film.frame(frame).unwrap()));
    assert!(red[0] > 100 && red[1] > red[0] + 50 && red[2] > red[0] + 50, "{red:?}: times, and names of limbs");
    motion.mask.fill(true);
    let performance = perform(&motion, None, &AnimationOptions::default());
    let mut film = Film::new(FilmSource { performance: &performance, camera, sound: None, second_panel });
    assert_eq!(red_pixels(&film.frame(5).unwrap()), 0);
}

#[test]
fn fingers_with_impossible_angles_are_unusable() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let mut motion = swinging(1, 30);
    // Fingers in the direction of the forearm.
    for (root, wrist) in [(L_HAND, L_WRIST), (R_HAND, R_WRIST)] {
        for (t, joint, k) in (0..30).flat_map(|t| (1..21).flat_map(move |joint| (0..3).map(move |k| (t, joint, k)))) {
            let forearm = motion.joints[[t, wrist, k]] - motion.joints[[t, wrist - 1, k]];
            let share = 0.3 + 0.12 * ((joint - 1) % 4) as f32;
            motion.joints[[t, root + joint, k]] = motion.joints[[t, root, k]] + share * forearm;
        }
    }
    joints_npz::write(&dir.join("good.npz"), &motion).unwrap();
    let report = &done(dir, "good.npz --out a.json")["report"];
    assert_eq!(report["fingers_unusable"], false, "{report}");
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for root in [L_HAND, R_HAND] {
        motion.joints.slice_mut(s![.., root + 1..root + 21, ..]).mapv_inplace(|v| v + rng.random_range(-0.05f32..0.05));
    }
    joints_npz::write(&dir.join("bad.npz"), &motion).unwrap();
    let report = &done(dir, "bad.npz --out b.json")["report"];
    assert!(report["fingers_unusable"] == true && report["finger_clamps"].as_f64().unwrap() > 0.25, "{report}");
    assert!(std::fs::read_to_string(dir.join("b.json")).unwrap().contains("\"fingers_unusable\":true"));
}

#[test]
fn a_video_is_animated_and_lifted_where_the_speaker_is_visible() {
    // Shorter than the shortest interval that is fit for training.
    let project = Project::with_clips("visible", 1, 3.0);
    let video = "videos/host/clip-1.mp4";
    let answer = project.answer(&["animate", video, "--out", "film.mp4", "talk.npz"]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let n_frames = answer.json["n_frames"].as_u64().unwrap();
    let detected = &answer.json["report"]["detected"];
    assert!((44..=46).contains(&n_frames) && answer.json["film_has_sound"] == true, "{}", answer.json);
    assert!(10 * detected["left_arm"].as_u64().unwrap() >= 8 * n_frames, "{detected}");
    assert_eq!(answer.json["next"], "orator animate videos/host/clip-1.mp4 --out film.bvh");
    assert!(project.dir().join("film.mp4").is_file());
    let lifted = project.answer(&["lift", video, "--out", "joints.npz"]);
    assert_eq!(lifted.code, 0, "{}", lifted.errors);
    assert!(lifted.json["arms"].as_f64().unwrap() > 0.9, "{}", lifted.json);
    assert_eq!(joints_npz::read(&project.dir().join("joints.npz")).unwrap().n_frames() as u64, n_frames);
    // While another process holds the work folder, detected keypoints are used.
    let held = workdir::lock(&project.work()).unwrap();
    assert_eq!(project.answer(&["lift", video, "--out", "again.npz"]).code, 0);
    drop(held);
    // The project's own results are used, and a run accepts nothing of this video.
    let folders = |speaker: &str| std::fs::read_dir(project.work().join("pose2d").join(speaker)).into_iter().flatten();
    assert_eq!((folders("host").count() > 0, folders("video").count()), (true, 0));
    project.run(&["--to", "lift"]);
    let budget = project.answer(&["status"]).json["time_budget"][0].clone();
    assert_eq!(budget["accepted_secs"].as_f64(), Some(0.0), "{budget}");
    // A video that the project does not list.
    std::fs::copy(project.dir().join(video), project.dir().join("other.mp4")).unwrap();
    assert_eq!(project.answer(&["lift", "other.mp4", "--out", "other.npy"]).code, 0);
    assert!(folders("video").count() > 0);
    let wrong = project.answer(&["lift", video, "--out", "x.npz", "--input-fps", "30"]);
    assert!(wrong.code == 1 && wrong.errors.contains("is a video: --input-fps and --size"), "{}", wrong.errors);
    let wrong = project.answer(&["animate", video, "--out", video]);
    assert!(wrong.code == 1 && wrong.errors.contains("is an input"), "{}", wrong.errors);
}
