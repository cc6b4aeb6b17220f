//! Input of the hand lifter, built here for training and lifting: the 21 points of a hand, normalised. A left hand is
//! mirrored to a right one, the wrist is the origin, the palm points up, and the root mean square distance of the
//! points from their centroid is 1.

use crate::math::vec3::Vec3;
use crate::types::pose2d::N_HAND;
use crate::types::skeleton::Side;

/// Keypoints of a hand in px: wrist first, then thumb to little finger, each from base to tip; `None`: not visible.
pub type HandPoints = [Option<[f32; 2]>; N_HAND];
/// Joints of a hand in camera axes, with the wrist at the origin.
pub type HandJoints = [Vec3; N_HAND];

/// Number of inputs: x, y and visibility of each point.
pub const N_IN: usize = 3 * N_HAND;
/// Number of outputs: x, y, z of each point.
pub const N_OUT: usize = 3 * N_HAND;

/// Indices of the first joints of the four fingers.
const KNUCKLES: [usize; 4] = [5, 9, 13, 17];

/// Returns the parent of a hand joint; the wrist is its own parent.
pub const fn parent(joint: usize) -> usize {
    if joint % 4 == 1 { 0 } else { joint.saturating_sub(1) }
}

/// Input of the network for one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct HandView {
    /// x, y and visibility of each point.
    pub numbers: [f32; N_IN],
    /// px per unit of `numbers`.
    pub scale: f32,
    /// Cosine and sine of the rotation from the picture to the view.
    turn: [f32; 2],
    mirrored: bool,
}

impl HandView {
    /// Builds the input for a hand of the given side. A point that is not visible is put on the wrist. `None` if the
    /// wrist or all knuckles are not visible, or all points coincide.
    pub fn new(seen: &HandPoints, side: Side) -> Option<Self> {
        let mirrored = side == Side::Left;
        let wrist = seen[0]?;
        let flip = if mirrored { -1.0 } else { 1.0 };
        let points = seen.map(|p| p.map(|[x, y]| [flip * (x - wrist[0]), y - wrist[1]]));
        let mean = |points: &[[f32; 2]]| [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f32>() / points.len() as f32);
        let knuckles: Vec<[f32; 2]> = KNUCKLES.iter().filter_map(|&j| points[j]).collect();
        let visible: Vec<[f32; 2]> = points.iter().flatten().copied().collect();
        if knuckles.is_empty() {
            return None;
        }
        let ([px, py], centre) = (mean(&knuckles), mean(&visible));
        let spread = visible.iter().map(|p| (p[0] - centre[0]).powi(2) + (p[1] - centre[1]).powi(2)).sum::<f32>();
        let scale = (spread / visible.len() as f32).sqrt();
        if !(scale > 1e-6 && scale.is_finite()) {
            return None;
        }
        // The rotation that brings the palm (px, py) to (0, -1).
        let length = px.hypot(py);
        let turn = if length > 1e-6 * scale { [-py / length, -px / length] } else { [1.0, 0.0] };
        let mut numbers = [0.0; N_IN];
        for (j, point) in points.iter().enumerate() {
            let [x, y] = point.unwrap_or_default();
            numbers[3 * j] = (turn[0] * x - turn[1] * y) / scale;
            numbers[3 * j + 1] = (turn[1] * x + turn[0] * y) / scale;
            numbers[3 * j + 2] = f32::from(point.is_some());
        }
        Some(Self { numbers, scale, turn, mirrored })
    }

    /// Converts a hand in the axes of the picture (px, wrist at 0) to the training target: the output for this input.
    pub fn target(&self, hand: &HandJoints) -> [f32; N_OUT] {
        let flip = if self.mirrored { -1.0 } else { 1.0 };
        let mut target = [0.0; N_OUT];
        for (j, p) in hand.iter().enumerate() {
            let [x, y, z] = p.map(|v| v as f32 / self.scale);
            let x = flip * x;
            target[3 * j] = self.turn[0] * x - self.turn[1] * y - self.numbers[3 * j];
            target[3 * j + 1] = self.turn[1] * x + self.turn[0] * y - self.numbers[3 * j + 1];
            target[3 * j + 2] = z;
        }
        target
    }

    /// Converts the network's `output` (N_OUT numbers; x and y are residuals to the input) to a hand in px in the axes
    /// of the picture, with the wrist at 0.
    pub fn hand(&self, output: &[f32]) -> HandJoints {
        let joint = |j: usize| {
            let (x, y) = (self.numbers[3 * j] + output[3 * j], self.numbers[3 * j + 1] + output[3 * j + 1]);
            let back = self.turn[0] * x + self.turn[1] * y;
            let x = if self.mirrored { -back } else { back };
            let y = -self.turn[1] * (self.numbers[3 * j] + output[3 * j]) + self.turn[0] * y;
            [x, y, output[3 * j + 2]].map(|v| f64::from(v * self.scale))
        };
        let wrist = joint(0);
        std::array::from_fn(|j| {
            let p = joint(j);
            [p[0] - wrist[0], p[1] - wrist[1], p[2] - wrist[2]]
        })
    }
}
