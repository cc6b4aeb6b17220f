//! Camera and light of a clip.

use super::condition::{Condition, Framing};
use orator_avatar::render::{Light, PinholeCamera};
use orator_base::math::vec3::{Vec3, add, scale};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Height of the crown of the head above the neck, metres of a body of unit 1.
const CROWN: f64 = 0.34;

/// Samples a camera that frames a body: `neck` is its neck in world cm, `unit` its size, `second_neck` the neck of a
/// second person.
pub fn camera(
    condition: Condition,
    neck: Vec3,
    unit: f64,
    second_neck: Option<Vec3>,
    rng: &mut ChaCha8Rng,
) -> PinholeCamera {
    let Framing { yaw_degrees, below_neck, above_head, fov_degrees, sizes } = condition.framing();
    let cm = 100.0 * unit;
    let size = sizes[rng.random_range(0..sizes.len())];
    let [width, height] = size.map(|n| n as f64);
    let fov = rng.random_range(fov_degrees[0]..fov_degrees[1]).to_radians();
    // Multiples of a quarter pixel are unchanged by conversion to text and back.
    let focal_px = (4.0 * width / 2.0 / (fov / 2.0).tan()).round() / 4.0;
    let top = neck[1] + cm * (CROWN + rng.random_range(above_head[0]..above_head[1]));
    let bottom = neck[1] - cm * rng.random_range(below_neck[0]..below_neck[1]);
    let distance = (top - bottom) * focal_px / height;
    let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let yaw = side * rng.random_range(yaw_degrees[0]..yaw_degrees[1]).to_radians();
    let rise = rng.random_range(-0.06..0.2_f64);
    let max_roll: f64 = if rng.random_bool(0.25) { 0.1 } else { 0.03 };
    let roll = rng.random_range(-max_roll..max_roll);
    let off = 0.08 * rng.random_range(-1.0..1.0) * (top - bottom) * width / height;
    let mut target =
        [neck[0] + if condition == Condition::Edge { 2.0 * off } else { off }, (top + bottom) / 2.0, neck[2]];
    if let Some(other) = second_neck {
        target[0] += 0.35 * (other[0] - neck[0]);
    }
    let away = [yaw.sin() * rise.cos(), rise.sin(), yaw.cos() * rise.cos()];
    let mut position = add(target, scale(away, distance));
    // The camera is at least 25 cm above the floor.
    position[1] = position[1].max(25.0);
    PinholeCamera::looking_at(size, focal_px, position, target, roll)
}

/// Samples the light of a room: key light from above and the side, warm or cold.
pub fn light(rng: &mut ChaCha8Rng) -> Light {
    let (azimuth, up) = (rng.random_range(-0.95..0.95_f64), rng.random_range(0.35..0.95_f64));
    let mut light = Light::studio([azimuth.sin() * up.cos(), up.sin(), azimuth.cos() * up.cos()]);
    let (key, fill, warm) =
        (rng.random_range(0.5..1.15_f32), rng.random_range(0.7..1.2_f32), rng.random_range(-0.12..0.12_f32));
    let tint = [1.0 + warm, 1.0, 1.0 - warm];
    for (k, tint) in tint.into_iter().enumerate() {
        light.key[k] *= key * tint;
        light.sky[k] *= fill;
        light.ground[k] *= fill;
    }
    light
}
