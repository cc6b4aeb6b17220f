//! Unit tests of `orator_base::types::skeleton`.

use orator_base::types::skeleton::{N_JOINTS, Side, mirror, name, parent, side, swap_authors_order};

#[test]
fn parents_come_before_their_children() {
    for joint in 1..N_JOINTS {
        assert!(parent(joint).is_some_and(|p| p < joint), "{}", name(joint));
    }
}

#[test]
fn mirror_and_authors_order_are_self_inverse() {
    for joint in 0..N_JOINTS {
        assert_eq!(mirror(mirror(joint)), joint);
        assert_eq!(swap_authors_order(swap_authors_order(joint)), joint);
        if let Some(p) = parent(joint) {
            assert_eq!(parent(mirror(joint)), Some(mirror(p)));
        }
    }
    assert_eq!(name(8), "LThumbBase");
    assert_eq!(swap_authors_order(8), 11);
    assert_eq!((name(48).as_str(), side(48)), ("RLittleTip", Side::Right));
}
