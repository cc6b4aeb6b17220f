//! Tests of `orator_gesture::evaluate::baseline::baselines`.

use orator_gesture::evaluate::baseline::baselines::back_and_forth;

#[test]
fn a_short_motion_is_played_back_and_forth() {
    let walk = |n: usize| (0..8).map(|t| back_and_forth(t, n)).collect::<Vec<_>>();
    assert_eq!(walk(3), [0, 1, 2, 1, 0, 1, 2, 1]);
    assert_eq!(walk(1), [0; 8]);
    assert_eq!(walk(9), [0, 1, 2, 3, 4, 5, 6, 7]);
}
