//! Views of the hands.

use orator_base::motion::view::hand::{HandJoints, HandPoints, HandView};
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;

fn spread_hand() -> HandJoints {
    std::array::from_fn(|j| {
        let (finger, phalanx) = (j.div_ceil(4), (j + 3) % 4);
        if j == 0 { [0.0; 3] } else { [10.0 * finger as f64 - 25.0, -40.0 - 12.0 * phalanx as f64, 3.0 * j as f64] }
    })
}

fn observed(hand: &HandJoints, angle: f32) -> HandPoints {
    hand.map(|[x, y, _]| {
        let (x, y) = (x as f32, y as f32);
        Some([100.0 + angle.cos() * x - angle.sin() * y, 50.0 + angle.sin() * x + angle.cos() * y])
    })
}

#[test]
fn the_view_is_normalised_and_invertible() {
    let hand = spread_hand();
    let upright = HandView::new(&observed(&hand, 0.0), Side::Right).unwrap();
    let turned = HandView::new(&observed(&hand.map(|p| p.map(|v| 3.0 * v)), 2.0), Side::Right).unwrap();
    assert!(upright.numbers.iter().zip(&turned.numbers).all(|(a, b)| (a - b).abs() < 1e-4));
    for side in [Side::Left, Side::Right] {
        let view = HandView::new(&observed(&hand, 0.0), side).unwrap();
        let back = view.hand(&view.target(&hand));
        let worst = (0..N_HAND).flat_map(|j| (0..3).map(move |k| (j, k))).map(|(j, k)| (back[j][k] - hand[j][k]).abs());
        assert!(worst.fold(0.0, f64::max) < 1e-3);
    }
}

#[test]
fn a_left_hand_equals_the_mirrored_right_hand() {
    let right = HandView::new(&observed(&spread_hand(), 0.3), Side::Right).unwrap();
    let mirrored = observed(&spread_hand(), 0.3).map(|p| p.map(|[x, y]| [640.0 - x, y]));
    let left = HandView::new(&mirrored, Side::Left).unwrap();
    assert!(right.numbers.iter().zip(&left.numbers).all(|(a, b)| (a - b).abs() < 1e-4));
}

#[test]
fn too_few_points_give_no_view() {
    assert!(HandView::new(&[None; N_HAND], Side::Left).is_none());
    assert!(HandView::new(&[Some([5.0, 5.0]); N_HAND], Side::Left).is_none());
    let mut one = [None; N_HAND];
    one[0] = Some([1.0, 1.0]);
    assert!(HandView::new(&one, Side::Left).is_none());
}
