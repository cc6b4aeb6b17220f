//! The view of a body from which the lifter works: position, size, sides, hidden points.

use orator_base::motion::upper_body::{
    BodyPoints, HandDirections, L_WRIST, MIRROR, N_POINTS, R_HIP, R_SHOULDER, R_WRIST,
};
use orator_base::motion::view::body::{BodyView, N_BODY_IN, N_OUT, mirror_mean};

const WINDOW: usize = 27;

fn middle_view(frames: &[BodyPoints]) -> Option<BodyView> {
    BodyView::around(frames, &[], frames.len() / 2, WINDOW, 1.0)
}

fn frame(shift: f32) -> BodyPoints {
    let xs: [f32; N_POINTS] = [0.0, -50.0, -55.0, -40.0, 50.0, 55.0, 40.0, -30.0, 30.0];
    let ys: [f32; N_POINTS] = [-40.0, 0.0, 60.0, 110.0, 0.0, 60.0, 110.0, 120.0, 120.0];
    std::array::from_fn(|j| Some([xs[j] + 300.0 + shift, ys[j] + 200.0]))
}

#[test]
fn the_view_is_independent_of_position_and_size() {
    let frames: Vec<BodyPoints> = (0..WINDOW).map(|t| frame(t as f32)).collect();
    let twice: Vec<BodyPoints> =
        frames.iter().map(|f| f.map(|p| p.map(|[x, y]| [2.0 * x + 7.0, 2.0 * y - 9.0]))).collect();
    let (a, b) = (middle_view(&frames).unwrap(), middle_view(&twice).unwrap());
    assert_eq!((a.scale, b.scale), (100.0, 200.0));
    assert!(a.numbers.iter().zip(&b.numbers).all(|(x, y)| (x - y).abs() < 1e-5));
    assert_eq!(a.middle(R_SHOULDER), [-0.5, 0.0]);
    let pose = a.pose(&[0.0; N_OUT]);
    assert!((pose[L_WRIST][0] - 40.0).abs() < 1e-3 && (pose[L_WRIST][1] - 110.0).abs() < 1e-3);
}

#[test]
fn mirroring_swaps_the_sides() {
    let frames: Vec<BodyPoints> = (0..WINDOW).map(|t| frame(3.0 * t as f32)).collect();
    let flipped: Vec<BodyPoints> = frames.iter().map(|f| MIRROR.map(|j| f[j].map(|[x, y]| [900.0 - x, y]))).collect();
    let (a, b) = (middle_view(&frames).unwrap(), middle_view(&flipped).unwrap());
    assert!(a.mirrored().numbers.iter().zip(&b.numbers).all(|(x, y)| (x - y).abs() < 1e-5));
    let output: Vec<f32> = (0..N_OUT).map(|i| (i * i) as f32).collect();
    let mirrored: Vec<f32> =
        MIRROR.iter().flat_map(|&j| [-output[3 * j], output[3 * j + 1], output[3 * j + 2]]).collect();
    assert_eq!(mirror_mean(&output, &mirrored), output);
}

#[test]
fn hands_follow_the_points_and_are_mirrored() {
    let frames: Vec<BodyPoints> = (0..WINDOW).map(|t| frame(t as f32)).collect();
    let mut hands: Vec<HandDirections> = vec![[Some([0.6, 0.0, -0.8]), None]; WINDOW];
    hands[3][0] = None;
    let view = BodyView::around(&frames, &hands, WINDOW / 2, WINDOW, 1.0).unwrap();
    let channel = |view: &BodyView, k: usize| view.numbers[(N_BODY_IN + k) * WINDOW..][..WINDOW].to_vec();
    assert_eq!((channel(&view, 0)[5], channel(&view, 2)[3]), (0.6, -0.8));
    assert_eq!((channel(&view, 3)[3], channel(&view, 3)[4], channel(&view, 7)[4]), (0.0, 1.0, 0.0));
    let mirrored = view.mirrored();
    assert_eq!((channel(&mirrored, 4)[5], channel(&mirrored, 6)[5], channel(&mirrored, 3)[5]), (-0.6, -0.8, 0.0));
    assert_eq!(mirrored.mirrored(), view);
    assert_eq!(middle_view(&frames).unwrap().numbers[..N_BODY_IN * WINDOW], view.numbers[..N_BODY_IN * WINDOW]);
}

#[test]
fn hidden_points_move_with_the_neck() {
    let mut frames: Vec<BodyPoints> = (0..WINDOW).map(|t| frame(10.0 * t as f32)).collect();
    for f in &mut frames[5..] {
        f[R_WRIST] = None;
    }
    frames[3][R_SHOULDER] = None;
    frames.iter_mut().for_each(|f| f[R_HIP] = None);
    let view = middle_view(&frames).unwrap();
    assert!((view.middle(R_WRIST)[0] + 0.4).abs() < 1e-6);
    assert_eq!(view.numbers[(3 * R_WRIST + 2) * WINDOW..][..7], [1., 1., 1., 1., 1., 0., 0.]);
    assert_eq!(view.middle(R_HIP), [0.0, 0.0]);
    frames.iter_mut().for_each(|f| f[R_SHOULDER] = None);
    assert!(middle_view(&frames).is_none());
    assert!(middle_view(&[[Some([3.0, 3.0]); N_POINTS]; WINDOW]).is_none());
    assert!(middle_view(&[]).is_none());
}

#[test]
fn a_displaced_point_does_not_change_the_scale() {
    let mut frames: Vec<BodyPoints> = (0..71).map(|_| frame(0.0)).collect();
    frames[40..65].iter_mut().for_each(|f| f[L_WRIST] = Some([800.0, 310.0]));
    let scale = middle_view(&frames).unwrap().scale;
    assert!((scale - 1.4 * 100.0).abs() < 1e-3, "{scale}");
}

#[test]
fn proportions_are_measured_over_a_longer_range() {
    let mut frames: Vec<BodyPoints> = (0..71).map(|_| frame(0.0)).collect();
    // The left forearm is stretched for a while, outside the window of the middle frame.
    frames[55..67].iter_mut().for_each(|f| f[L_WRIST] = Some([355.0, 380.0]));
    frames[20][L_WRIST] = Some([3550.0, 380.0]);
    let view = middle_view(&frames).unwrap();
    assert_eq!(view.scale, 120.0);
    let kind = |k: usize| view.numbers[(3 * N_POINTS + k) * WINDOW + 5];
    assert!((kind(0) - 100.0 / 120.0).abs() < 1e-6 && kind(2) == 1.0 && (kind(3) - 40.0 / 120.0).abs() < 1e-6);
}
