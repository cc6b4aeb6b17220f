//! The part of a picture that the network is shown: a person's box, grown as the body model's is, then moved, turned,
//! zoomed and mirrored at random.

use crate::external::opencv::warp::SrcFromDst;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// What a box is grown by, as of the models of bodies in the manifest.
const MARGIN: f64 = 1.25;
/// Most zoom (logarithm), turn (radians) and shift (share of the crop) of a training picture.
const ZOOM: f64 = 0.3;
const TURN: f64 = 0.45;
const SHIFT: f64 = 0.08;
/// Shares of the pictures that are turned and mirrored.
const TURNED: f64 = 0.6;
const MIRRORED: f64 = 0.5;

/// Part of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PersonCrop {
    /// Of the part, px of the picture.
    pub centre: [f64; 2],
    /// Pixels of the picture to one of the crop.
    pub scale: f64,
    /// Radians.
    pub turn: f64,
    /// Left and right are changed.
    pub is_mirrored: bool,
    /// Height and width of the crop, px.
    pub size: [usize; 2],
}

impl PersonCrop {
    /// The crop of this `size` around a box; none where that is no place in a picture.
    pub fn around([x, y, width, height]: [f64; 4], size: [usize; 2]) -> Option<Self> {
        let centre = [x + width / 2.0, y + height / 2.0];
        let scale = (height / size[0] as f64).max(width / size[1] as f64) * MARGIN;
        let is_sound = scale > 1e-6 && scale < 1e4 && centre.iter().all(|px| px.abs() < 1e5);
        is_sound.then_some(Self { centre, scale, turn: 0.0, is_mirrored: false, size })
    }

    /// The crop as a training picture has it.
    pub fn disturbed(self, rng: &mut ChaCha8Rng) -> Self {
        let zoom = rng.random_range(-ZOOM..ZOOM).exp();
        let turn = if rng.random_bool(TURNED) { rng.random_range(-TURN..TURN) } else { 0.0 };
        let [height, width] = self.size.map(|px| px as f64 * self.scale);
        let mut shift = |px: f64| px * rng.random_range(-SHIFT..SHIFT);
        let centre = [self.centre[0] + shift(width), self.centre[1] + shift(height)];
        Self { centre, scale: self.scale * zoom, turn, is_mirrored: rng.random_bool(MIRRORED), ..self }
    }

    /// Half the crop, px: its centre.
    fn half(&self) -> [f64; 2] {
        [self.size[1] as f64 / 2.0, self.size[0] as f64 / 2.0]
    }

    /// From the crop to the picture.
    pub fn src_from_dst(&self) -> SrcFromDst {
        let (sin, cos) = self.turn.sin_cos();
        let across = if self.is_mirrored { -self.scale } else { self.scale };
        let [a, b, c, d] = [cos * across, -sin * self.scale, sin * across, cos * self.scale];
        let ([x, y], [half_x, half_y]) = (self.centre, self.half());
        SrcFromDst([[a, b, x - a * half_x - b * half_y], [c, d, y - c * half_x - d * half_y]])
    }

    /// Place in the crop of a point of the picture, px.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn.sin_cos();
        let [dx, dy] = [(x - self.centre[0]) / self.scale, (y - self.centre[1]) / self.scale];
        let across = if self.is_mirrored { -1.0 } else { 1.0 };
        let [half_x, half_y] = self.half();
        [half_x + across * (cos * dx + sin * dy), half_y + cos * dy - sin * dx]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn a_place_leads_back_to_its_point() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let plain = PersonCrop::around([40.0, 10.0, 100.0, 300.0], [128, 96]).unwrap();
        let [x, y] = plain.place([90.0, 160.0]);
        assert!((x - 48.0).abs() < 1e-9 && (y - 64.0).abs() < 1e-9);
        assert!((plain.scale - 1.25 * 300.0 / 128.0).abs() < 1e-9);
        for _ in 0..50 {
            let crop = plain.disturbed(&mut rng);
            let point = [rng.random_range(0.0..200.0), rng.random_range(0.0..300.0)];
            let back = crop.src_from_dst().apply(crop.place(point));
            assert!((0..2).all(|k| (back[k] - point[k]).abs() < 1e-9), "{crop:?}");
        }
        assert_eq!(PersonCrop::around([0.0, 0.0, 0.0, 0.0], [128, 96]), None);
        assert_eq!(PersonCrop::around([f64::NAN, 0.0, 5.0, 5.0], [128, 96]), None);
    }
}
