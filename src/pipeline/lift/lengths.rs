//! The bone lengths of a video: one set over all its intervals, from what was lifted and smoothed. Sizes are a convention,
//! as no picture tells them: the body is of the reference size, a hand has the size its forearm sets.

use orator_base::math::order::{lower_median, lower_quantile};
use orator_base::motion::upper_body::REFERENCE_SIZE;
use orator_base::motion::view::hand::parent;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{
    L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, N_BONES, R_ELBOW, R_HAND, R_SHOULDER, R_WRIST,
};

/// Quantile of a bone's lifted lengths that counts: bones that point at the
/// camera come out short. Chosen on bodies of known proportions with an earlier body lifter, where it came nearer than
/// the median, the common adult, a mean of both, and the longest appearance in the picture.
const QUANTILE: f64 = 0.7;
/// Shoulders, upper arm and forearm of a common adult, metres, together of the reference size.
const COMMON: [f64; 3] = [0.354, 0.293, 0.253];
/// How far a measured bone may be from the common one, as a ratio: adults differ by 5 %, and where a bone points at the
/// camera throughout it is lifted much too short.
const BELIEVED: (f64, f64) = (0.9, 1.12);
/// The middle finger's first phalanx in forearms (house measure: 48 mm for a forearm of 0.24 m).
const PHALANX_OF_FOREARM: f64 = 0.20;
/// That phalanx in bones of the hand together (the means that `train::hand_shape` cites), and how far from it the lifted
/// one is believed, as a ratio: a finger that points at the camera throughout must not make the hand large.
const PHALANX_OF_HAND: f64 = 1.0 / 18.0;
const PHALANX_BELIEVED: (f64, f64) = (0.85, 1.2);

/// The lengths in metres of bones 1..=48 of a lifted motion (hands of any one size, each in its own frame with the
/// root at 0); 0: a hand never seen, and the hand roots.
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

/// Shoulders, upper arm and forearm, the same on both sides.
fn arms(motion: &Motion) -> [f64; 3] {
    let sides: [&[(usize, usize)]; 3] = [
        &[(R_SHOULDER, L_SHOULDER)],
        &[(R_SHOULDER, R_ELBOW), (L_SHOULDER, L_ELBOW)],
        &[(R_ELBOW, R_WRIST), (L_ELBOW, L_WRIST)],
    ];
    let mut lengths = [0.0; 3];
    for (i, bones) in sides.iter().enumerate() {
        let all = bones.iter().flat_map(|&(a, b)| seen_lengths(motion, a, b));
        let [least, most] = [BELIEVED.0, BELIEVED.1].map(|ratio| ratio * COMMON[i]);
        lengths[i] = lower_quantile(all, QUANTILE).map_or(COMMON[i], |length| f64::from(length).clamp(least, most));
    }
    let grow = REFERENCE_SIZE / lengths.iter().sum::<f64>();
    lengths.map(|length| length * grow)
}

/// A hand's bones, the same on both sides: medians, of the size that the middle finger's first phalanx sets. `None` when
/// no hand was seen. Entry j: the bone from its parent to j.
fn hands(motion: &Motion, forearm: f64) -> Option<[f64; N_HAND]> {
    let mut lengths = [0.0; N_HAND];
    for (j, length) in lengths.iter_mut().enumerate().skip(1) {
        let of_roots = |lengths: fn(&Motion, usize, usize) -> Vec<f32>| {
            let both = [L_HAND, R_HAND].into_iter();
            lower_median(both.flat_map(|root| lengths(motion, root + parent(j), root + j)))
        };
        // A bone that is never seen (a detector may leave points out) is as long as it was lifted.
        *length = of_roots(seen_lengths).or_else(|| of_roots(lifted_lengths))?.into();
    }
    let usual = PHALANX_OF_HAND * lengths.iter().sum::<f64>();
    let phalanx = lengths[10].clamp(PHALANX_BELIEVED.0 * usual, PHALANX_BELIEVED.1 * usual);
    (phalanx > 1e-9).then(|| lengths.map(|length| length * PHALANX_OF_FOREARM * forearm / phalanx))
}

/// The bone's length in each frame that shows both ends. The root of a hand is seen where any of it is.
fn seen_lengths(motion: &Motion, from: usize, to: usize) -> Vec<f32> {
    let is_root = from == L_HAND || from == R_HAND;
    let seen = |t: usize| motion.mask[[t, to]] && (is_root || motion.mask[[t, from]]);
    (0..motion.n_frames()).filter(|&t| seen(t)).map(|t| bone(motion, t, from, to)).collect()
}

fn lifted_lengths(motion: &Motion, from: usize, to: usize) -> Vec<f32> {
    (0..motion.n_frames()).map(|t| bone(motion, t, from, to)).collect()
}

/// Metres between two joints of a frame.
pub fn bone(motion: &Motion, t: usize, from: usize, to: usize) -> f32 {
    let square = |k: usize| (motion.joints[[t, to, k]] - motion.joints[[t, from, k]]).powi(2);
    (0..3).map(square).sum::<f32>().sqrt()
}
