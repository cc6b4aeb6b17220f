//! What a person looks like: the colours of head, chest and belly, where the body's points say they are. Two people are
//! told apart by them, one person at two times is not; the shape of faces is for `face::views`.

use super::decode::ScoredPoint;
use super::patch;
use orator_base::types::image::Image;
use orator_base::types::pose2d::coco;
use serde::{Deserialize, Serialize};

/// Bins of a channel.
const BINS: usize = 16;
/// Distributions: three bands of the body, each of light and of two differences of colour.
const CHANNELS: usize = 9;
/// Cells of a band that are looked at.
const BAND: [usize; 2] = [10, 6];

/// Distributions of colour over the body, cumulated: how much of each channel lies at or below each bin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyColours(Vec<f32>);

impl BodyColours {
    /// Measures the body whose points are given; `None` if its shoulders are not surer than `least`.
    pub fn measure(image: &Image, body: &[ScoredPoint; 17], least: f64) -> Option<Self> {
        let [left, right] = [coco::L_SHOULDER, coco::R_SHOULDER].map(|at| body[at]);
        let width = (left[0] - right[0]).hypot(left[1] - right[1]);
        if left[2].min(right[2]) < least || !(4.0..1e5).contains(&width) {
            return None;
        }
        let neck = [(left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0];
        let wide = width.max((left[0] - right[0]).abs());
        // Head: around the nose, else above the neck. Chest and belly hang from the shoulders.
        let nose = body[coco::NOSE];
        let head = if nose[2] >= least { [nose[0], nose[1]] } else { [neck[0], neck[1] - 0.6 * width] };
        let bands = [
            [head[0] - 0.3 * wide, head[1] - 0.4 * wide, 0.6 * wide, 0.8 * wide],
            [neck[0] - 0.4 * wide, neck[1] + 0.1 * wide, 0.8 * wide, 0.4 * wide],
            [neck[0] - 0.4 * wide, neck[1] + 0.5 * wide, 0.8 * wide, 0.4 * wide],
        ];
        let mut numbers = Vec::with_capacity(CHANNELS * BINS);
        for band in bands {
            let colours = patch::colours(image, band, BAND);
            numbers.extend(distribution(&colours));
        }
        Some(Self(numbers))
    }

    /// Distance of two people: the mean way colour must go from one to the other, in 8-bit steps.
    pub fn distance(&self, other: &Self) -> f32 {
        let way: f32 = self.0.iter().zip(&other.0).map(|(a, b)| (a - b).abs()).sum();
        way * (256.0 / BINS as f32) / CHANNELS as f32
    }

    /// Moves towards `other` by `weight`.
    pub fn follow(&mut self, other: &Self, weight: f32) {
        self.0.iter_mut().zip(&other.0).for_each(|(mine, new)| *mine += weight * (new - *mine));
    }
}

/// Cumulated distributions of colours: light and two differences of colour, each of `BINS` numbers.
pub fn distribution(colours: &[[f32; 3]]) -> impl Iterator<Item = f32> {
    (0..3).flat_map(|channel| cumulated(colours.iter().map(move |colour| opponent(*colour)[channel])))
}

/// Light, red against green, and yellow against blue, each 0..255.
fn opponent([r, g, b]: [f32; 3]) -> [f32; 3] {
    [(r + g + b) / 3.0, (r - g + 255.0) / 2.0, ((r + g) / 2.0 - b + 255.0) / 2.0]
}

/// Share of the values at or below each bin.
fn cumulated(values: impl Iterator<Item = f32>) -> [f32; BINS] {
    let (mut bins, mut n) = ([0.0f32; BINS], 0.0f32);
    for value in values {
        // Shared between the two nearest bins, so that a small step of light is a small step.
        let at = (value / 256.0 * BINS as f32 - 0.5).clamp(0.0, (BINS - 1) as f32);
        let low = at as usize;
        bins[low] += 1.0 - (at - low as f32);
        bins[(low + 1).min(BINS - 1)] += at - low as f32;
        n += 1.0;
    }
    let mut sum = 0.0;
    bins.map(|bin| {
        sum += bin;
        sum / n.max(1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_media::opencv::draw;

    fn person(shirt: [u8; 3], light: f32, x: f64) -> (Image, [ScoredPoint; 17]) {
        let lit = |rgb: [u8; 3]| rgb.map(|part| (f32::from(part) * light) as u8);
        let mut image = Image::filled(320, 240, lit([90, 90, 90]));
        let at = |dx: f32, dy: f32| [x as f32 + dx, 100.0 + dy];
        draw::polygon(&mut image, &[at(-40.0, 0.0), at(40.0, 0.0), at(40.0, 100.0), at(-40.0, 100.0)], lit(shirt))
            .unwrap();
        draw::circle(&mut image, at(0.0, -40.0), 22.0, lit([220, 180, 150])).unwrap();
        let mut body = [[0.0; 3]; 17];
        body[coco::NOSE] = [x, 60.0, 0.9];
        body[coco::L_SHOULDER] = [x + 35.0, 102.0, 0.9];
        body[coco::R_SHOULDER] = [x - 35.0, 102.0, 0.9];
        (image, body)
    }

    #[test]
    fn another_shirt_is_another_person_and_another_place_or_light_is_not() {
        let of = |(image, body): (Image, [ScoredPoint; 17])| BodyColours::measure(&image, &body, 0.3).unwrap();
        let red = of(person([180, 40, 40], 1.0, 100.0));
        let same = red.distance(&of(person([180, 40, 40], 0.9, 200.0)));
        let other = red.distance(&of(person([40, 60, 160], 1.0, 100.0)));
        assert!(same < 8.0 && other > 4.0 * same, "{same} {other}");
        let mut followed = red.clone();
        (0..99).for_each(|_| followed.follow(&of(person([40, 60, 160], 1.0, 100.0)), 0.1));
        assert!(followed.distance(&red) > 0.99 * other);
    }

    #[test]
    fn without_shoulders_there_is_nothing_to_see() {
        let (image, mut body) = person([1, 2, 3], 1.0, 100.0);
        body[coco::L_SHOULDER][2] = 0.1;
        assert_eq!(BodyColours::measure(&image, &body, 0.3), None);
        body[coco::L_SHOULDER] = [f64::NAN, f64::NAN, 0.9];
        assert_eq!(BodyColours::measure(&image, &body, 0.3), None);
    }
}
