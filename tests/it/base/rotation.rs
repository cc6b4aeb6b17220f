//! Rotations: conversions, averages and interpolation.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, any_across, dot, norm, scale, sub};
use rand::{Rng, SeedableRng};

fn close(a: Vec3, b: Vec3) -> bool {
    norm(sub(a, b)) < 1e-9
}

fn from_euler_zxy_degrees([z, x, y]: Vec3) -> Rotation {
    Rotation::about([0.0, 0.0, 1.0], z.to_radians())
        * Rotation::about([1.0, 0.0, 0.0], x.to_radians())
        * Rotation::about([0.0, 1.0, 0.0], y.to_radians())
}

fn directions() -> Vec<Vec3> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut all: Vec<Vec3> = (0..40)
        .map(|_| [0; 3].map(|_| random.random_range(-1.0..1.0)))
        .filter_map(|a| orator_base::math::vec3::unit(a, 0.1))
        .collect();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let mut a = [0.0; 3];
            a[axis] = sign;
            all.push(a);
        }
    }
    all
}

fn rotations() -> Vec<Rotation> {
    let angles = [0.0, 1e-10, 0.3, 1.5, 3.0, std::f64::consts::PI, -2.0];
    directions().into_iter().flat_map(|axis| angles.map(|angle| Rotation::about(axis, angle))).collect()
}

#[test]
fn between_maps_one_direction_to_the_other_even_if_opposite() {
    for a in directions() {
        for b in directions().into_iter().chain([a, scale(a, -1.0)]) {
            let r = Rotation::between(a, b);
            assert!(close(r.turn(a), b));
            assert!((r.angle() - dot(a, b).clamp(-1.0, 1.0).acos()).abs() < 1e-6);
        }
        // Almost opposite directions.
        let b = orator_base::math::vec3::unit(add(scale(a, -1.0), scale(any_across(a), 1e-7)), 0.0).unwrap();
        assert!(norm(sub(Rotation::between(a, b).turn(a), b)) < 1e-7);
    }
}

#[test]
fn axes_and_euler_angles_reproduce_the_rotation() {
    for r in rotations() {
        let [x, y, z] = r.axes();
        let same = Rotation::from_axes(x, y, z);
        let euler = from_euler_zxy_degrees(r.euler_zxy_degrees());
        for a in [[1.0, 0.0, 0.0], [0.3, -0.5, 0.8]] {
            assert!(close(same.turn(a), r.turn(a)));
            assert!(norm(sub(euler.turn(a), r.turn(a))) < 1e-8, "{r:?} {:?}", r.euler_zxy_degrees());
        }
    }
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for r in rotations() {
            let back = Rotation::from_euler(order, r.euler(order));
            assert!(norm(sub(back.turn([0.3, -0.5, 0.8]), r.turn([0.3, -0.5, 0.8]))) < 1e-8, "{order:?} {r:?}");
        }
    }
    // Known result: a quarter turn about y maps z to x.
    assert!(close(from_euler_zxy_degrees([0.0, 0.0, 90.0]).turn([0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]));
}

#[test]
fn the_exponential_map_reproduces_the_rotation() {
    for r in rotations() {
        let vector = r.rotation_vector();
        assert!(norm(vector) <= std::f64::consts::PI + 1e-12);
        // The complementary vector in the opposite direction, beyond half a turn, is the same rotation.
        let other = match norm(vector) {
            angle if angle > 0.1 => scale(vector, (angle - std::f64::consts::TAU) / angle),
            _ => vector,
        };
        for back in [vector, other].map(Rotation::from_rotation_vector) {
            assert!(close(back.turn([0.3, -0.5, 0.8]), r.turn([0.3, -0.5, 0.8])), "{r:?}");
        }
    }
    assert!(close(Rotation::about([0.0, 0.0, 1.0], 0.7).rotation_vector(), [0.0, 0.0, 0.7]));
}

#[test]
fn swing_times_twist_is_the_rotation() {
    for r in rotations() {
        for axis in [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]] {
            let (swing, twist) = r.swing_twist(axis);
            let product = swing * Rotation::about(axis, twist);
            assert!(close(product.turn([0.2, 0.4, -0.7]), r.turn([0.2, 0.4, -0.7])));
            assert!(dot(swing.v, axis).abs() < 1e-9 && twist.abs() <= std::f64::consts::PI + 1e-12);
        }
    }
    let (_, twist) = Rotation::about([1.0, 0.0, 0.0], 0.7).swing_twist([1.0, 0.0, 0.0]);
    assert!((twist - 0.7).abs() < 1e-12);
}

#[test]
fn slerp_takes_the_shortest_path() {
    let (a, b) = (Rotation::about([0.0, 1.0, 0.0], 0.2), Rotation::about([0.0, 1.0, 0.0], 1.0));
    let negative = Rotation { w: -b.w, v: scale(b.v, -1.0) };
    for to in [b, negative] {
        assert!(((a.inverse() * a.slerp(to, 0.25)).angle() - 0.2).abs() < 1e-12);
        assert!((b.inverse() * a.slerp(to, 1.0)).angle() < 1e-9);
    }
}
