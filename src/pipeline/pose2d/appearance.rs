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
