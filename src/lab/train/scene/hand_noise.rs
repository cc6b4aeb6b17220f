//! Errors of real hand models, measured on rendered persons and reproduced on exact keypoints: a bias that depends on
//! the bone directions in the image, and noise of the hand, of each finger and of each point, larger for hidden
//! fingers. Positions are relative to the wrist, in palm lengths (wrist to middle knuckle).

use super::hand_shape::normal;
use orator_base::motion::view::hand::parent;
use orator_base::types::pose2d::N_HAND;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Points other than the wrist.
pub const N_POINTS: usize = N_HAND - 1;
/// Number of fingers, and of points per finger.
pub const N_FINGERS: usize = 5;
pub const N_OF_FINGER: usize = 4;
/// Number of basis vectors of a bias.
pub const N_BASIS: usize = 3;

/// Noise of one model set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HandNoise {
    /// Name of the model set.
    pub set: String,
    /// Bias of each point except the wrist: weights of the basis vectors (`basis`).
    pub bias: [[f64; N_BASIS]; N_POINTS],
    /// Standard deviation per axis of the error common to all points (the wrist's own error).
    pub hand: f64,
    /// Noise of visible fingers, and of hidden ones.
    #[serde(rename = "seen")]
    pub visible: FingerNoise,
    pub hidden: FingerNoise,
    /// Share of the fingers that are hidden, 0..1.
    #[serde(rename = "hides")]
    pub hidden_share: f64,
}

/// Noise of a finger, per axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FingerNoise {
    /// Standard deviation of the error common to a finger's points, of regular fingers and of outliers, and the share
    /// of outliers.
    pub finger: f64,
    #[serde(rename = "stray_finger")]
    pub outlier_finger_std: f64,
    #[serde(rename = "strays")]
    pub outlier_share: f64,
    /// Standard deviation of a point's own error.
    pub point: f64,
}

/// Basis vectors in image axes of the bias of point `j` (1..21): the palm, the palm's width, and the bone that ends at
/// the point.
pub fn basis(hand: &[[f64; 2]; N_HAND], j: usize) -> [[f64; 2]; N_BASIS] {
    let between = |a: usize, b: usize| [0, 1].map(|k| hand[b][k] - hand[a][k]);
    [between(0, 9), between(17, 5), between(parent(j), j)]
}

impl HandNoise {
    /// Adds noise to the exact keypoints `hand` in px. `palm_px` is the true palm length in px; `scale` multiplies the
    /// random noise. If `with_bias`, the measured bias is added.
    pub fn apply(
        &self,
        hand: &mut [[f64; 2]; N_HAND],
        palm_px: f64,
        scale: f64,
        with_bias: bool,
        rng: &mut ChaCha8Rng,
    ) {
        let exact = *hand;
        let size = palm_px * scale;
        let common = [0, 1].map(|_| self.hand * normal(rng));
        for finger in 0..N_FINGERS {
            let noise = if rng.random_bool(self.hidden_share.clamp(0.0, 1.0)) { self.hidden } else { self.visible };
            let is_outlier = rng.random_bool(noise.outlier_share.clamp(0.0, 1.0));
            let deviation = if is_outlier { noise.outlier_finger_std } else { noise.finger };
            let of_finger = [0, 1].map(|_| deviation * normal(rng));
            let first = 1 + N_OF_FINGER * finger;
            for (j, point) in hand.iter_mut().enumerate().skip(first).take(N_OF_FINGER) {
                let bias = basis(&exact, j);
                for k in 0..2 {
                    let own = noise.point * normal(rng);
                    point[k] += size * (common[k] + of_finger[k] + own);
                    if with_bias {
                        point[k] += bias.iter().zip(self.bias[j - 1]).map(|(v, weight)| weight * v[k]).sum::<f64>();
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn noise_has_its_size_and_the_wrist_stays() {
        let noise = HandNoise {
            set: String::new(),
            bias: [[0.0; N_BASIS]; N_POINTS],
            hand: 0.03,
            visible: FingerNoise { finger: 0.04, point: 0.02, ..FingerNoise::default() },
            hidden: FingerNoise::default(),
            hidden_share: 0.0,
        };
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut sum = 0.0;
        for _ in 0..2000 {
            let mut hand = [[0.0; 2]; N_HAND];
            noise.apply(&mut hand, 100.0, 1.0, true, &mut rng);
            assert_eq!(hand[0], [0.0; 2]);
            sum += hand[7][0].powi(2);
        }
        let deviation = (sum / 2000.0).sqrt();
        assert!(
            (deviation - 100.0 * (0.03f64.powi(2) + 0.04f64.powi(2) + 0.02f64.powi(2)).sqrt()).abs() < 0.4,
            "{deviation}"
        );
    }
}
