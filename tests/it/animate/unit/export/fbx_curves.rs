//! Tests of `orator_avatar::animate::export::fbx::curves`.

use orator_avatar::animate::export::fbx::curves::degrees;
use orator_base::math::rotation::Rotation;

#[test]
fn angles_stay_continuous_through_half_turns_and_gimbal_lock() {
    let given: Vec<Rotation> = (0..60)
        .map(|t| {
            let share = f64::from(t) / 59.0;
            let turned = Rotation::about([0.0, 0.0, 1.0], 7.0 * share);
            turned * Rotation::about([0.0, 1.0, 0.0], 3.0 * share) * Rotation::about([1.0, 0.0, 0.0], 0.3)
        })
        .collect();
    let found = degrees(given.iter().copied());
    for (t, (angles, rotation)) in found.iter().zip(&given).enumerate() {
        let [x, y, z] = angles.map(f64::to_radians);
        let again = Rotation::from_euler([2, 1, 0], [z, y, x]);
        assert!((again.inverse() * *rotation).angle() < 1e-6);
        let step = found.get(t + 1).map_or(0.0, |next| (0..3).map(|k| (next[k] - angles[k]).abs()).fold(0.0, f64::max));
        assert!(step < 8.0, "{t}: {step}");
    }
    assert!(found[59][2] > 390.0);
}
