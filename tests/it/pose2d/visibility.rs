//! Visibility of hands.

use orator_base::types::image::Image;
use orator_base::types::pose2d::coco;
use orator_pipeline::pose2d::decode::ScoredPoint;
use orator_pipeline::pose2d::hand::DetectedHand;
use orator_pipeline::pose2d::hands::visibility::VisibleHands;

/// An upright hand 40 px wide and 80 px high with its wrist at `x`, `y`.
fn hand(x: f64, y: f64, score: f64) -> Option<DetectedHand> {
    let point = |i: usize| match i {
        0 => [x, y, score],
        _ => [x - 20.0 + 10.0 * ((i - 1) / 4) as f64, y - 20.0 - 15.0 * (1 + (i - 1) % 4) as f64, score],
    };
    Some(DetectedHand { points: std::array::from_fn(point), score, right: None, depth: None })
}

fn body() -> [ScoredPoint; 17] {
    let mut body = [[0.0; 3]; 17];
    body[coco::L_SHOULDER] = [300.0, 100.0, 0.9];
    body[coco::R_SHOULDER] = [100.0, 100.0, 0.9];
    body[coco::L_WRIST] = [300.0, 300.0, 0.9];
    body[coco::R_WRIST] = [100.0, 300.0, 0.9];
    body
}

fn visibility(hands: [Option<DetectedHand>; 2], body: &mut [ScoredPoint; 17]) -> ([Option<usize>; 2], [bool; 2]) {
    let visible = VisibleHands::judge(hands, body, &Image::filled(400, 400, [0; 3]));
    let n_visible = |hand: &DetectedHand| hand.points.iter().filter(|point| point[2] > 0.0).count();
    (visible.hands.each_ref().map(|hand| hand.as_ref().map(n_visible)), visible.others)
}

#[test]
fn the_less_certain_of_two_hands_in_one_position_is_a_duplicate() {
    let visible_points = |left, right| visibility([left, right], &mut body());
    assert_eq!(visible_points(hand(300.0, 300.0, 0.9), hand(100.0, 300.0, 0.99)), ([Some(21); 2], [false; 2]));
    assert_eq!(visible_points(hand(110.0, 300.0, 0.8), hand(100.0, 300.0, 0.99)), ([None, Some(21)], [true, false]));
    assert_eq!(visible_points(hand(110.0, 300.0, 0.9), hand(100.0, 300.0, 0.7)), ([Some(21), None], [false, true]));
    let (both, others) = visible_points(hand(110.0, 300.0, 0.97), hand(100.0, 300.0, 0.99));
    assert!(both[0].is_some() && others == [false; 2], "both are sure");
}

#[test]
fn points_behind_the_other_hand_or_outside_the_image_are_invisible() {
    let left = visibility([hand(130.0, 290.0, 0.96), hand(100.0, 300.0, 0.99)], &mut body()).0;
    assert!(left[0].is_some_and(|n| (12..21).contains(&n)) && left[1] == Some(21), "{left:?}");
    let visible_points = |y: f64| visibility([hand(300.0, y, 0.9), None], &mut body()).0[0];
    assert_eq!((visible_points(399.0), visible_points(421.0), visible_points(445.0)), (Some(21), Some(20), Some(15)));
    assert_eq!(visible_points(470.0), None, "five points are no hand");
}

#[test]
fn an_uncertain_wrist_on_the_other_hand_is_hidden() {
    let mut body = body();
    body[coco::L_WRIST] = [120.0, 290.0, 0.4];
    visibility([None, hand(100.0, 300.0, 0.99)], &mut body);
    assert_eq!(body[coco::L_WRIST][2], 0.0);
    body[coco::L_WRIST][2] = 0.8;
    visibility([None, hand(100.0, 300.0, 0.99)], &mut body);
    assert_eq!(body[coco::L_WRIST][2], 0.8, "a sure wrist may lie there");
    body[coco::L_WRIST] = [300.0, 290.0, 0.4];
    visibility([None, hand(100.0, 300.0, 0.99)], &mut body);
    assert_eq!(body[coco::L_WRIST][2], 0.4, "far from the other hand");
}
