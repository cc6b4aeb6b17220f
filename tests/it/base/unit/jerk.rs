//! Unit tests of `orator_base::motion::jerk`.

use ndarray::{Array2, Array3};
use orator_base::motion::jerk::mean;

#[test]
fn jerk_of_a_cubic_is_exact_and_gaps_are_ignored() {
    let positions = Array3::from_shape_fn((12, 2, 3), |(t, joint, axis)| {
        let secs = t as f32 / 15.0;
        if joint == 1 && axis == 2 { 2.0 * secs * secs * secs } else { 0.1 }
    });
    let mut visible = Array2::from_elem((12, 2), true);
    let jerk = |visible: &Array2<bool>| mean(positions.view(), visible.view(), 15.0, &[(1, 0)]);
    assert!((jerk(&visible).unwrap() - 12.0).abs() < 0.05);
    visible[[5, 1]] = false;
    assert!((jerk(&visible).unwrap() - 12.0).abs() < 0.05);
    visible.fill(false);
    assert_eq!(jerk(&visible), None);
}
