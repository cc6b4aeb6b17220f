//! Tests of `orator_avatar::animate::solve::smoothing`.

use orator_avatar::animate::solve::smoothing::{Filter, Smoothing};
use orator_base::math::vec3::Vec3;
use orator_base::types::time::FrameRate;

#[test]
fn gaps_separate_runs_and_the_window_has_constant_duration() {
    let mut track: Vec<Option<Vec3>> = (0..40).map(|t| Some([1.0, f64::from(t % 2), 0.0])).collect();
    track[20] = None;
    track[21..].iter_mut().flatten().for_each(|v| v[2] = 100.0);
    let fps = FrameRate::new(15, 1);
    for smoothing in [Smoothing::default(), Smoothing::SavitzkyGolay] {
        let mut track = track.clone();
        smoothing.arms(fps).runs(&mut track, &[]);
        assert!(track[20].is_none());
        assert!(track[..20].iter().flatten().all(|v| v[2].abs() < 1e-9));
        assert!(track[21..].iter().flatten().all(|v| (v[2] - 100.0).abs() < 1e-9));
    }
    let window = |rate: u32| match Smoothing::SavitzkyGolay.arms(FrameRate::new(rate, 1)) {
        Filter::Polynomial(filter) => filter.window(),
        _ => 0,
    };
    assert_eq!([15, 30, 60].map(window), [9, 17, 33]);
}
