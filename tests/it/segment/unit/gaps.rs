//! Unit tests of `orator_pipeline::lift::gaps`.

use ndarray::Array3;
use orator_pipeline::lift::gaps::{bridge, hold_ends, long_gaps};

#[test]
fn only_long_gaps_remain_open() {
    let visible = [false, true, false, false, true, false, false, false];
    assert_eq!(long_gaps(&visible, 2), [false, false, false, false, false, true, true, true]);
    assert_eq!(long_gaps(&visible, 0), visible.map(|s| !s));
    assert!(long_gaps(&[], 3).is_empty());
}

#[test]
fn short_gaps_are_bridged_and_short_ends_held() {
    const NO: f32 = f32::NAN;
    let numbers = [NO, 1.0, NO, NO, 4.0, NO, NO, NO, 6.0, NO, NO, NO];
    let mut track = Array3::from_shape_fn((numbers.len(), 1, 2), |(t, _, k)| numbers[t] * (k + 1) as f32);
    let first = |track: &Array3<f32>| track.iter().step_by(2).map(|v| format!("{v}")).collect::<Vec<_>>().join(" ");
    bridge(track.view_mut(), 2);
    assert_eq!(first(&track), "NaN 1 2 3 4 NaN NaN NaN 6 NaN NaN NaN");
    hold_ends(track.view_mut(), 2);
    assert_eq!(first(&track), "1 1 2 3 4 NaN NaN NaN 6 NaN NaN NaN");
    assert_eq!(track[[2, 0, 1]], 4.0);
    bridge(Array3::zeros((0, 1, 2)).view_mut(), 2);
    hold_ends(Array3::from_elem((3, 1, 2), NO).view_mut(), 9);
}
