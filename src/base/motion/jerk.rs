//! Jerk: the third difference of positions over time.

use ndarray::{ArrayView2, ArrayView3};

/// Mean norm of the jerk (m/s^3) of `joints` in `places` [T, n, 3] of `fps` frames a second, each joint taken relative
/// to the second of its pair (give the root for none). Counted where `seen` [T, n] says so of all four frames of both;
/// `None` where that is never so.
pub fn mean(places: ArrayView3<f32>, seen: ArrayView2<bool>, fps: f64, joints: &[(usize, usize)]) -> Option<f64> {
    let (mut sum, mut n) = (0.0, 0usize);
    for start in 0..places.shape()[0].saturating_sub(3) {
        for &(joint, origin) in joints {
            if !(start..start + 4).all(|t| seen[[t, joint]] && seen[[t, origin]]) {
                continue;
            }
            let squares = (0..3).map(|axis| {
                let at = |t: usize| {
                    f64::from(places[[start + t, joint, axis]]) - f64::from(places[[start + t, origin, axis]])
                };
                (at(3) - 3.0 * at(2) + 3.0 * at(1) - at(0)).powi(2)
            });
            sum += squares.sum::<f64>().sqrt();
            n += 1;
        }
    }
    (n > 0).then(|| sum / n as f64 * fps.powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Array3};

    #[test]
    fn a_cubic_has_its_own_jerk_and_gaps_do_not_count() {
        let places = Array3::from_shape_fn((12, 2, 3), |(t, joint, axis)| {
            let secs = t as f32 / 15.0;
            if joint == 1 && axis == 2 { 2.0 * secs * secs * secs } else { 0.1 }
        });
        let mut seen = Array2::from_elem((12, 2), true);
        let jerk = |seen: &Array2<bool>| mean(places.view(), seen.view(), 15.0, &[(1, 0)]);
        assert!((jerk(&seen).unwrap() - 12.0).abs() < 0.05);
        seen[[5, 1]] = false;
        assert!((jerk(&seen).unwrap() - 12.0).abs() < 0.05);
        seen.fill(false);
        assert_eq!(jerk(&seen), None);
    }
}
