//! Colour appearance of a person: distributions over head, chest and belly, by the body keypoints. They distinguish
//! people in a video, but do not recognise a person across videos; `face::views` has the face shape for that.

use super::decode::ScoredPoint;
use super::patch;
use orator_base::types::image::Image;
use orator_base::types::pose2d::coco;
use serde::{Deserialize, Serialize};

/// Histogram bins per channel.
const BINS: usize = 16;
/// Number of distributions: lightness and two colour differences for each of three bands of the body.
const CHANNELS: usize = 9;
/// Sampling grid of a band: columns, rows.
const BAND_CELLS: [usize; 2] = [10, 6];

/// Cumulative colour histograms of the body: the share of each channel at or below each bin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyColours(Vec<f32>);

impl BodyColours {
    /// Measures the person with the keypoints `body`; `None` if a shoulder scores below `least`, or the shoulder width
    /// is implausible.
    pub fn measure(image: &Image, body: &[ScoredPoint; 17], least: f64) -> Option<Self> {
        let [left, right] = [coco::L_SHOULDER, coco::R_SHOULDER].map(|at| body[at]);
        let width = (left[0] - right[0]).hypot(left[1] - right[1]);
        if left[2].min(right[2]) < least || !(4.0..1e5).contains(&width) {
            return None;
        }
        let neck = [(left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0];
        let body_width = width.max((left[0] - right[0]).abs());
        // Head: around the nose, else above the neck. Chest and belly are located below the shoulders.
        let nose = body[coco::NOSE];
        let head = if nose[2] >= least { [nose[0], nose[1]] } else { [neck[0], neck[1] - 0.6 * width] };
        let bands = [
            [head[0] - 0.3 * body_width, head[1] - 0.4 * body_width, 0.6 * body_width, 0.8 * body_width],
            [neck[0] - 0.4 * body_width, neck[1] + 0.1 * body_width, 0.8 * body_width, 0.4 * body_width],
            [neck[0] - 0.4 * body_width, neck[1] + 0.5 * body_width, 0.8 * body_width, 0.4 * body_width],
        ];
        let mut histograms = Vec::with_capacity(CHANNELS * BINS);
        for band in bands {
            let colours = patch::colours(image, band, BAND_CELLS);
            histograms.extend(distribution(&colours));
        }
        Some(Self(histograms))
    }

    /// Distance of two people: earth mover's distance, averaged over the channels, in 8-bit steps.
    pub fn distance(&self, other: &Self) -> f32 {
        let total: f32 = self.0.iter().zip(&other.0).map(|(a, b)| (a - b).abs()).sum();
        total * (256.0 / BINS as f32) / CHANNELS as f32
    }

    /// Exponential moving average: moves towards `other` by `weight`, 0..1.
    pub fn move_towards(&mut self, other: &Self, weight: f32) {
        self.0.iter_mut().zip(&other.0).for_each(|(mine, new)| *mine += weight * (new - *mine));
    }
}

/// Cumulative histograms of lightness and two colour differences, `BINS` values each.
pub fn distribution(colours: &[[f32; 3]]) -> impl Iterator<Item = f32> {
    (0..3).flat_map(|channel| cumulative_histogram(colours.iter().map(move |colour| opponent(*colour)[channel])))
}

/// Opponent colours: lightness, red-green and yellow-blue, each 0..255.
fn opponent([r, g, b]: [f32; 3]) -> [f32; 3] {
    [(r + g + b) / 3.0, (r - g + 255.0) / 2.0, ((r + g) / 2.0 - b + 255.0) / 2.0]
}

/// Share of the values at or below each bin.
fn cumulative_histogram(values: impl Iterator<Item = f32>) -> [f32; BINS] {
    let (mut bins, mut n) = ([0.0f32; BINS], 0.0f32);
    for value in values {
        // Each value is split between the two nearest bins, so that a small change of light is a small distance.
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
    fn clothes_distinguish_persons_at_any_position_and_light() {
        let of = |(image, body): (Image, [ScoredPoint; 17])| BodyColours::measure(&image, &body, 0.3).unwrap();
        let red = of(person([180, 40, 40], 1.0, 100.0));
        let same = red.distance(&of(person([180, 40, 40], 0.9, 200.0)));
        let other = red.distance(&of(person([40, 60, 160], 1.0, 100.0)));
        assert!(same < 8.0 && other > 4.0 * same, "{same} {other}");
        let mut followed = red.clone();
        (0..99).for_each(|_| followed.move_towards(&of(person([40, 60, 160], 1.0, 100.0)), 0.1));
        assert!(followed.distance(&red) > 0.99 * other);
    }

    #[test]
    fn without_shoulders_there_is_no_appearance() {
        let (image, mut body) = person([1, 2, 3], 1.0, 100.0);
        body[coco::L_SHOULDER][2] = 0.1;
        assert_eq!(BodyColours::measure(&image, &body, 0.3), None);
        body[coco::L_SHOULDER] = [f64::NAN, f64::NAN, 0.9];
        assert_eq!(BodyColours::measure(&image, &body, 0.3), None);
    }
}
