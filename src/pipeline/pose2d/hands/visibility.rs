//! Visibility of detected hands: a hand model returns 21 points for any crop, even if the hand is hidden or outside
//! the picture. A hand detected at the position of the other is a duplicate; points outside the picture or behind the
//! other hand are not visible, nor is a wrist that the body model placed on the other hand.

use crate::pose2d::decode::ScoredPoint;
use crate::pose2d::hand::DetectedHand;
use orator_base::types::image::Image;
use orator_base::types::pose2d::coco;

/// Two hands whose centres are closer than this, in palm lengths of the larger, are one, and the less certain one is
/// rejected. On rendered persons this rejects 42 of 45 duplicates and 0.5 % of the true hands.
const MIN_DISTANCE: f64 = 0.65;
/// Score from which a hand is accepted even so: hands that touch without occlusion.
const CERTAIN_SCORE: f64 = 0.95;
/// Least number of points inside the picture; `lift` requires as many.
const MIN_POINTS: usize = 12;
/// A wrist with at most this score, and within this many shoulder widths of the other hand's wrist, belongs to that
/// hand if its own hand is not detected. At 0.3, true wrists of hands resting beside each other would be affected.
const MAX_WRIST_SCORE: f64 = 0.5;
const MAX_WRIST_DISTANCE: f64 = 0.15;

/// Visible hands of a frame, left and right.
#[derive(Clone, Debug)]
pub struct VisibleHands {
    pub hands: [Option<DetectedHand>; 2],
    /// Whether the detection was a duplicate of the other hand.
    pub others: [bool; 2],
}

impl VisibleHands {
    /// Determines the visibility of detected hands. Invisible points of `hands` and wrists of `body` get the score 0.
    pub fn judge(mut hands: [Option<DetectedHand>; 2], body: &mut [ScoredPoint; 17], image: &Image) -> Self {
        let mut others = [false; 2];
        if let [Some(left), Some(right)] = &hands {
            let uncertain = usize::from(right.score < left.score);
            // On a tie, the left hand counts as the less certain one.
            let (weaker, stronger) = if uncertain == 0 { (left, right) } else { (right, left) };
            let separation = distance(centre(weaker), centre(stronger)) / palm(weaker).max(palm(stronger)).max(1.0);
            if separation < MIN_DISTANCE && weaker.score < CERTAIN_SCORE {
                hands[uncertain] = None;
                others[uncertain] = true;
            } else {
                let outline = stronger.positions();
                let behind = |point: &ScoredPoint| is_inside([point[0], point[1]], &outline);
                let hidden: Vec<usize> = (0..21).filter(|&i| behind(&weaker.points[i])).collect();
                if let Some(weaker) = &mut hands[uncertain] {
                    for i in hidden {
                        weaker.points[i][2] = 0.0;
                    }
                }
            }
        }
        for hand in &mut hands {
            hand.take_if(|hand| {
                let mut n_inside = 0;
                for point in &mut hand.points {
                    if is_in_picture(*point, image) {
                        n_inside += 1;
                    } else {
                        point[2] = 0.0;
                    }
                }
                n_inside < MIN_POINTS
            });
        }
        for wrist in [coco::L_WRIST, coco::R_WRIST] {
            if !is_in_picture(body[wrist], image) {
                body[wrist][2] = 0.0;
            }
        }
        (0..2).for_each(|side| hide_misplaced_wrist(side, &hands, body));
        Self { hands, others }
    }
}

fn hide_misplaced_wrist(side: usize, hands: &[Option<DetectedHand>; 2], body: &mut [ScoredPoint; 17]) {
    let (None, Some(other)) = (&hands[side], &hands[1 - side]) else { return };
    let shoulders = distance(body[coco::L_SHOULDER], body[coco::R_SHOULDER]);
    let wrist = &mut body[[coco::L_WRIST, coco::R_WRIST][side]];
    if wrist[2] <= MAX_WRIST_SCORE && distance(*wrist, other.points[0]) < MAX_WRIST_DISTANCE * shoulders {
        wrist[2] = 0.0;
    }
}

fn is_in_picture([x, y, _]: ScoredPoint, image: &Image) -> bool {
    (0.0..image.width as f64).contains(&x) && (0.0..image.height as f64).contains(&y)
}

/// Whether `point` lies inside the convex hull of `points`: outside, all points lie within a half-plane of directions.
fn is_inside(point: [f64; 2], points: &[[f64; 2]; 21]) -> bool {
    let mut angles = points.map(|[x, y]| (y - point[1]).atan2(x - point[0]));
    angles.sort_by(f64::total_cmp);
    let around = angles[0] + std::f64::consts::TAU - angles[20];
    angles.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max) < std::f64::consts::PI
}

/// Palm length in px: wrist to middle knuckle, or 1.2 times the palm width if that is larger (foreshortening).
fn palm(hand: &DetectedHand) -> f64 {
    let length = |a: usize, b: usize| distance(hand.points[a], hand.points[b]);
    length(0, 9).max(1.2 * length(5, 17))
}

/// Mean of the points of a hand.
pub fn centre(hand: &DetectedHand) -> ScoredPoint {
    let sum = hand.points.iter().fold([0.0; 2], |sum, point| [sum[0] + point[0], sum[1] + point[1]]);
    [sum[0] / 21.0, sum[1] / 21.0, 0.0]
}

pub fn distance(a: ScoredPoint, b: ScoredPoint) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
