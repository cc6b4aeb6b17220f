//! Unit tests of `orator_formats::mocap::ted`.

use orator_base::types::skeleton::Side;
use orator_formats::mocap::ted::hand;

#[test]
fn hand_joints_are_mapped_without_tips() {
    assert_eq!((hand(Side::Left)[17], hand(Side::Right)[1]), (Some(14), Some(35)));
    assert!([4, 8, 12, 16, 20].iter().all(|&tip| hand(Side::Left)[tip].is_none()));
}
