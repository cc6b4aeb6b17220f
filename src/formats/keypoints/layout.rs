//! Point orders: the indices of the 17 COCO points and of the hands in each format. All formats order the points of a
//! hand alike: wrist, then thumb to little finger, each base to tip.

use super::found::FoundPerson;
use orator_base::types::pose2d::{Keypoint, N_BODY, N_HAND};

/// Index of a point that the format lacks.
const NONE: usize = usize::MAX;
/// COCO's own order, with which the longer layouts of this kind begin.
const COCO: [usize; N_BODY] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16];

/// Point order of a person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLayout {
    pub name: &'static str,
    pub n_points: usize,
    /// Indices of the 17 COCO points.
    body: [usize; N_BODY],
    /// Indices of the first points of the left and the right hand.
    hands: Option<[usize; 2]>,
}

/// Layouts of JSON files and arrays, identified by their number of points: COCO-17; OpenPose COCO-18 and BODY_25 (neck, mid-hip
/// and feet are ignored); Halpe-26 and Halpe-136 of AlphaPose; COCO-WholeBody.
pub const JSON_LAYOUTS: [PointLayout; 6] = [
    PointLayout { name: "COCO", n_points: 17, body: COCO, hands: None },
    PointLayout {
        name: "COCO-18 of OpenPose",
        n_points: 18,
        body: [0, 15, 14, 17, 16, 5, 2, 6, 3, 7, 4, 11, 8, 12, 9, 13, 10],
        hands: None,
    },
    PointLayout {
        name: "BODY_25",
        n_points: 25,
        body: [0, 16, 15, 18, 17, 5, 2, 6, 3, 7, 4, 12, 9, 13, 10, 14, 11],
        hands: None,
    },
    PointLayout { name: "Halpe-26", n_points: 26, body: COCO, hands: None },
    PointLayout { name: "COCO-WholeBody", n_points: 133, body: COCO, hands: Some([91, 112]) },
    PointLayout { name: "Halpe-136", n_points: 136, body: COCO, hands: Some([94, 115]) },
];

/// Order of OpenPose's experimental models with 25 points: COCO, upper neck, top of the head, feet.
pub const BODY_25B: PointLayout = PointLayout { name: "BODY_25B", n_points: 25, body: COCO, hands: None };

/// MediaPipe pose landmarks.
pub const MEDIAPIPE: PointLayout = PointLayout {
    name: "MediaPipe",
    n_points: 33,
    body: [0, 2, 5, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28],
    hands: None,
};

/// PATS (Ahuja et al. 2020): neck, right arm, left arm, nose, right eye, left eye, left hand, right hand.
pub const PATS: PointLayout = PointLayout {
    name: "PATS",
    n_points: 52,
    body: [7, 9, 8, NONE, NONE, 4, 1, 5, 2, 6, 3, NONE, NONE, NONE, NONE, NONE, NONE],
    hands: Some([10, 31]),
};

impl PointLayout {
    /// Layout of a person with `n_points` points; the error lists the known numbers of points.
    pub fn for_json(n_points: usize) -> Result<&'static Self, String> {
        JSON_LAYOUTS.iter().find(|layout| layout.n_points == n_points).ok_or_else(|| {
            let known = JSON_LAYOUTS.map(|layout| layout.n_points.to_string()).join(", ");
            format!("{n_points} points per person: expected one of {known}")
        })
    }

    /// Converts `n_points` points to a person; hands that the format stores separately are missing.
    pub fn person(&self, points: &[Keypoint]) -> FoundPerson {
        let at = |index: usize| points.get(index).copied().unwrap_or_default();
        let hand = |side: usize| {
            self.hands.map_or([Keypoint::default(); N_HAND], |first| std::array::from_fn(|k| at(first[side] + k)))
        };
        FoundPerson { body: self.body.map(at), left_hand: hand(0), right_hand: hand(1) }
    }
}
