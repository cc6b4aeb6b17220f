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

#[cfg(test)]
mod tests {
    use super::*;

    /// Point names in OpenPose's two layouts, from its table of body parts; for MediaPipe and PATS their own.
    const OPENPOSE_25: &str = "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist MidHip RHip RKnee RAnkle LHip \
                               LKnee LAnkle REye LEye REar LEar LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel";
    const OPENPOSE_18: &str = "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist RHip RKnee RAnkle LHip LKnee \
                               LAnkle REye LEye REar LEar";
    const BODY_25B_NAMES: &str = "Nose LEye REye LEar REar LShoulder RShoulder LElbow RElbow LWrist RWrist LHip RHip \
                                  LKnee RKnee LAnkle RAnkle UpperNeck HeadTop LBigToe LSmallToe LHeel RBigToe \
                                  RSmallToe RHeel";
    const MEDIAPIPE_33: &str = "Nose LEyeInner LEye LEyeOuter REyeInner REye REyeOuter LEar REar LMouth RMouth LShoulder \
                                RShoulder LElbow RElbow LWrist RWrist LPinky RPinky LIndex RIndex LThumb RThumb LHip \
                                RHip LKnee RKnee LAnkle RAnkle LHeel RHeel LFoot RFoot";
    const PATS_10: &str = "Neck RShoulder RElbow RWrist LShoulder LElbow LWrist Nose REye LEye";
    const COCO_17: &str = "Nose LEye REye LEar REar LShoulder RShoulder LElbow RElbow LWrist RWrist LHip RHip LKnee RKnee \
                           LAnkle RAnkle";

    #[test]
    fn layouts_map_to_points_of_the_same_name() {
        let wanted: Vec<&str> = COCO_17.split_whitespace().collect();
        let by_count = |n| *PointLayout::for_json(n).unwrap();
        for (layout, names) in [
            (by_count(17), COCO_17),
            (by_count(18), OPENPOSE_18),
            (by_count(25), OPENPOSE_25),
            (BODY_25B, BODY_25B_NAMES),
            (MEDIAPIPE, MEDIAPIPE_33),
            (PATS, PATS_10),
        ] {
            let names: Vec<&str> = names.split_whitespace().collect();
            for (k, index) in layout.body.into_iter().enumerate() {
                if index == NONE {
                    assert!(!names.contains(&wanted[k]), "{} has {}", layout.n_points, wanted[k]);
                } else {
                    assert_eq!(names[index], wanted[k], "{} points", layout.n_points);
                }
            }
        }
        // 17 body, 6 feet, 68 face; Halpe has head, neck and hip between body and feet.
        assert_eq!((by_count(133).hands, by_count(136).hands), (Some([17 + 6 + 68, 112]), Some([26 + 68, 115])));
        assert!(PointLayout::for_json(19).unwrap_err().contains("17, 18, 25, 26, 133, 136"));
    }
}
