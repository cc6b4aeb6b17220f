//! Keypoints of a real clip by the models that come from packages only, compared with those of the default models.

use ndarray::s;
use orator_base::types::pose2d::{Keypoints, coco};
use orator_formats::keypoints_npz;
use orator_test_support::project::{Project, files_under};
use orator_test_support::skip::{fetched_models, real_data};

/// Largest median and 95th percentile of the distance of a wrist, in fractions of the shoulder width.
const MAX_DISTANCES: [f32; 2] = [0.05, 0.2];

fn keypoints(project: &Project, set: [&str; 2]) -> Keypoints {
    let sets = [format!("pose2d.person={}", set[0]), format!("pose2d.body={}", set[1])];
    let answer = project.run(&["--to", "pose2d", "--set", "extract.fps=10", "--set", &sets[0], "--set", &sets[1]]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let found = files_under(&project.work().join("pose2d")).into_iter();
    let (_, path) = found.into_iter().find(|(name, _)| name.ends_with("keypoints.npz")).unwrap();
    keypoints_npz::read(&path).unwrap()
}

#[test]
fn package_models_agree_with_the_default_models_on_a_speaker() {
    let (Some(clip), Some(models)) = (real_data("data/videos/talk_tyson_2cam_17s_720p.mp4"), fetched_models()) else {
        return;
    };
    let project = Project::with_clips("packages", 0, 0.0);
    let text = format!("[models]\ndir = {models:?}\n[[speaker]]\nname = \"host\"\nvideos = [{clip:?}]\n");
    std::fs::write(project.dir().join("pipeline.toml"), text).unwrap();
    let default = keypoints(&project, ["person-rtmdet-nano", "body-tinypose-256x192"]);
    let packaged = keypoints(&project, ["person-nanodet", "body-movenet-thunder"]);
    let detected = |t: usize, point: usize| [&default, &packaged].iter().all(|k| k.body[[t, point, 2]] >= 0.3);
    let distance = |t: usize, a: usize, b: usize| {
        let along = |axis: usize| default.body[[t, a, axis]] - packaged.body[[t, b, axis]];
        along(0).hypot(along(1))
    };
    let (left, right) = (coco::L_SHOULDER, coco::R_SHOULDER);
    let mut distances = Vec::new();
    let mut n_swapped = 0;
    for t in (0..default.n_frames()).filter(|t| detected(*t, left) && detected(*t, right)) {
        let across = default.body.slice(s![t, left, ..2]).to_owned() - default.body.slice(s![t, right, ..2]);
        let width = across[0].hypot(across[1]);
        n_swapped += usize::from(
            distance(t, left, right) + distance(t, right, left) < distance(t, left, left) + distance(t, right, right),
        );
        let wrists = [coco::L_WRIST, coco::R_WRIST].into_iter().filter(|wrist| detected(t, *wrist));
        distances.extend(wrists.map(|wrist| distance(t, wrist, wrist) / width));
    }
    distances.sort_by(f32::total_cmp);
    let found = [distances[distances.len() / 2], distances[distances.len() * 95 / 100]];
    eprintln!(
        "wrist distances in fractions of the shoulder width: {found:?} of {}; {n_swapped} frames swapped",
        distances.len()
    );
    assert!(distances.len() > 200 && n_swapped == 0, "{} wrists, {n_swapped} frames swapped", distances.len());
    assert!(found[0] < MAX_DISTANCES[0] && found[1] < MAX_DISTANCES[1], "{found:?}");
}
