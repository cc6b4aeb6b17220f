//! Unit tests of `orator_base::motion::exponential_map`.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, norm, scale, sub};
use orator_base::motion::exponential_map::make_continuous;

#[test]
fn a_rotation_past_180_degrees_and_back_has_no_jump() {
    let axis = [0.6, 0.0, 0.8];
    let angle = |t: usize| 2.5 + 1.2 * (t as f64 * 0.1).sin();
    let mut track: Vec<Vec3> = (0..100).map(|t| Rotation::about(axis, angle(t)).rotation_vector()).collect();
    let widest = |track: &[Vec3]| track.windows(2).map(|pair| norm(sub(pair[1], pair[0]))).fold(0.0, f64::max);
    assert!(widest(&track) > 5.0);
    make_continuous(&mut track);
    assert!(widest(&track) < 0.13, "{}", widest(&track));
    for (t, vector) in track.iter().enumerate() {
        assert!(norm(sub(*vector, scale(axis, angle(t)))) < 1e-9, "{t}");
    }
}

#[test]
fn a_continuous_track_is_unchanged() {
    let mut track: Vec<Vec3> = (0..50).map(|t| [0.02 * f64::from(t), 0.3, -0.1]).collect();
    let before = track.clone();
    make_continuous(&mut track);
    make_continuous(&mut []);
    assert_eq!(track, before);
}
