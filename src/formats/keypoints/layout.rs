//! Orders of joints: where each format keeps the 17 points of COCO, and where its hands begin. All hands have our order:
//! wrist, then thumb to little finger, each base to tip.

use super::found::FoundPerson;
use orator_base::types::pose2d::{Keypoint, N_BODY, N_HAND};

/// A point that the format does not have.
const NONE: usize = usize::MAX;
/// COCO's own order, which the longer ones begin with.
const COCO: [usize; N_BODY] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16];

/// Order of the points of a person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLayout {
    pub n_points: usize,
    /// Places of the 17 points of COCO.
    body: [usize; N_BODY],
    /// First points of the left and the right hand.
    hands: Option<[usize; 2]>,
}

/// Orders of JSON files, told apart by their number of points: COCO-17; OpenPose's COCO-18 and BODY_25 (neck, middle of the hips
/// and feet are left out); Halpe-26 and Halpe-136 of AlphaPose; COCO-WholeBody.
pub const OF_JSON: [PointLayout; 6] = [
    PointLayout { n_points: 17, body: COCO, hands: None },
    PointLayout { n_points: 18, body: [0, 15, 14, 17, 16, 5, 2, 6, 3, 7, 4, 11, 8, 12, 9, 13, 10], hands: None },
    PointLayout { n_points: 25, body: [0, 16, 15, 18, 17, 5, 2, 6, 3, 7, 4, 12, 9, 13, 10, 14, 11], hands: None },
    PointLayout { n_points: 26, body: COCO, hands: None },
    PointLayout { n_points: 133, body: COCO, hands: Some([91, 112]) },
    PointLayout { n_points: 136, body: COCO, hands: Some([94, 115]) },
];

/// Pose landmarks of MediaPipe.
pub const MEDIAPIPE: PointLayout =
    PointLayout { n_points: 33, body: [0, 2, 5, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28], hands: None };

/// PATS (Ahuja et al. 2020): neck, right arm, left arm, nose, right eye, left eye, left hand, right hand.
pub const PATS: PointLayout = PointLayout {
    n_points: 52,
    body: [7, 9, 8, NONE, NONE, 4, 1, 5, 2, 6, 3, NONE, NONE, NONE, NONE, NONE, NONE],
    hands: Some([10, 31]),
};

impl PointLayout {
    /// Order of a JSON file's person of so many points; the error names those that are known.
    pub fn of_json(n_points: usize) -> Result<&'static Self, String> {
        OF_JSON.iter().find(|layout| layout.n_points == n_points).ok_or_else(|| {
            let known = OF_JSON.map(|layout| layout.n_points.to_string()).join(", ");
            format!("{n_points} points a person; orders of {known} points are known")
        })
    }

    /// The person with these points, `n_points` of them; hands that the format keeps elsewhere are missing.
    pub fn person(&self, points: &[Keypoint]) -> FoundPerson {
        let at = |place: usize| points.get(place).copied().unwrap_or_default();
        let hand = |side: usize| {
            self.hands.map_or([Keypoint::default(); N_HAND], |first| std::array::from_fn(|k| at(first[side] + k)))
        };
        FoundPerson { body: self.body.map(at), left_hand: hand(0), right_hand: hand(1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of the points of OpenPose's two orders, from its table of body parts; of MediaPipe and PATS their own.
    const OPENPOSE_25: &str = "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist MidHip RHip RKnee RAnkle LHip \
                               LKnee LAnkle REye LEye REar LEar LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel";
    const OPENPOSE_18: &str = "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist RHip RKnee RAnkle LHip LKnee \
                               LAnkle REye LEye REar LEar";
    const MEDIAPIPE_33: &str = "Nose LEyeInner LEye LEyeOuter REyeInner REye REyeOuter LEar REar LMouth RMouth LShoulder \
                                RShoulder LElbow RElbow LWrist RWrist LPinky RPinky LIndex RIndex LThumb RThumb LHip \
                                RHip LKnee RKnee LAnkle RAnkle LHeel RHeel LFoot RFoot";
    const PATS_10: &str = "Neck RShoulder RElbow RWrist LShoulder LElbow LWrist Nose REye LEye";
    const COCO_17: &str = "Nose LEye REye LEar REar LShoulder RShoulder LElbow RElbow LWrist RWrist LHip RHip LKnee RKnee \
                           LAnkle RAnkle";

    #[test]
    fn every_order_leads_to_the_point_of_that_name() {
        let wanted: Vec<&str> = COCO_17.split_whitespace().collect();
        let by_count = |n| *PointLayout::of_json(n).unwrap();
        for (layout, names) in [
            (by_count(17), COCO_17),
            (by_count(18), OPENPOSE_18),
            (by_count(25), OPENPOSE_25),
            (MEDIAPIPE, MEDIAPIPE_33),
            (PATS, PATS_10),
        ] {
            let names: Vec<&str> = names.split_whitespace().collect();
            for (k, place) in layout.body.into_iter().enumerate() {
                if place == NONE {
                    assert!(!names.contains(&wanted[k]), "{} has {}", layout.n_points, wanted[k]);
                } else {
                    assert_eq!(names[place], wanted[k], "{} points", layout.n_points);
                }
            }
        }
        // 17 body, 6 feet, 68 face; Halpe has head, neck and hip between body and feet.
        assert_eq!((by_count(133).hands, by_count(136).hands), (Some([17 + 6 + 68, 112]), Some([26 + 68, 115])));
        assert!(PointLayout::of_json(19).unwrap_err().contains("17, 18, 25, 26, 133, 136"));
    }
}
