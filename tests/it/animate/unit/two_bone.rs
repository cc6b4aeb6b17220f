//! Unit tests of `orator_avatar::animate::retarget::two_bone`.

use orator_avatar::animate::retarget::two_bone::solve_two_bone;
use orator_base::math::vec3::dot;
use orator_base::math::vec3::{across, norm, sub, unit};

#[test]
fn the_end_reaches_its_target_and_bones_keep_their_length() {
    let (from, elbow) = ([1.0, 2.0, 3.0], [1.3, 1.0, 2.0]);
    for (to, lengths) in [([2.0, 2.5, 3.0], [1.0, 1.2]), ([1.1, 2.0, 3.0], [1.0, 0.95]), ([9.0, 2.0, 3.0], [1.0, 1.0])]
    {
        let [middle, end] = solve_two_bone(from, elbow, to, lengths);
        assert!((norm(sub(middle, from)) - lengths[0]).abs() < 1e-9);
        assert!((norm(sub(end, middle)) - lengths[1]).abs() < 1e-6);
        let is_near = norm(sub(to, from)) < lengths[0] + lengths[1];
        assert!(!is_near || norm(sub(end, to)) < 1e-9);
        assert!(dot(sub(middle, from), across(sub(elbow, from), unit(sub(to, from), 0.0).unwrap())) > 0.0);
    }
}
