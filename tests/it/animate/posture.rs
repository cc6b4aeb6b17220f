//! Trunk, head and legs: a known posture is applied to the rig and estimated again from keypoints, joints keep their
//! positions relative to the neck, and feet stay on the floor.

use crate::fixtures::animation::bvh::Bvh;
use crate::fixtures::figures::swinging;
use ndarray::{Array2, Array3};
use orator_avatar::animate::{AnimationOptions, Constraints, Legs, Performance, Smoothing, perform};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, dot, norm, scale, sub, unit};
use orator_base::motion::posture;
use orator_base::motion::posture::LiftedBody;
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;

const N_FRAMES: usize = 90;
const UNTOUCHED: AnimationOptions = AnimationOptions {
    smoothing: Smoothing::None,
    constraints: Constraints::NONE,
    yaw: orator_avatar::animate::Yaw::Spine,
    legs: Legs::Standing,
    breath: false,
    fps: None,
};

/// Oscillation about zero: trunk lean of 14 degrees, trunk roll of 8, head yaw of 50.
fn swaying() -> Posture {
    let wave = |t: usize, rate: f64, degrees: f64| (degrees.to_radians() * (rate * t as f64).sin()) as f32;
    let columns = |rates: [f64; 3], degrees: [f64; 3]| {
        Array2::from_shape_fn((N_FRAMES, 3), |(t, k)| wave(t, rates[k], degrees[k]))
    };
    Posture {
        head: columns([0.07, 0.11, 0.05], [50.0, 12.0, 10.0]),
        trunk: columns([0.0, 0.09, 0.13], [0.0, 14.0, 8.0]),
    }
}

fn performed(legs: Legs, posture: Option<&Posture>) -> Performance {
    perform(&swinging(3, N_FRAMES), posture, &AnimationOptions { legs, ..UNTOUCHED })
}

fn find(performance: &Performance, name: &str) -> usize {
    performance.rig.skeleton.find(name).expect("a joint of the rig")
}

fn max_difference_mm(a: &Motion, b: &Motion) -> f64 {
    let difference = (&a.joints - &b.joints).mapv(|v| f64::from(v.abs()));
    1_000.0 * difference.iter().copied().fold(0.0, f64::max)
}

#[test]
fn the_trunk_follows_the_posture_and_joints_stay_relative_to_the_neck() {
    let posture = swaying();
    for legs in [Legs::Standing, Legs::Seated, Legs::None] {
        let (plain, turned) = (performed(legs, None), performed(legs, Some(&posture)));
        let distance = max_difference_mm(&plain.motion(), &turned.motion());
        assert!(distance < 0.1, "{legs:?}: {distance} mm");
        let [after, before] = [&turned, &plain].map(|performance| {
            let world = |t: usize| performance.rig.skeleton.world(&performance.clip.local[t]);
            (0..N_FRAMES).map(world).collect::<Vec<_>>()
        });
        for t in 0..N_FRAMES {
            let positions = turned.clip.positions(t);
            let line = sub(positions[turned.rig.neck], positions[0]);
            // In the axes of the chest, whose yaw comes from the joints.
            let [x, y, z] = before[t][turned.rig.chest].inverse().turn(line);
            let found = [z.atan2(y), -(x / norm(line)).asin()];
            for (k, found) in found.into_iter().enumerate() {
                let error = (found - f64::from(posture.trunk[[t, k + 1]])).to_degrees().abs();
                assert!(error < 0.6, "{legs:?}, frame {t}, angle {k}: {error} degrees");
            }
            let [yaw, pitch, roll] = after[t][turned.rig.head].euler([1, 0, 2]);
            let head = [yaw, pitch, roll];
            for k in 0..3 {
                assert!((head[k] - f64::from(posture.head[[t, k]])).abs() < 0.02, "frame {t}: {head:?}");
            }
        }
    }
}

#[test]
fn feet_do_not_slide_at_any_rate_and_hips_stay_above_them() {
    let posture = swaying();
    for legs in [Legs::Standing, Legs::Seated] {
        for fps in [None, Some(FrameRate::new(60, 1))] {
            let motion = swinging(3, N_FRAMES);
            let performance = perform(&motion, Some(&posture), &AnimationOptions { legs, fps, ..UNTOUCHED });
            let bvh = Bvh::parse(&performance.clip.to_bvh());
            let frames: Vec<Vec<Vec3>> = (0..bvh.frames.len()).map(|frame| bvh.places(frame)).collect();
            let joint = |name: &str| bvh.names.iter().position(|known| known == name).expect("a joint of the file");
            for foot in ["LeftFoot", "LeftFootEnd", "RightFoot", "RightFootEnd"].map(joint) {
                let shift =
                    frames.iter().map(|positions| norm(sub(positions[foot], frames[0][foot]))).fold(0.0, f64::max);
                assert!(shift < 0.05, "{legs:?} {fps:?}: {foot} slid by {shift} cm");
            }
            let [left, right] = ["LeftFoot", "RightFoot"].map(joint);
            let hip_offsets = frames.iter().map(|positions| {
                let centre = scale(add(positions[left], positions[right]), 0.5);
                (positions[0][0] - centre[0]).abs()
            });
            assert!(hip_offsets.fold(0.0, f64::max) < 5.0, "the hips are above the feet");
            let moved = frames.iter().map(|positions| norm(sub(positions[0], frames[0][0]))).fold(0.0, f64::max);
            assert!(if legs == Legs::Standing { moved > 0.5 } else { moved < 1e-6 }, "{legs:?}: {moved} cm");
        }
    }
}

#[test]
fn a_seated_rig_has_right_angles_at_hips_and_knees() {
    let performance = performed(Legs::Seated, None);
    let positions = performance.clip.positions(10);
    let position = |name: &str| positions[find(&performance, name)];
    for side in ["Left", "Right"] {
        let [hip, knee, ankle] = ["UpLeg", "Leg", "Foot"].map(|part| position(&format!("{side}{part}")));
        let [thigh, shin] = [sub(knee, hip), sub(ankle, knee)].map(|bone| unit(bone, 1e-6).unwrap());
        let angle = dot(thigh, shin).acos().to_degrees();
        assert!((angle - 90.0).abs() < 3.0 && thigh[1].abs() < 0.05, "{side}: {angle} degrees, thigh {thigh:?}");
    }
    let soles = positions.iter().map(|position| position[1]).fold(f64::MAX, f64::min);
    assert!(soles.abs() < 0.1, "the feet are on the floor: {soles} cm");
}

#[test]
fn without_posture_standing_legs_give_the_same_bytes_as_no_legs() {
    let [standing, none] = [Legs::Standing, Legs::None].map(|legs| performed(legs, None).clip.to_bvh());
    assert_eq!(standing, none);
}

#[test]
fn breathing_moves_the_chest_but_no_joint_relative_to_the_neck() {
    let motion = swinging(1, 150);
    let [plain, breathing] =
        [false, true].map(|breath| perform(&motion, None, &AnimationOptions { breath, ..UNTOUCHED }));
    assert!(max_difference_mm(&plain.motion(), &breathing.motion()) < 0.01);
    let displacement = |t: usize| {
        let [a, b] = [&plain, &breathing].map(|one| one.clip.positions(t)[one.rig.neck]);
        10.0 * norm(sub(a, b))
    };
    let largest = (0..150).map(displacement).fold(0.0, f64::max);
    assert!((2.0..4.0).contains(&largest), "{largest} mm");
    assert!((1..150).all(|t| (displacement(t) - displacement(t - 1)).abs() < 0.5), "the chest moves slowly");
    let hips = |performance: &Performance| performance.clip.local.iter().all(|local| local[0] == Rotation::IDENTITY);
    assert!(hips(&breathing) && breathing.clip.travel.is_empty(), "hips and legs rest");
}

/// Keypoints [T, 17, 3], joints and extra points (nose, right hip, left hip) of a performance, with a level camera.
fn observed(performance: &Performance) -> (Array3<f32>, Array3<f32>, Array3<f32>) {
    // Face points in the axes of the head, cm, and the joints of the other keypoints in the order of COCO.
    let face = [[0.0, 1.1, 10.8], [4.1, 2.1, 6.8], [-4.1, 2.1, 6.8], [9.2, 0.0, 0.0], [-9.2, 0.0, 0.0]];
    let body =
        ["LeftArm", "RightArm", "LeftForeArm", "RightForeArm", "LeftHand", "RightHand", "LeftUpLeg", "RightUpLeg"];
    let body = body.into_iter().chain(["LeftLeg", "RightLeg", "LeftFoot", "RightFoot"]);
    let body: Vec<usize> = body.map(|name| find(performance, name)).collect();
    let n_frames = performance.clip.n_frames();
    let (mut keypoints, mut extra) = (Array3::zeros((n_frames, 17, 3)), Array3::zeros((n_frames, 3, 3)));
    for t in 0..n_frames {
        let positions = performance.clip.positions(t);
        let head: Rotation = performance.rig.skeleton.world(&performance.clip.local[t])[performance.rig.head];
        let points = face.map(|point| add(positions[performance.rig.head], head.turn(point)));
        let points = points.into_iter().chain(body.iter().map(|&joint| positions[joint]));
        for (point, [x, y, _]) in points.enumerate() {
            let row = [(640.0 + 4.0 * x) as f32, (900.0 - 4.0 * y) as f32, 0.95];
            (0..3).for_each(|k| keypoints[[t, point, k]] = row[k]);
        }
        let neck = positions[performance.rig.neck];
        for (row, name) in [(1, "RightUpLeg"), (2, "LeftUpLeg")] {
            let [x, y, z] = scale(sub(positions[find(performance, name)], neck), 0.01);
            [x, -y, -z].into_iter().enumerate().for_each(|(k, v)| extra[[t, row, k]] = v as f32);
        }
    }
    (keypoints, performance.motion().joints, extra)
}

#[test]
fn a_known_posture_is_estimated_from_keypoints_joints_and_hips() {
    let truth = swaying();
    for legs in [Legs::Standing, Legs::Seated] {
        let performance = performed(legs, Some(&truth));
        let (body, joints, extra) = observed(&performance);
        assert_eq!(joints.shape(), [N_FRAMES, N_JOINTS, 3]);
        assert_eq!(posture::is_seated(body.view()), Some(legs == Legs::Seated));
        let lifted = LiftedBody { joints: Some(joints.view()), extra: Some(extra.view()) };
        let found = posture::estimate(body.view(), lifted);
        let from_2d = posture::estimate(body.view(), LiftedBody::default());
        let median = |angles: &Array2<f32>, k: usize| {
            let mut column: Vec<f32> = angles.column(k).to_vec();
            column.sort_by(f32::total_cmp);
            column[column.len() / 2]
        };
        // Angles are compared relative to the median of the clip, as estimates have no absolute level.
        let error = |found: &Array2<f32>, truth: &Array2<f32>, k: usize| {
            let level = median(found, k) - median(truth, k);
            let errors = (0..N_FRAMES).map(|t| (found[[t, k]] - truth[[t, k]] - level).abs().to_degrees());
            errors.fold(0.0, f32::max)
        };
        assert!(error(&found.trunk, &truth.trunk, 1) < 2.0 && error(&found.trunk, &truth.trunk, 2) < 2.0);
        assert!(error(&from_2d.trunk, &truth.trunk, 2) < 4.0, "{}", error(&from_2d.trunk, &truth.trunk, 2));
        assert!(from_2d.trunk.column(1).iter().all(|lean| lean.is_nan()), "2D points give no lean");
        for k in 0..3 {
            assert!(error(&found.head, &truth.head, k) < 8.0, "{k}: {}", error(&found.head, &truth.head, k));
        }
        let again = perform(&swinging(3, N_FRAMES), Some(&found), &AnimationOptions { legs, ..UNTOUCHED });
        assert!(max_difference_mm(&again.motion(), &performance.motion()) < 0.1);
    }
}

#[test]
fn no_posture_is_estimated_without_visible_keypoints() {
    let body = Array3::zeros((20, 17, 3));
    assert_eq!(posture::is_seated(body.view()), None);
    let found = posture::estimate(body.view(), LiftedBody::default());
    assert!(found.head.iter().chain(&found.trunk).all(|angle| angle.is_nan()));
    let empty = Array3::zeros((0, 17, 3));
    assert_eq!(posture::estimate(empty.view(), LiftedBody::default()).head.shape(), [0, 3]);
}
