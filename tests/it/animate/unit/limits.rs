//! Unit tests of `orator_avatar::animate::rig::limits`.

use orator_avatar::animate::rig::limits::clamp_circular;

#[test]
fn clamping_keeps_inner_angles_and_is_continuous() {
    let range = [-20.0, 90.0];
    for (given, expected) in [(-20.0, -20.0), (0.0, 0.0), (90.0, 90.0), (120.0, 90.0), (-60.0, -20.0), (380.0, 20.0)] {
        assert!((clamp_circular(range, given) - expected).abs() < 1e-9, "{given}");
    }
    let mut last = clamp_circular(range, -180.0);
    for step in -18_000..=18_000 {
        let now = clamp_circular(range, f64::from(step) / 100.0);
        assert!((now - last).abs() < 0.05 && (-20.0..=90.0).contains(&now));
        assert_eq!(clamp_circular(range, now), now);
        last = now;
    }
}
