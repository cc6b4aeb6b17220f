//! A real clip through the models that come from packages alone, beside those of the default.

use ndarray::s;
use orator_base::types::pose2d::{Keypoints, coco};
use orator_formats::keypoints_npz;
use orator_test_support::project::{Project, files_under};
use orator_test_support::skip::{fetched_models, real_data};

/// Median and 95th percentile of a wrist's distance, shares of the shoulders' width.
const MOST_APART: [f32; 2] = [0.05, 0.2];

fn keypoints(project: &Project, set: [&str; 2]) -> Keypoints {
    let sets = [format!("pose2d.person={}", set[0]), format!("pose2d.body={}", set[1])];
    let answer = project.run(&["--to", "pose2d", "--set", "extract.fps=10", "--set", &sets[0], "--set", &sets[1]]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let found = files_under(&project.work().join("pose2d")).into_iter();
    let (_, path) = found.into_iter().find(|(name, _)| name.ends_with("keypoints.npz")).unwrap();
    keypoints_npz::read(&path).unwrap()
}

#[test]
fn a_speaker_is_seen_as_the_default_models_see_him() {
    let (Some(clip), Some(models)) = (real_data("data/videos/talk_tyson_2cam_17s_720p.mp4"), fetched_models()) else {
        return;
    };
    let project = Project::with_clips("packages", 0, 0.0);
    let text = format!("[models]\ndir = {models:?}\n[[speaker]]\nname = \"host\"\nvideos = [{clip:?}]\n");
    std::fs::write(project.dir().join("pipeline.toml"), text).unwrap();
    let ours = keypoints(&project, ["person-rtmdet-nano", "body-tinypose-256x192"]);
    let theirs = keypoints(&project, ["person-nanodet", "body-movenet-thunder"]);
    let seen = |t: usize, point: usize| [&ours, &theirs].iter().all(|k| k.body[[t, point, 2]] >= 0.3);
    let apart = |t: usize, a: usize, b: usize| {
        let along = |axis: usize| ours.body[[t, a, axis]] - theirs.body[[t, b, axis]];
        along(0).hypot(along(1))
    };
    let (left, right) = (coco::L_SHOULDER, coco::R_SHOULDER);
    let mut shares = Vec::new();
    let mut n_swapped = 0;
    for t in (0..ours.n_frames()).filter(|t| seen(*t, left) && seen(*t, right)) {
        let across = ours.body.slice(s![t, left, ..2]).to_owned() - ours.body.slice(s![t, right, ..2]);
        let width = across[0].hypot(across[1]);
        n_swapped +=
            usize::from(apart(t, left, right) + apart(t, right, left) < apart(t, left, left) + apart(t, right, right));
        let wrists = [coco::L_WRIST, coco::R_WRIST].into_iter().filter(|wrist| seen(t, *wrist));
        shares.extend(wrists.map(|wrist| apart(t, wrist, wrist) / width));
    }
    shares.sort_by(f32::total_cmp);
    let found = [shares[shares.len() / 2], shares[shares.len() * 95 / 100]];
    eprintln!(
        "wrists apart, shares of the shoulders' width: {found:?} of {}; {n_swapped} frames swapped",
        shares.len()
    );
    assert!(shares.len() > 200 && n_swapped == 0, "{} wrists, {n_swapped} frames swapped", shares.len());
    assert!(found[0] < MOST_APART[0] && found[1] < MOST_APART[1], "{found:?}");
}
