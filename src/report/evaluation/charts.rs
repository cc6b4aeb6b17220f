//! Charts of an evaluation: the share of correct keypoints of each joint, drawn on a body and two hands, and the
//! distributions of speed and jerk of prediction and ground truth.

use crate::html::chart::histogram::{self, Counts};
use crate::html::chart::scale::{ChartDot, dots};
use crate::html::{Node, legend, node};
use ndarray::ArrayView3;
use orator_base::text::number;
use orator_base::types::skeleton::{self, L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_SHOULDER, is_duplicate};
use orator_gesture::evaluate::clips::clips::{EvalClip, EvalClips};
use orator_gesture::evaluate::table::table::Table;

/// Drawing of a body and two hands with the share of correct frames of each joint.
pub fn joints(table: &Table, clips: &EvalClips) -> Vec<Node> {
    let alpha = table.settings.alphas.first().copied().unwrap_or(0.2);
    let shares = shares(clips, alpha);
    let body = |joint: usize| joint <= L_WRIST;
    let position = |joint: usize| if body(joint) { body_position(joint) } else { hand_position(joint) };
    let mut edges = Vec::new();
    let mut all = Vec::new();
    for joint in (0..N_JOINTS).filter(|joint| !is_duplicate(*joint)) {
        // The first bone of a finger starts at the wrist of the large hand drawing.
        let parent = skeleton::parent(joint);
        edges.extend(parent.map(|parent| [position(parent), position(joint)]));
        if joint == NECK {
            continue;
        }
        let share = if shares[joint].is_nan() { "never visible" } else { &format!("{:.0} %", 100.0 * shares[joint]) };
        let description = format!("{}: {share}", skeleton::name(joint));
        let radius = if body(joint) { 9.0 } else { 6.0 };
        all.push(ChartDot { at: position(joint), share: shares[joint], radius, description });
    }
    let mean = |joints: &mut dyn Iterator<Item = usize>| {
        let finite_shares: Vec<f64> = joints.map(|joint| shares[joint]).filter(|share| share.is_finite()).collect();
        finite_shares.iter().sum::<f64>() / finite_shares.len() as f64
    };
    let label = |at: [f64; 2], name: &str, share: f64| (at, format!("{name} {:.0} %", 100.0 * share));
    let hand = |root: usize| mean(&mut (root + 1..root + skeleton::N_HAND_JOINTS));
    let labels = [
        label([180.0, 268.0], "arms", mean(&mut (R_SHOULDER..=L_WRIST))),
        label([405.0, 268.0], "right hand", hand(R_HAND)),
        label([640.0, 268.0], "left hand", hand(L_HAND)),
    ];
    let drawing = dots("Share of correct keypoints of each joint", [720.0, 280.0], &edges, &all, &labels);
    let about = format!(
        "Share of frames in which the predicted joint is within {alpha} of the largest extent of the ground-truth pose \
         (PCK), seen from the camera. Hover over a joint for its name and value."
    );
    let scale = node("p").class("scale").children([
        node("span").text("0 %"),
        node("span").class("ramp").attr("aria-hidden", "true"),
        node("span").text("100 % of the frames"),
    ]);
    vec![node("p").text(about), node("div").class("card scroll wide").child(drawing), scale]
}

/// Share of frames in which each joint is correct (PCK with threshold `alpha`); NaN for a joint that is never visible.
fn shares(clips: &EvalClips, alpha: f64) -> Vec<f64> {
    let (mut n_correct, mut n_visible) = (vec![0.0; N_JOINTS], vec![0.0; N_JOINTS]);
    for clip in &clips.clips {
        for t in 0..clip.n_frames() {
            let joints: Vec<usize> = (NECK + 1..N_JOINTS).filter(|joint| clip.mask[[t, *joint]]).collect();
            let side = |k: usize| {
                let values = joints.iter().map(|joint| clip.ground_truth[[t, *joint, k]]);
                let (low, high) =
                    values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
                f64::from(high - low)
            };
            let radius = alpha * (0..3).map(side).fold(0.0, f64::max);
            for joint in joints {
                let squared_difference =
                    |k: usize| f64::from(clip.predicted[[t, joint, k]] - clip.ground_truth[[t, joint, k]]).powi(2);
                n_visible[joint] += 1.0;
                n_correct[joint] += f64::from(u8::from((0..3).map(squared_difference).sum::<f64>().sqrt() <= radius));
            }
        }
    }
    n_correct.iter().zip(&n_visible).map(|(n_correct, n_visible)| n_correct / n_visible).collect()
}

/// Position of a body joint in the drawing; the speaker's right is on the left.
fn body_position(joint: usize) -> [f64; 2] {
    let positions =
        [[180.0, 60.0], [120.0, 72.0], [84.0, 150.0], [112.0, 222.0], [240.0, 72.0], [276.0, 150.0], [248.0, 222.0]];
    positions[joint.min(L_WRIST)]
}

/// Position of a hand joint in the drawing, with fingers up and thumbs inside; the root of a hand is its wrist.
fn hand_position(joint: usize) -> [f64; 2] {
    let (root, sign, x) = if joint >= R_HAND { (R_HAND, 1.0, 405.0) } else { (L_HAND, -1.0, 640.0) };
    let wrist = [x, 228.0];
    if joint == root {
        return wrist;
    }
    let (finger, bone) = ((joint - root - 1) / 4, (joint - root - 1) % 4);
    let (degrees, first, step): (f64, f64, f64) =
        [(48.0, 52.0, 24.0), (20.0, 84.0, 25.0), (3.0, 88.0, 27.0), (-13.0, 84.0, 25.0), (-30.0, 78.0, 20.0)][finger];
    let (length, angle) = (first + step * bone as f64, degrees.to_radians());
    [wrist[0] + sign * length * angle.sin(), wrist[1] - length * angle.cos()]
}

/// Charts of the speed and jerk distributions of wrists and finger tips.
pub fn speeds(clips: &EvalClips) -> Vec<Node> {
    let wrists = [skeleton::R_WRIST, L_WRIST];
    let tips: Vec<usize> = [L_HAND, R_HAND].iter().flat_map(|root| (1..=5).map(move |k| root + 4 * k)).collect();
    let charts = [
        ("Wrist speed", "m/s", &wrists[..], 1, 2.0),
        ("Fingertip speed", "m/s", &tips[..], 1, 3.0),
        ("Wrist jerk", "m/s\u{b3}", &wrists[..], 3, 600.0),
        ("Fingertip jerk", "m/s\u{b3}", &tips[..], 3, 1500.0),
    ];
    let card = |(title, unit, joints, order, max): (&str, &str, &[usize], usize, f64)| {
        let count = |of: fn(&EvalClip) -> ArrayView3<f32>| {
            let mut counts = Counts::new(0.0, max, 48);
            for clip in &clips.clips {
                for &joint in joints {
                    derivative(clip, of(clip), joint, order, clips.fps.per_sec()).for_each(|value| counts.add(value));
                }
            }
            counts
        };
        let (ground_truth, predicted) = (count(|clip| clip.ground_truth.view()), count(|clip| clip.predicted.view()));
        let medians = format!(
            "median: ground truth {}, prediction {} {unit}",
            number(ground_truth.quantile(0.5)),
            number(predicted.quantile(0.5))
        );
        histogram::card(title, unit, &[("truth", &ground_truth), ("predicted", &predicted)], medians)
    };
    let about = "Distributions of the values. Heights are proportional to the square root of the share, so that rare \
                 values stay visible; the last bin includes all larger values. Dashed lines: medians.";
    vec![node("p").text(about), colour_legend(), node("div").class("grid").children(charts.into_iter().map(card))]
}

/// Norm of the finite difference of a joint's position of this order (1 or 3), m/s^order, at every frame where the
/// joint is visible in all frames of the difference.
fn derivative<'a>(
    clip: &'a EvalClip,
    joints: ArrayView3<'a, f32>,
    joint: usize,
    order: usize,
    fps: f64,
) -> impl Iterator<Item = f64> + 'a {
    let signs: &[f64] = if order == 1 { &[-1.0, 1.0] } else { &[-1.0, 3.0, -3.0, 1.0] };
    let is_visible = move |t: &usize| (0..signs.len()).all(|k| clip.mask[[t + k, joint]]);
    (0..clip.n_frames().saturating_sub(signs.len() - 1)).filter(is_visible).map(move |t| {
        let difference = |axis: usize| -> f64 {
            signs.iter().enumerate().map(|(k, sign)| sign * f64::from(joints[[t + k, joint, axis]])).sum()
        };
        (0..3).map(|axis| difference(axis).powi(2)).sum::<f64>().sqrt() * fps.powi(order as i32)
    })
}

pub fn colour_legend() -> Node {
    legend([("line truth", "ground truth"), ("line predicted", "prediction")])
}
