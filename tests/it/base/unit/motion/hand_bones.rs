//! Tests of `orator_base::motion::hand_bones`.

use orator_base::math::vec3;
use orator_base::motion::hand_bones::{PHALANX, relaxed};

#[test]
fn the_relaxed_hand_has_the_reference_size() {
    let hand = relaxed();
    assert!((vec3::norm(vec3::sub(hand[10], hand[9])) - PHALANX).abs() < 1e-12);
    assert!(hand[5][0] > hand[17][0] && hand[4][0] > hand[5][0] && hand[12][2] < 0.0);
}
