//! The 21 points of a hand as the hand lifter sees them. Training and lifting meet here: a left hand is seen in the
//! mirror as a right one, the wrist lies at the origin, the palm points up, and the spread of the points is 1.

use crate::math::vec3::Vec3;
use crate::types::pose2d::N_HAND;
use crate::types::skeleton::Side;

/// Keypoints of a hand in px, wrist first, then thumb to little finger, each base to tip; `None`: not seen.
pub type SeenHand = [Option<[f32; 2]>; N_HAND];
/// A hand in camera axes, the wrist at the origin.
pub type HandJoints = [Vec3; N_HAND];

/// Numbers in: x, y and whether it was seen, a point.
pub const N_IN: usize = 3 * N_HAND;
/// Numbers out: x, y, z a point.
pub const N_OUT: usize = 3 * N_HAND;

/// First joints of the four fingers.
const KNUCKLES: [usize; 4] = [5, 9, 13, 17];

/// The joint a hand's joint hangs on; the wrist's is itself.
pub const fn parent(joint: usize) -> usize {
    if joint % 4 == 1 { 0 } else { joint.saturating_sub(1) }
}

/// A hand as the network sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct HandView {
    /// x, y, seen for each point.
    pub numbers: [f32; N_IN],
    /// px that are 1 in `numbers`.
    pub scale: f32,
    /// cos and sin of the turn from the picture to the view.
    turn: [f32; 2],
    mirrored: bool,
}

impl HandView {
    /// The view of one hand of that side. A point not seen lies on the wrist. `None` when the wrist or all knuckles
    /// are not seen, or everything is one spot.
    pub fn new(seen: &SeenHand, side: Side) -> Option<Self> {
        let mirrored = side == Side::Left;
        let wrist = seen[0]?;
        let flip = if mirrored { -1.0 } else { 1.0 };
        let points = seen.map(|p| p.map(|[x, y]| [flip * (x - wrist[0]), y - wrist[1]]));
        let mean = |points: &[[f32; 2]]| [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f32>() / points.len() as f32);
        let knuckles: Vec<[f32; 2]> = KNUCKLES.iter().filter_map(|&j| points[j]).collect();
        let there: Vec<[f32; 2]> = points.iter().flatten().copied().collect();
        if knuckles.is_empty() {
            return None;
        }
        let ([px, py], centre) = (mean(&knuckles), mean(&there));
        let spread = there.iter().map(|p| (p[0] - centre[0]).powi(2) + (p[1] - centre[1]).powi(2)).sum::<f32>();
        let scale = (spread / there.len() as f32).sqrt();
        if !(scale > 1e-6 && scale.is_finite()) {
            return None;
        }
        // the turn that brings the palm (px, py) to (0, -1)
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

    /// A hand given in the axes of the picture (px, wrist at 0) as it lies in the view: what the network should say.
    pub fn wanted(&self, hand: &HandJoints) -> [f32; N_OUT] {
        let flip = if self.mirrored { -1.0 } else { 1.0 };
        let mut wanted = [0.0; N_OUT];
        for (j, p) in hand.iter().enumerate() {
            let [x, y, z] = p.map(|v| v as f32 / self.scale);
            let x = flip * x;
            wanted[3 * j] = self.turn[0] * x - self.turn[1] * y - self.numbers[3 * j];
            wanted[3 * j + 1] = self.turn[1] * x + self.turn[0] * y - self.numbers[3 * j + 1];
            wanted[3 * j + 2] = z;
        }
        wanted
    }

    /// The hand in px, in the axes of the picture, from the network's `output` (N_OUT numbers): x and y are what it
    /// adds to the input.
    pub fn hand(&self, output: &[f32]) -> HandJoints {
        let place = |j: usize| {
            let (x, y) = (self.numbers[3 * j] + output[3 * j], self.numbers[3 * j + 1] + output[3 * j + 1]);
            let back = self.turn[0] * x + self.turn[1] * y;
            let x = if self.mirrored { -back } else { back };
            let y = -self.turn[1] * (self.numbers[3 * j] + output[3 * j]) + self.turn[0] * y;
            [x, y, output[3 * j + 2]].map(|v| f64::from(v * self.scale))
        };
        let wrist = place(0);
        std::array::from_fn(|j| {
            let p = place(j);
            [p[0] - wrist[0], p[1] - wrist[1], p[2] - wrist[2]]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spread_hand() -> HandJoints {
        std::array::from_fn(|j| {
            let (finger, phalanx) = (j.div_ceil(4), (j + 3) % 4);
            if j == 0 { [0.0; 3] } else { [10.0 * finger as f64 - 25.0, -40.0 - 12.0 * phalanx as f64, 3.0 * j as f64] }
        })
    }

    fn seen(hand: &HandJoints, angle: f32) -> SeenHand {
        hand.map(|[x, y, _]| {
            let (x, y) = (x as f32, y as f32);
            Some([100.0 + angle.cos() * x - angle.sin() * y, 50.0 + angle.sin() * x + angle.cos() * y])
        })
    }

    #[test]
    fn a_view_forgets_place_turn_and_size_and_gives_them_back() {
        let hand = spread_hand();
        let upright = HandView::new(&seen(&hand, 0.0), Side::Right).unwrap();
        let turned = HandView::new(&seen(&hand.map(|p| p.map(|v| 3.0 * v)), 2.0), Side::Right).unwrap();
        assert!(upright.numbers.iter().zip(&turned.numbers).all(|(a, b)| (a - b).abs() < 1e-4));
        for side in [Side::Left, Side::Right] {
            let view = HandView::new(&seen(&hand, 0.0), side).unwrap();
            let back = view.hand(&view.wanted(&hand));
            let worst =
                (0..N_HAND).flat_map(|j| (0..3).map(move |k| (j, k))).map(|(j, k)| (back[j][k] - hand[j][k]).abs());
            assert!(worst.fold(0.0, f64::max) < 1e-3);
        }
    }

    #[test]
    fn a_left_hand_is_a_right_hand_in_the_mirror() {
        let right = HandView::new(&seen(&spread_hand(), 0.3), Side::Right).unwrap();
        let mirrored = seen(&spread_hand(), 0.3).map(|p| p.map(|[x, y]| [640.0 - x, y]));
        let left = HandView::new(&mirrored, Side::Left).unwrap();
        assert!(right.numbers.iter().zip(&left.numbers).all(|(a, b)| (a - b).abs() < 1e-4));
    }

    #[test]
    fn no_hand_no_view() {
        assert!(HandView::new(&[None; N_HAND], Side::Left).is_none());
        assert!(HandView::new(&[Some([5.0, 5.0]); N_HAND], Side::Left).is_none());
        let mut one = [None; N_HAND];
        one[0] = Some([1.0, 1.0]);
        assert!(HandView::new(&one, Side::Left).is_none());
    }
}
