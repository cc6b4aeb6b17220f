//! A hand as the heat-map lifter sees it (Zimmermann & Brox 2017): score maps of its points within a crop about the
//! middle knuckle, and the hand's own frame that its two networks meet in. House point order: the paper's points 11,
//! 12 and 20 are 10, 9 and 17 here.

use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::view::hand::{HandJoints, SeenHand};
use orator_base::types::pose2d::N_HAND;

/// Places of a score map across and down.
pub const PLACES: usize = 32;
/// px of the crop, and px that one place is the mean of.
const CROP: f64 = 256.0;
const POOLED: usize = 8;
/// A score is exp(-d^2 / SIGMA^2), d in px of the crop.
const SIGMA: f64 = 25.0;
/// Numbers of all maps: [32, 32, 21].
pub const N_MAPS: usize = PLACES * PLACES * N_HAND;

/// A square of the picture: centre and side in px.
#[derive(Clone, Copy, Debug)]
pub struct Crop {
    pub centre: [f64; 2],
    pub side: f64,
}

impl Crop {
    /// About the middle knuckle (or the middle of the points), so large that all seen points lie inside. `None` when
    /// no two points differ.
    pub fn around(seen: &SeenHand) -> Option<Self> {
        let there = || seen.iter().flatten().map(|p| p.map(f64::from));
        let n = there().count().max(1) as f64;
        let middle = || [0, 1].map(|k| there().map(|p| p[k]).sum::<f64>() / n);
        let centre = seen[9].map_or_else(middle, |p| p.map(f64::from));
        let reach = there().map(|p| (p[0] - centre[0]).hypot(p[1] - centre[1])).fold(0.0, f64::max);
        (reach > 1e-6 && reach.is_finite()).then_some(Self { centre, side: 2.0 * reach })
    }
}

/// The score maps, mean-pooled from 256 to 32 places (a Gaussian is the product of its two profiles, so that the means
/// are too). A point not seen, or outside the crop, leaves its map zero.
pub fn score_maps(seen: &SeenHand, crop: Crop, maps: &mut [f32]) {
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
                maps[(y * PLACES + x) * N_HAND + j] = (across * down) as f32;
            }
        }
    }
}

/// Means of exp(-(x - at)^2 / SIGMA^2) over 8 px each.
fn profile(at: f64) -> [f64; PLACES] {
    std::array::from_fn(|place| {
        let scores = (0..POOLED).map(|k| (-(((place * POOLED + k) as f64 - at) / SIGMA).powi(2)).exp());
        scores.sum::<f64>() / POOLED as f64
    })
}

/// A hand in its own frame, the middle finger's first phalanx 1 long, and the three axes of the frame (rows): the
/// middle knuckle lies on y, the little finger's at z = 0 and x > 0; z is negated, as the paper has it for right hands
/// (left ones are seen in the mirror). `None` where the knuckles and the wrist lie on a line.
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

/// The hand in camera axes from its own frame: rows times the turn, relative to the wrist.
pub fn assembled(own: &HandJoints, axes: &[Vec3; 3]) -> HandJoints {
    let place = |p: Vec3| {
        let [x, y, z] = [0, 1, 2].map(|k| vec3::scale(axes[k], if k == 2 { -p[k] } else { p[k] }));
        vec3::add(x, vec3::add(y, z))
    };
    let wrist = place(own[0]);
    own.map(|p| vec3::sub(place(p), wrist))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::math::rotation::Rotation;
    use orator_base::motion::hand_bones::{PHALANX, relaxed};

    #[test]
    fn a_hand_comes_back_from_its_own_frame() {
        let turn = Rotation::about([0.6, 0.0, 0.8], 1.2);
        let hand = relaxed().map(|p| turn.turn(p));
        let (own, axes) = canonical(&hand).unwrap();
        assert!(own[9][0].abs() + own[9][2].abs() + own[17][2].abs() < 1e-12 && own[17][0] > 0.0);
        let back = assembled(&own, &axes);
        assert!((0..N_HAND).all(|j| vec3::norm(vec3::sub(vec3::scale(back[j], PHALANX), hand[j])) < 1e-12));
        assert!(canonical(&[[0.0; 3]; N_HAND]).is_none());
    }

    #[test]
    fn maps_are_the_means_of_the_large_gaussians() {
        let mut seen: SeenHand = [None; N_HAND];
        (seen[9], seen[4], seen[20]) = (Some([100.0, 50.0]), Some([140.0, 80.0]), Some([60.0, 50.0]));
        let crop = Crop::around(&seen).unwrap();
        assert!((crop.side - 100.0).abs() < 1e-9);
        let mut maps = vec![9.0; N_MAPS];
        score_maps(&seen, crop, &mut maps);
        let (cx, cy) = (40.0 / 100.0 * 256.0 + 128.0, 30.0 / 100.0 * 256.0 + 128.0);
        let mean = |px: usize, py: usize| {
            let score = |x: usize, y: usize| (-((x as f64 - cx).powi(2) + (y as f64 - cy).powi(2)) / 625.0).exp();
            (0..64).map(|k| score(8 * px + k % 8, 8 * py + k / 8)).sum::<f64>() / 64.0
        };
        for (px, py) in [(28, 25), (26, 27), (0, 0)] {
            assert!((f64::from(maps[(py * PLACES + px) * N_HAND + 4]) - mean(px, py)).abs() < 1e-6);
        }
        assert!((0..PLACES * PLACES).all(|k| maps[k * N_HAND] == 0.0), "a point not seen has an empty map");
        assert!(Crop::around(&[Some([3.0, 3.0]); N_HAND]).is_none());
    }
}
