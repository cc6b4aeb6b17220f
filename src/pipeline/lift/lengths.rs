//! Bone lengths of a video: one set for all its intervals, from the lifted and smoothed joints. Size is a convention,
//! since a picture does not show it: the body has the reference size, and the hand size follows from the forearm.

use orator_base::math::order::{lower_median, lower_quantile};
use orator_base::motion::upper_body::REFERENCE_SIZE;
use orator_base::motion::view::hand::parent;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{
    L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, N_BONES, R_ELBOW, R_HAND, R_SHOULDER, R_WRIST,
};

/// Quantile of a bone's lifted lengths: bones that point at the camera come out too short. Chosen on bodies of known
/// proportions with an earlier body lifter, where it was more accurate than the median, average adult lengths, the
/// mean of both, and the longest projection.
const QUANTILE: f64 = 0.7;
/// Shoulder width, upper arm and forearm of an average adult in metres; their sum is the reference size.
const ADULT_LENGTHS: [f64; 3] = [0.354, 0.293, 0.253];
/// Range of the ratio of a measured bone to the average one: adults vary by 5 %, but a bone that always points at the
/// camera comes out far too short.
const LENGTH_RATIO_RANGE: (f64, f64) = (0.9, 1.12);
/// Length of the first phalanx of the middle finger relative to the forearm (48 mm for a forearm of 0.24 m).
const PHALANX_OF_FOREARM: f64 = 0.20;
/// Length of that phalanx relative to the sum of all hand bones (means cited in `train::hand_shape`), and range of the
/// ratio of the lifted to this length: a finger that always points at the camera must not enlarge the hand.
const PHALANX_OF_HAND: f64 = 1.0 / 18.0;
const PHALANX_RATIO_RANGE: (f64, f64) = (0.85, 1.2);

/// Lengths in metres of bones 1..=48 of a lifted motion (hands of any size, each in its own frame with the root at 0).
/// 0 for a hand that is never visible, and for the hand roots.
pub fn measure(motion: &Motion) -> [f32; N_BONES] {
    let [shoulders, upper_arm, forearm] = arms(motion);
    let hand = hands(motion, forearm);
    std::array::from_fn(|bone| {
        let joint = bone + 1;
        let length = match joint {
            R_SHOULDER | L_SHOULDER => shoulders / 2.0,
            R_ELBOW | L_ELBOW => upper_arm,
            R_WRIST | L_WRIST => forearm,
            _ => hand.map_or(0.0, |h| h[(joint - L_HAND) % N_HAND]),
        };
        length as f32
    })
}

/// Shoulder width, upper arm and forearm in metres, equal on both sides.
fn arms(motion: &Motion) -> [f64; 3] {
    let sides: [&[(usize, usize)]; 3] = [
        &[(R_SHOULDER, L_SHOULDER)],
        &[(R_SHOULDER, R_ELBOW), (L_SHOULDER, L_ELBOW)],
        &[(R_ELBOW, R_WRIST), (L_ELBOW, L_WRIST)],
    ];
    let mut lengths = [0.0; 3];
    for (i, bones) in sides.iter().enumerate() {
        let all = bones.iter().flat_map(|&(a, b)| visible_lengths(motion, a, b));
        let [least, most] = [LENGTH_RATIO_RANGE.0, LENGTH_RATIO_RANGE.1].map(|ratio| ratio * ADULT_LENGTHS[i]);
        lengths[i] =
            lower_quantile(all, QUANTILE).map_or(ADULT_LENGTHS[i], |length| f64::from(length).clamp(least, most));
    }
    let scale = REFERENCE_SIZE / lengths.iter().sum::<f64>();
    lengths.map(|length| length * scale)
}

/// Bone lengths of the hands, equal on both sides: medians, scaled by the first phalanx of the middle finger. Entry j
/// is the bone from the parent of j to j. `None` if no hand is visible.
fn hands(motion: &Motion, forearm: f64) -> Option<[f64; N_HAND]> {
    let mut lengths = [0.0; N_HAND];
    for (j, length) in lengths.iter_mut().enumerate().skip(1) {
        let both_hands = |lengths: fn(&Motion, usize, usize) -> Vec<f32>| {
            let both = [L_HAND, R_HAND].into_iter();
            lower_median(both.flat_map(|root| lengths(motion, root + parent(j), root + j)))
        };
        // A bone that is never visible (some detectors omit points) keeps its lifted length.
        *length = both_hands(visible_lengths).or_else(|| both_hands(lifted_lengths))?.into();
    }
    let expected = PHALANX_OF_HAND * lengths.iter().sum::<f64>();
    let phalanx = lengths[10].clamp(PHALANX_RATIO_RANGE.0 * expected, PHALANX_RATIO_RANGE.1 * expected);
    (phalanx > 1e-9).then(|| lengths.map(|length| length * PHALANX_OF_FOREARM * forearm / phalanx))
}

/// Lengths of a bone in the frames in which both ends are visible. A hand root is visible if any point of the hand is.
fn visible_lengths(motion: &Motion, from: usize, to: usize) -> Vec<f32> {
    let is_root = from == L_HAND || from == R_HAND;
    let is_visible = |t: usize| motion.mask[[t, to]] && (is_root || motion.mask[[t, from]]);
    (0..motion.n_frames()).filter(|&t| is_visible(t)).map(|t| bone(motion, t, from, to)).collect()
}

fn lifted_lengths(motion: &Motion, from: usize, to: usize) -> Vec<f32> {
    (0..motion.n_frames()).map(|t| bone(motion, t, from, to)).collect()
}

/// Distance of two joints in a frame, in metres.
pub fn bone(motion: &Motion, t: usize, from: usize, to: usize) -> f32 {
    let square = |k: usize| (motion.joints[[t, to, k]] - motion.joints[[t, from, k]]).powi(2);
    (0..3).map(square).sum::<f32>().sqrt()
}
