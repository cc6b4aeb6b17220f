//! MediaPipe landmark arrays: pose [T, 33, 3..5] (x, y, z, visibility, presence) and separate hands [T, 21, 2..3], or
//! all in one: pose, left, right hand [T, 75, ...]; pose, face, left, right hand [T, 543, ...] (553 with irises), or
//! flat with 4 numbers per pose landmark [T, 1662]; or in the other common order face, left hand, pose, right hand.
//! Coordinates are fractions 0..1 of the image. Without visibility, a landmark that is not at 0, 0 has score 1.

use super::entry::point;
use super::found::{FoundKeypoints, FoundPerson, NamedArrays};
use super::layout::MEDIAPIPE;
use anyhow::{Result, ensure};
use ndarray::{Array3, ArrayView3, Ix2, Ix3, s};
use orator_base::types::pose2d::{Keypoint, N_HAND};

const N_POSE: usize = 33;
/// Number of face landmarks, without and with irises.
const N_FACE: [usize; 2] = [468, 478];

/// Landmarks of a video: pose, left hand, right hand, each [T, n, 2..5].
struct Landmarks {
    pose: Array3<f32>,
    hands: [Option<Array3<f32>>; 2],
}

/// The keypoints; `None` if no array has a MediaPipe shape.
///
/// # Errors
///
/// Pose and hands have different numbers of frames.
pub fn read(arrays: &NamedArrays) -> Result<Option<FoundKeypoints>> {
    let Some(landmarks) = arrays.iter().find_map(|(_, array)| split(array)).or_else(|| separate_arrays(arrays)) else {
        return Ok(None);
    };
    let n_frames = landmarks.pose.shape()[0];
    for (hand, side) in landmarks.hands.iter().zip(["left", "right"]) {
        let n = hand.as_ref().map_or(n_frames, |hand| hand.shape()[0]);
        ensure!(n == n_frames, "the {side} hand has {n} frames, the pose {n_frames}");
    }
    let score = pose_score(&landmarks.pose);
    let frame = |t: usize| {
        let pose: Vec<Keypoint> = (0..N_POSE)
            .map(|j| point(landmarks.pose[[t, j, 0]], landmarks.pose[[t, j, 1]], score(&landmarks.pose, t, j)))
            .collect();
        let hand = |side: usize| {
            let hand = landmarks.hands[side].as_ref();
            let at = |hand: &Array3<f32>| std::array::from_fn(|j| point(hand[[t, j, 0]], hand[[t, j, 1]], 1.0));
            hand.map_or([Keypoint::default(); N_HAND], at)
        };
        let person = FoundPerson { left_hand: hand(0), right_hand: hand(1), ..MEDIAPIPE.person(&pose) };
        if person.area().is_some() { vec![person] } else { Vec::new() }
    };
    let frames = (0..n_frames).map(frame).collect();
    let hands = if landmarks.hands.iter().any(Option::is_some) { " and hands" } else { "" };
    let no_hands = hands.is_empty().then(|| "no hand arrays: hands are marked as not detected".to_owned());
    let found = FoundKeypoints::new(format!("MediaPipe, pose{hands}"), frames, no_hands.into_iter().collect());
    Ok(Some(FoundKeypoints { layout: MEDIAPIPE.name.to_owned(), ..found }))
}

/// Accessor for the scores of pose landmarks: the visibility if there are at least four numbers, or a third number
/// that is always in 0..1 (depths are not).
fn pose_score(pose: &Array3<f32>) -> fn(&Array3<f32>, usize, usize) -> f32 {
    let third = || pose.slice(s![.., .., 2]).into_iter().copied().filter(|v| v.is_finite());
    match pose.shape()[2] {
        2 => |_, _, _| 1.0,
        3 if third().all(|v| (0.0..=1.0).contains(&v)) && third().any(|v| v > 0.0) => |pose, t, j| pose[[t, j, 2]],
        3 => |_, _, _| 1.0,
        _ => |pose, t, j| pose[[t, j, 3]],
    }
}

/// Separate arrays for pose and hands; the hands are identified by name (`left_hand`, `lh`, ...).
fn separate_arrays(arrays: &NamedArrays) -> Option<Landmarks> {
    let of = |n: usize, is_name: &dyn Fn(&str) -> bool| {
        let fits = |shape: &[usize]| matches!(shape, [_, points, 2..=5] if *points == n);
        let found = arrays.iter().find(|(name, array)| is_name(&name.to_lowercase()) && fits(array.shape()));
        found.and_then(|(_, array)| array.clone().into_dimensionality::<Ix3>().ok())
    };
    let side = |word: &str, short: &str| of(N_HAND, &|name| name.contains(word) || name.starts_with(short));
    Some(Landmarks { pose: of(N_POSE, &|_| true)?, hands: [side("left", "lh"), side("right", "rh")] })
}

/// Splits an array of all landmarks into its parts.
fn split(array: &ndarray::ArrayD<f32>) -> Option<Landmarks> {
    if let [n_frames, n] = array.shape() {
        let face = N_FACE.into_iter().find(|face| 4 * N_POSE + 3 * (face + 2 * N_HAND) == *n)?;
        let flat = array.view().into_dimensionality::<Ix2>().ok()?;
        let cut = |from: usize, n: usize, width: usize| {
            Array3::from_shape_fn((*n_frames, n, width), |(t, j, k)| flat[[t, from + width * j + k]])
        };
        let hands_at = 4 * N_POSE + 3 * face;
        let hands = [hands_at, hands_at + 3 * N_HAND].map(|at| Some(cut(at, N_HAND, 3)));
        return Some(Landmarks { pose: cut(0, N_POSE, 4), hands });
    }
    let all = array.view().into_dimensionality::<Ix3>().ok()?;
    let &[_, n_points, 2..=5] = all.shape() else { return None };
    let cut = |pose: usize, left: usize, right: usize| {
        let part = |from: usize, n: usize| all.slice(s![.., from..from + n, ..]).to_owned();
        Landmarks { pose: part(pose, N_POSE), hands: [Some(part(left, N_HAND)), Some(part(right, N_HAND))] }
    };
    if n_points == N_POSE + 2 * N_HAND {
        return Some(cut(0, N_POSE, N_POSE + N_HAND));
    }
    let face = N_FACE.into_iter().find(|face| N_POSE + face + 2 * N_HAND == n_points)?;
    let hands = N_POSE + face;
    let orders = [(0, hands, hands + N_HAND), (face + N_HAND, face, face + N_HAND + N_POSE)];
    let gaps = orders.map(|(pose, left, right)| wrist_gap(all, [(pose + 15, left), (pose + 16, right)]));
    let use_second = match gaps {
        [Some(first), Some(last)] => last < first,
        // Without hands, the orders are distinguished by size: a body is taller than its face.
        _ => {
            let [first, last] = orders.map(|(pose, _, _)| extent(all.slice(s![.., pose..pose + N_POSE, ..])));
            last > first
        }
    };
    let (pose, left, right) = orders[usize::from(use_second)];
    Some(cut(pose, left, right))
}

/// Mean distance between the wrists of the pose and those of the hands; `None` if they never occur in the same frame.
fn wrist_gap(all: ArrayView3<f32>, pairs: [(usize, usize); 2]) -> Option<f64> {
    let xy = |t: usize, j: usize| {
        let [x, y] = [all[[t, j, 0]], all[[t, j, 1]]];
        (x.is_finite() && y.is_finite() && (x != 0.0 || y != 0.0)).then_some([x, y])
    };
    let frames = 0..all.shape()[0];
    let wrist_pairs = frames.flat_map(|t| pairs.map(|(wrist, root)| (t, wrist, root)));
    let gaps: Vec<f64> = wrist_pairs
        .filter_map(|(t, wrist, root)| {
            let ([ax, ay], [bx, by]) = (xy(t, wrist)?, xy(t, root)?);
            Some(f64::from((ax - bx).hypot(ay - by)))
        })
        .collect();
    (!gaps.is_empty()).then(|| gaps.iter().sum::<f64>() / gaps.len() as f64)
}

/// Sum over all frames of the vertical extent of the points, in the unit of the coordinates.
fn extent(points: ArrayView3<f32>) -> f64 {
    let height = |frame: ndarray::ArrayView2<f32>| {
        let ys = frame.column(1).into_iter().copied().filter(|y| y.is_finite() && *y != 0.0).collect::<Vec<_>>();
        let range = ys.iter().copied().fold(f32::MIN, f32::max) - ys.iter().copied().fold(f32::MAX, f32::min);
        if ys.is_empty() { 0.0 } else { f64::from(range) }
    };
    points.outer_iter().map(height).sum()
}
