//! Input and output representation of the heat-map lifter (Zimmermann & Brox 2017): score maps of the points within a
//! crop centred on the middle knuckle, and the canonical frame of a hand. Points are in this crate's order: the
//! paper's points 11, 12 and 20 are 10, 9 and 17 here.

use orator_base::math::vec3::{self, Vec3};
use orator_base::motion::view::hand::{HandJoints, HandPoints};
use orator_base::types::pose2d::N_HAND;

pub const MAP_SIZE: usize = 32;
/// Width of the crop in px, and px averaged into one score.
const CROP: f64 = 256.0;
const POOLED: usize = 8;
/// A score is exp(-d^2 / SIGMA^2), d in px of the crop.
const SIGMA: f64 = 25.0;
/// Number of values of all maps: [32, 32, 21].
pub const N_MAPS: usize = MAP_SIZE * MAP_SIZE * N_HAND;

/// A square of the image: centre and side in px.
#[derive(Clone, Copy, Debug)]
pub struct Crop {
    pub centre: [f64; 2],
    pub side: f64,
}

impl Crop {
    /// Centred on the middle knuckle (or the mean of the points), just large enough to contain all detected points.
    /// `None` if no two points differ.
    pub fn around(seen: &HandPoints) -> Option<Self> {
        let there = || seen.iter().flatten().map(|p| p.map(f64::from));
        let n = there().count().max(1) as f64;
        let middle = || [0, 1].map(|k| there().map(|p| p[k]).sum::<f64>() / n);
        let centre = seen[9].map_or_else(middle, |p| p.map(f64::from));
        let radius = there().map(|p| (p[0] - centre[0]).hypot(p[1] - centre[1])).fold(0.0, f64::max);
        (radius > 1e-6 && radius.is_finite()).then_some(Self { centre, side: 2.0 * radius })
    }
}

/// Writes the score maps, mean-pooled from 256 to 32 pixels across (a 2D Gaussian is separable, and so are its means).
/// The map of a point that is missing or outside the crop is zero.
pub fn score_maps(seen: &HandPoints, crop: Crop, maps: &mut [f32]) {
    maps.fill(0.0);
    for (j, point) in seen.iter().enumerate() {
        let Some(point) = point else { continue };
        let at = [0, 1].map(|k| (f64::from(point[k]) - crop.centre[k]) / crop.side * CROP + CROP / 2.0);
        if !at.iter().all(|v| (0.0..=CROP).contains(v)) {
            continue;
        }
        let [across, down] = at.map(profile);
        for (y, down) in down.iter().enumerate() {
            for (x, across) in across.iter().enumerate() {
                maps[(y * MAP_SIZE + x) * N_HAND + j] = (across * down) as f32;
            }
        }
    }
}

/// Means of exp(-(x - at)^2 / SIGMA^2) over 8 px each.
fn profile(at: f64) -> [f64; MAP_SIZE] {
    std::array::from_fn(|cell| {
        let scores = (0..POOLED).map(|k| (-(((cell * POOLED + k) as f64 - at) / SIGMA).powi(2)).exp());
        scores.sum::<f64>() / POOLED as f64
    })
}

/// The hand in its canonical frame, scaled so that the middle proximal phalanx is 1 long, and the three axes of the
/// frame (rows): the middle knuckle lies on y, the little finger's knuckle at z = 0 and x > 0; z is negated, as in the
/// paper for right hands (left hands are mirrored). `None` if the knuckles and the wrist are collinear.
pub fn canonical(hand: &HandJoints) -> Option<(HandJoints, [Vec3; 3])> {
    let grow = 1.0 / vec3::norm(vec3::sub(hand[9], hand[10]));
    let y = vec3::unit(vec3::sub(hand[9], hand[0]), 1e-9)?;
    let x = vec3::unit(vec3::across(vec3::sub(hand[17], hand[0]), y), 1e-9)?;
    let z = vec3::cross(x, y);
    let own = hand.map(|p| {
        let p = vec3::scale(vec3::sub(p, hand[0]), grow);
        [vec3::dot(p, x), vec3::dot(p, y), -vec3::dot(p, z)]
    });
    own.iter().flatten().all(|v| v.is_finite()).then_some((own, [x, y, z]))
}

/// The hand in camera axes from its canonical frame, relative to the wrist; the inverse of `canonical` up to scale.
pub fn assembled(own: &HandJoints, axes: &[Vec3; 3]) -> HandJoints {
    let to_camera = |p: Vec3| {
        let [x, y, z] = [0, 1, 2].map(|k| vec3::scale(axes[k], if k == 2 { -p[k] } else { p[k] }));
        vec3::add(x, vec3::add(y, z))
    };
    let wrist = to_camera(own[0]);
    own.map(|p| vec3::sub(to_camera(p), wrist))
}
