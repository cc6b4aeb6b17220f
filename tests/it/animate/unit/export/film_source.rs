//! Tests of `orator_avatar::animate::export::film_source`.

use ndarray::Array3;
use orator_avatar::animate::export::film_source::{FOCAL_RATIO, PAIRS, SourceCamera};
use orator_base::math::vec3::add;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_ELBOW, L_SHOULDER, L_WRIST, N_JOINTS, R_ELBOW, R_SHOULDER, R_WRIST};
use orator_base::types::time::FrameRate;

#[test]
fn a_walking_body_projects_onto_its_keypoints_and_gaps_are_bridged() {
    let (n, size) = (12, [640u32, 360]);
    let focal_px = FOCAL_RATIO * 640.0;
    let place = |t: usize| [0.004 * t as f64 - 0.1, 0.05, 1.4];
    let joint = |j: usize, t: usize| {
        let side = if [L_SHOULDER, L_ELBOW, L_WRIST].contains(&j) { 1.0 } else { -1.0 };
        let row = [[L_SHOULDER, R_SHOULDER], [L_ELBOW, R_ELBOW], [L_WRIST, R_WRIST]];
        let part = row.iter().position(|pair| pair.contains(&j)).unwrap() as f64;
        [side * (0.18 + 0.05 * part), 0.05 + 0.2 * part, -0.15 * part * (1.0 + 0.03 * t as f64)]
    };
    let (mut joints, mut body) = (Array3::zeros((n, N_JOINTS, 3)), Array3::zeros((n, 17, 3)));
    for t in 0..n {
        for [j, point] in PAIRS {
            let (at, neck) = (joint(j, t), place(t));
            (0..3).for_each(|k| joints[[t, j, k]] = at[k] as f32);
            let per_metre = focal_px / (at[2] + neck[2]);
            body[[t, point, 0]] = (319.5 + per_metre * (at[0] + neck[0])) as f32;
            body[[t, point, 1]] = (179.5 + per_metre * (at[1] + neck[1])) as f32;
            body[[t, point, 2]] = if (5..8).contains(&t) { 0.0 } else { 0.9 };
        }
    }
    let fps = FrameRate::new(10, 1);
    let motion = Motion::from_joints(fps, joints);
    let none = Array3::zeros((n, 21, 3));
    let keypoints =
        Keypoints { fps, image_size: size, body, left_hand: none.clone(), right_hand: none, hand_depth: None };
    let camera = SourceCamera::fit(&motion, &keypoints).unwrap();
    let neck = [3.0, 140.0, 2.0];
    for t in 1..n - 1 {
        let view = camera.at(fps.secs(t), neck, [640, 360]);
        for [j, point] in PAIRS {
            let [x, y, z] = joint(j, t).map(|v| 100.0 * v);
            let px = view.pixel(view.to_camera_axes(add(neck, [x, -y, -z])));
            let known = [0, 1].map(|k| f64::from(keypoints.body[[t, point, k]]));
            assert!((px[0] - known[0]).hypot(px[1] - known[1]) < 3.0, "frame {t}: {px:?} for {known:?}");
        }
    }
    let mut undetected = keypoints.clone();
    undetected.body.fill(0.0);
    let error = SourceCamera::fit(&motion, &undetected).unwrap_err().to_string();
    assert!(error.contains("cannot estimate the camera of the video"), "{error}");
}
