//! Errors of real 2D pose models, measured on rendered persons and reproduced on exact keypoints: a bias that depends
//! on the bone directions in the image, a bias per clip, temporally correlated noise that is larger where a point is
//! hidden, and gaps. Lengths are relative to the shoulder width; the frame rate is 15 frames/s.

use super::hand_noise::HandNoise;
use super::hand_shape::normal;
use anyhow::{Context, Result};
use orator_base::motion::upper_body::{
    BodyPoints, L_ELBOW, L_HIP, L_SHOULDER, L_WRIST, N_POINTS, NOSE, R_ELBOW, R_HIP, R_SHOULDER, R_WRIST,
};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Measured errors of the known model sets.
const MEASURED: &str = include_str!("../../../../models/keypoint_noise.json");
/// Kinds of points, left and right merged: nose, shoulder, elbow, wrist, hip.
pub const N_KINDS: usize = 5;
/// Number of basis vectors of a bias; the last one is the image's downward direction.
pub const N_BASIS: usize = 4;

/// Noise of one model set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeypointNoise {
    /// Name of the model set.
    pub set: String,
    /// Noise by kind: nose, shoulder, elbow, wrist, hip.
    pub points: [PointNoise; N_KINDS],
}

/// Noise of a point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointNoise {
    /// Bias: weights of the basis vectors (`basis`).
    pub bias: [f64; N_BASIS],
    /// Standard deviation per axis of the clip's mean error that the bias does not explain.
    pub clip: f64,
    /// Noise of frames in which the point is visible, and in which it is hidden.
    #[serde(rename = "seen")]
    pub visible: FrameNoise,
    pub hidden: FrameNoise,
    /// Runs of frames in which the point is hidden, and in which it is not detected.
    #[serde(rename = "hides")]
    pub occlusions: Runs,
    pub gaps: Runs,
}

/// Noise of single frames about the mean of the clip, per axis: a mixture of two Gaussians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameNoise {
    /// Standard deviation of regular frames, and of outliers.
    pub deviation: f64,
    #[serde(rename = "stray_deviation")]
    pub outlier_std: f64,
    /// Share of outliers, 0..1.
    #[serde(rename = "strays")]
    pub outlier_share: f64,
    /// Correlation between successive frames, 0..1.
    pub correlation: f64,
}

/// Two-state Markov chain of a state that begins and ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Runs {
    /// Probability that a run begins in a frame outside a run, and that a run ends after a frame.
    pub begin: f64,
    pub end: f64,
}

impl Runs {
    /// Samples for each of `n` frames whether it is in a run.
    pub fn sample(&self, n: usize, rng: &mut ChaCha8Rng) -> Vec<bool> {
        let share = self.begin / (self.begin + self.end).max(1e-9);
        let mut inside = rng.random_bool(share.clamp(0.0, 1.0));
        (0..n)
            .map(|_| {
                let now = inside;
                let change = if inside { self.end } else { self.begin };
                inside ^= rng.random_bool(change.clamp(0.0, 1.0));
                now
            })
            .collect()
    }
}

/// Measured noise of model sets, as written by `orator-lab train noise`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredNoise {
    pub bodies: Vec<KeypointNoise>,
    pub hands: Vec<HandNoise>,
}

/// Noise of all measured model sets, compiled into the program.
pub fn measured() -> &'static MeasuredNoise {
    static PARSED: OnceLock<MeasuredNoise> = OnceLock::new();
    // A test parses the built-in file; with an invalid file, lifters would be trained with the assumed noise alone.
    PARSED.get_or_init(|| parse(MEASURED).unwrap_or(MeasuredNoise { bodies: Vec::new(), hands: Vec::new() }))
}

fn parse(text: &str) -> Result<MeasuredNoise> {
    serde_json::from_str(text).context("invalid built-in models/keypoint_noise.json")
}

/// Index of a point's kind in `KeypointNoise::points`.
pub fn kind(point: usize) -> usize {
    match point {
        NOSE => 0,
        R_SHOULDER | L_SHOULDER => 1,
        R_ELBOW | L_ELBOW => 2,
        R_WRIST | L_WRIST => 3,
        _ => 4,
    }
}

/// Basis vectors of the bias of a point, in image axes and shoulder widths: the adjacent bones, then the downward
/// direction. Bone vectors rotate with the image and are mirrored with the body, so that left and right share their
/// weights. `None` if a required point is missing.
pub fn basis(body: &BodyPoints, point: usize, shoulders_px: f64) -> Option<[[f64; 2]; N_BASIS]> {
    let at = |joint: usize| body[joint].map(|p| p.map(|v| f64::from(v) / shoulders_px));
    let between = |a: [f64; 2], b: [f64; 2]| [b[0] - a[0], b[1] - a[1]];
    let (right, left) = (at(R_SHOULDER)?, at(L_SHOULDER)?);
    let neck = [0, 1].map(|k| (right[k] + left[k]) / 2.0);
    let to_nose = between(neck, at(NOSE)?);
    let [shoulder, elbow, wrist, hip] = if (L_SHOULDER..=L_WRIST).contains(&point) || point == L_HIP {
        [left, at(L_ELBOW)?, at(L_WRIST)?, at(L_HIP).unwrap_or(left)]
    } else {
        [right, at(R_ELBOW)?, at(R_WRIST)?, at(R_HIP).unwrap_or(right)]
    };
    let [out, upper, fore] = [between(neck, shoulder), between(shoulder, elbow), between(elbow, wrist)];
    let vectors = match kind(point) {
        0 => [to_nose, [0.0; 2], [0.0; 2]],
        1 => [out, upper, to_nose],
        2 => [upper, fore, out],
        3 => [fore, upper, out],
        _ => [between(shoulder, hip), out, [0.0; 2]],
    };
    Some([vectors[0], vectors[1], vectors[2], [0.0, 1.0]])
}

impl KeypointNoise {
    /// Adds noise to exact keypoints; `scale` multiplies everything except the gaps. If `with_bias`, the measured bias
    /// is added, otherwise a bias of equal size in a random direction that is constant over the clip.
    pub fn apply(&self, body: &mut [BodyPoints], shoulders_px: f64, scale: f64, with_bias: bool, rng: &mut ChaCha8Rng) {
        let exact = body.to_vec();
        for point in 0..N_POINTS {
            let noise = &self.points[kind(point)];
            let random_direction = [normal(rng), normal(rng)];
            let hidden = noise.occlusions.sample(body.len(), rng);
            let missing = noise.gaps.sample(body.len(), rng);
            let clip = [0, 1].map(|_| noise.clip * normal(rng));
            let mut correlated = [normal(rng), normal(rng)];
            for (t, frame) in body.iter_mut().enumerate() {
                let of_frame = if hidden[t] { noise.hidden } else { noise.visible };
                let correlation = of_frame.correlation.clamp(0.0, 0.99);
                correlated =
                    correlated.map(|v| correlation * v + (1.0 - correlation * correlation).sqrt() * normal(rng));
                let is_outlier = rng.random_bool(of_frame.outlier_share.clamp(0.0, 1.0));
                let outlier = [0, 1].map(|_| if is_outlier { of_frame.outlier_std * normal(rng) } else { 0.0 });
                let Some(position) = frame[point].as_mut() else { continue };
                let bias = basis(&exact[t], point, shoulders_px).map_or([0.0; 2], |basis| {
                    [0, 1].map(|k| basis.iter().zip(noise.bias).map(|(vector, weight)| weight * vector[k]).sum::<f64>())
                });
                let bias = if with_bias { bias } else { random_direction.map(|v| 0.7 * v * bias[0].hypot(bias[1])) };
                for k in 0..2 {
                    let off = bias[k] + clip[k] + of_frame.deviation * correlated[k] + outlier[k];
                    position[k] += (shoulders_px * scale * off) as f32;
                }
                if missing[t] {
                    frame[point] = None;
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
    fn what_is_measured_can_be_read_and_runs_have_their_shares() {
        assert_eq!(measured(), &parse(MEASURED).unwrap());
        assert!(!measured().bodies.is_empty() && !measured().hands.is_empty());
        let runs = Runs { begin: 0.05, end: 0.2 };
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let inside = runs.sample(100_000, &mut rng);
        let share = inside.iter().filter(|v| **v).count() as f64 / 1e5;
        assert!((share - 0.2).abs() < 0.01, "{share}");
        assert!(Runs::default().sample(50, &mut rng).iter().all(|v| !v));
    }

    #[test]
    fn the_bias_goes_with_the_bones_and_changes_sides_with_the_body() {
        let body: BodyPoints = [
            [0.0, -60.0],
            [-50.0, 0.0],
            [-60.0, 80.0],
            [-20.0, 120.0],
            [50.0, 0.0],
            [60.0, 80.0],
            [20.0, 120.0],
            [-30.0, 150.0],
            [30.0, 150.0],
        ]
        .map(Some);
        let mut noise = KeypointNoise { set: String::new(), points: Default::default() };
        noise.points[3].bias = [0.1, 0.0, 0.0, 0.0];
        let mut moved = [body];
        noise.apply(&mut moved, 100.0, 1.0, true, &mut ChaCha8Rng::seed_from_u64(2));
        let off = |point: usize| [0, 1].map(|k| moved[0][point].unwrap()[k] - body[point].unwrap()[k]);
        assert_eq!(off(R_ELBOW), [0.0; 2]);
        assert!((off(R_WRIST)[0] - 4.0).abs() < 1e-4 && (off(L_WRIST)[0] + 4.0).abs() < 1e-4);
        assert!((off(R_WRIST)[1] - 4.0).abs() < 1e-4);
    }
}
