//! Unit tests of `orator_avatar::animate::avatar::jaw`.

use orator_avatar::animate::avatar::jaw::{jaw_share, opening};
use orator_base::math::vec3::Vec3;

#[test]
fn the_chin_drops_and_the_upper_face_stays() {
    let displacement = |at: Vec3| opening(at, jaw_share(at));
    assert!(displacement([0.0, 1.0, 8.5])[1] < -2.0 && displacement([0.0, 3.8, 9.5])[1] < -2.2);
    for fixed in [[0.0, 5.4, 9.5], [3.1, 10.5, 8.5], [0.0, -5.0, 4.0], [7.5, 9.6, 0.0], [0.0, 5.0, -7.0]] {
        assert!(displacement(fixed)[1].abs() < 0.02, "{fixed:?}");
    }
    let cheeks = [6.0, 5.0, 4.4, 4.0, 3.0].map(|y| displacement([4.0, y, 7.0])[1]);
    assert!(cheeks.windows(2).all(|pair| pair[1] < pair[0]));
}
