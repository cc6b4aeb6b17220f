//! Synthetic hands before a camera: training samples of the hand lifters, and the errors of a lifter on them.

use super::hand_shape::{normal, random_rotation, sample_shape};
use super::noise;
use anyhow::Result;
use orator_base::math::order;
use orator_base::math::procrustes;
use orator_base::math::vec3;
use orator_base::motion::hand_bones::PHALANX;
use orator_base::motion::view::hand::{HandJoints, HandPoints, parent};
use orator_base::types::pose2d::N_HAND;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Share of hands that use the measured noise of real hand models, and the share of those that use the measured bias.
const MEASURED_NOISE: f64 = 0.7;
const MEASURED_BIAS: f64 = 0.8;

/// A hand: ground truth in px of the image with the wrist at 0, and the detected keypoints.
pub struct HandSample {
    pub truth: HandJoints,
    pub seen: HandPoints,
}

/// Samples a hand in a random orientation at a distance of 5 to 20 hand lengths, in px, with measured or assumed
/// noise; sometimes points are missing.
pub fn sample_hand(rng: &mut ChaCha8Rng) -> HandSample {
    let (shape, turn) = (sample_shape(rng), random_rotation(rng));
    let turned = shape.map(|p| turn.turn(p));
    let distance = 0.19 * rng.random_range(5.0..20.0);
    let px_per_metre: f64 = 1000.0;
    let palm_px = px_per_metre * vec3::norm(shape[9]);
    let mut keypoints = turned.map(|p| {
        let grow = px_per_metre * distance / (distance + p[2]);
        [p[0] * grow, p[1] * grow]
    });
    if !perturb_as_measured(&mut keypoints, palm_px, rng) {
        perturb(&mut keypoints, palm_px, rng);
    }
    let missing_points = missing(rng);
    let seen = std::array::from_fn(|j| (!missing_points[j]).then_some(keypoints[j].map(|v| v as f32)));
    // The view is centred on the detected wrist, the truth on the true one; they agree up to the noise.
    HandSample { truth: turned.map(|p| vec3::scale(p, px_per_metre)), seen }
}

/// Adds assumed noise of about 2 % of the palm length, partly common to a finger; in a fifth of the hands one finger
/// is much noisier.
fn perturb(keypoints: &mut [[f64; 2]; N_HAND], palm_px: f64, rng: &mut ChaCha8Rng) {
    let deviation = 0.02 * palm_px * rng.random_range(-1.1f64..0.6).exp();
    let guessed = if rng.random_bool(0.2) { rng.random_range(0..5) } else { 5 };
    let fingers: [[f64; 2]; 5] = std::array::from_fn(|f| {
        let common = if f == guessed { 2.0 } else { 0.4 };
        [common * deviation * normal(rng), common * deviation * normal(rng)]
    });
    for (j, point) in keypoints.iter_mut().enumerate() {
        let finger = j.checked_sub(1).map(|k| k / 4);
        let noise = if finger == Some(guessed) { 2.0 * deviation } else { 0.92 * deviation };
        let moved = finger.map_or([0.0; 2], |f| fingers[f]);
        (0..2).for_each(|k| point[k] += moved[k] + noise * normal(rng));
    }
}

/// Adds the measured noise of a random model set to 70 % of the hands; returns whether it did.
fn perturb_as_measured(keypoints: &mut [[f64; 2]; N_HAND], palm_px: f64, rng: &mut ChaCha8Rng) -> bool {
    let sets = &noise::measured().hands;
    if sets.is_empty() || !rng.random_bool(MEASURED_NOISE) {
        return false;
    }
    let set = &sets[rng.random_range(0..sets.len())];
    let scale = rng.random_range(-0.7f64..0.4).exp();
    let with_bias = rng.random_bool(MEASURED_BIAS);
    set.apply(keypoints, palm_px, scale, with_bias, rng);
    true
}

/// Points that are not detected: usually none, else random ones, a finger, all fingertips, or all knuckles. The wrist
/// and the middle knuckle are always detected, because the view needs them.
fn missing(rng: &mut ChaCha8Rng) -> [bool; N_HAND] {
    let missing_points: [bool; N_HAND] = match rng.random_range(0..50) {
        0 | 1 => {
            let share = rng.random_range(0.0..0.3);
            std::array::from_fn(|_| rng.random_bool(share))
        }
        2 => {
            let finger = rng.random_range(0..5);
            std::array::from_fn(|j| j.div_ceil(4) == finger + 1)
        }
        3 => std::array::from_fn(|j| j > 0 && j % 4 == 0),
        4 => std::array::from_fn(|j| j % 4 == 1),
        _ => [false; N_HAND],
    };
    std::array::from_fn(|j| missing_points[j] && j != 0 && j != 9)
}

/// Errors of `lift` (keypoints of right hands to joints in any unit) on `n` held-out hands, one line each. `brief`: on
/// a tenth of the hands and without the baseline.
///
/// # Errors
/// Errors of `lift`.
pub fn errors(
    lift: impl Fn(&[HandPoints]) -> Result<Vec<Option<HandJoints>>>,
    n: usize,
    brief: bool,
) -> Result<Vec<String>> {
    let mut rng = ChaCha8Rng::seed_from_u64(20_001);
    let n = if brief { n / 10 } else { n };
    let samples: Vec<HandSample> = (0..n).map(|_| sample_hand(&mut rng)).collect();
    let seen: Vec<HandPoints> = samples.iter().map(|s| s.seen).collect();
    let (mut lifted, mut hands) = (Vec::new(), Vec::new());
    for (sample, hand) in samples.iter().zip(lift(&seen)?) {
        if let Some(hand) = hand {
            lifted.push(sample);
            hands.push(hand);
        }
    }
    let mut lines =
        vec![format!("{:32} {}", "procedural hands, lifter", SyntheticHandErrors::measure(&lifted, &hands))];
    if !brief {
        let flat: Vec<HandJoints> = lifted.iter().map(|s| flat_hand(s)).collect();
        lines.push(format!(
            "{:32} {}",
            "procedural hands, flat baseline",
            SyntheticHandErrors::measure(&lifted, &flat)
        ));
    }
    Ok(lines)
}

/// Baseline: the 2D keypoints with zero depth.
fn flat_hand(sample: &HandSample) -> HandJoints {
    let [x0, y0] = sample.seen[0].unwrap_or_default();
    sample.seen.map(|p| {
        let [x, y] = p.unwrap_or([x0, y0]);
        [f64::from(x - x0), f64::from(y - y0), 0.0]
    })
}

/// Errors relative to the wrist in mm of a hand whose middle proximal phalanx measures 48 mm: the median over hands of
/// the mean over points, before and after a similarity alignment; and the share of hands above 30 mm.
struct SyntheticHandErrors {
    median: f32,
    aligned: f32,
    above_30: f64,
}

impl SyntheticHandErrors {
    fn measure(samples: &[&HandSample], hands: &[HandJoints]) -> Self {
        let (mut plain, mut aligned) = (Vec::new(), Vec::new());
        for (sample, hand) in samples.iter().zip(hands) {
            let to_mm = 1000.0 * PHALANX / vec3::norm(vec3::sub(sample.truth[10], sample.truth[9])).max(1e-9);
            let mean = |p: &[vec3::Vec3], q: &[vec3::Vec3]| {
                let sum: f64 = p.iter().zip(q).map(|(a, b)| vec3::norm(vec3::sub(*a, *b))).sum();
                (to_mm * sum / N_HAND as f64) as f32
            };
            // The size of a hand is known from its bones: hands are compared at equal total bone length.
            let bones = |h: &HandJoints| (1..N_HAND).map(|j| vec3::norm(vec3::sub(h[j], h[parent(j)]))).sum::<f64>();
            let flat = hand.iter().all(|p| p[2] == 0.0);
            let grow = if flat { 1.0 } else { bones(&sample.truth) / bones(hand).max(1e-9) };
            let scaled = hand.map(|p| vec3::scale(p, grow));
            plain.push(mean(&scaled, &sample.truth));
            if let Some(s) = procrustes::similarity(hand, &sample.truth) {
                aligned.push(mean(&hand.map(|p| s.apply(p)), &sample.truth));
            }
        }
        let above_30 = plain.iter().filter(|e| **e > 30.0).count() as f64 / plain.len().max(1) as f64;
        Self { median: order::median(plain).unwrap_or(0.0), aligned: order::median(aligned).unwrap_or(0.0), above_30 }
    }
}

impl std::fmt::Display for SyntheticHandErrors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { median, aligned, above_30 } = self;
        write!(f, "median {median:.1}  aligned {aligned:.1} mm  above 30 mm {:.0} %", 100.0 * above_30)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_truth_is_without_error() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let samples: Vec<HandSample> = (0..50).map(|_| sample_hand(&mut rng)).collect();
        let samples: Vec<&HandSample> = samples.iter().collect();
        let truth: Vec<HandJoints> = samples.iter().map(|s| s.truth.map(|p| vec3::scale(p, 3.0))).collect();
        let errors = SyntheticHandErrors::measure(&samples, &truth);
        assert!(errors.median < 1e-3 && errors.aligned < 1e-3 && errors.above_30 == 0.0);
        let flat: Vec<HandJoints> = samples.iter().map(|s| flat_hand(s)).collect();
        assert!(SyntheticHandErrors::measure(&samples, &flat).median > 20.0);
    }

    #[test]
    fn wrist_and_middle_knuckle_are_always_seen() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let samples: Vec<HandSample> = (0..300).map(|_| sample_hand(&mut rng)).collect();
        assert!(samples.iter().all(|s| s.seen[0].is_some() && s.seen[9].is_some()));
        assert!(samples.iter().any(|s| s.seen[8].is_none()));
    }
}
