//! Derives the unit of keypoint coordinates (pixels or fractions of the image), and rejects implausible ones.

use anyhow::{Result, ensure};
use orator_base::math::order::Ordered;
use orator_base::types::pose2d::Keypoints;

/// Number of body points that all formats have and most cameras show: face and arms.
pub const UPPER_BODY: usize = 11;
/// Maximum number of points examined to derive the unit.
pub const MAX_EXAMINED_POINTS: usize = 20_000;
/// Maximum median coordinate of fractions of the image; a person two pixels in size is implausible.
const MAX_FRACTION: f64 = 1.5;
/// Maximum median coordinate of pixels: no image is larger, px.
const MAX_IMAGE_SIDE: f64 = 1e5;
/// Coordinates from this value on mark missing points, px.
const MISSING_COORDINATE: f32 = 1e9;
/// Fraction of points left of or above the image from which on the origin must be wrong.
const MAX_OUTSIDE: f64 = 0.95;

/// Coordinates x, y of the detected face and arm points (score above 0).
pub fn coordinates(keypoints: &Keypoints) -> impl Iterator<Item = [f32; 2]> {
    let upper = keypoints.body.outer_iter().flat_map(|frame| {
        let points = (0..UPPER_BODY).map(|j| [frame[[j, 0]], frame[[j, 1]], frame[[j, 2]]]);
        points.collect::<Vec<_>>()
    });
    upper.filter(|point| point[2] > 0.0).map(|[x, y, _]| [x, y]).take(MAX_EXAMINED_POINTS)
}

/// Whether the coordinates are fractions of the image width and height, about 0 to 1.
pub fn are_fractions(coordinates: impl Iterator<Item = [f32; 2]>) -> bool {
    median_size(coordinates).is_some_and(|median| median <= MAX_FRACTION)
}

/// Errors if pixel coordinates are implausible: larger than any image, or nearly all left of or above the image.
pub fn check_pixels(coordinates: impl Iterator<Item = [f32; 2]>) -> Result<()> {
    let coordinates: Vec<[f32; 2]> = coordinates.filter(|xy| xy.iter().all(|v| v.abs() < MISSING_COORDINATE)).collect();
    let median = median_size(coordinates.iter().copied()).unwrap_or(0.0);
    ensure!(
        median <= MAX_IMAGE_SIDE,
        "implausible coordinates (median {median:.0} px): expected pixels, \
         or fractions of the image size from 0 to 1"
    );
    for (axis, name, end) in [(0, "x", "left"), (1, "y", "upper")] {
        let n_outside = coordinates.iter().filter(|xy| xy[axis] < 0.0).count();
        ensure!(
            coordinates.is_empty() || (n_outside as f64) < MAX_OUTSIDE * coordinates.len() as f64,
            "{n_outside} of {} points have a negative {name}: expected pixels from the {end} edge of the image; add \
             half the image size if they are relative to its centre, and negate y if it points up",
            coordinates.len()
        );
    }
    Ok(())
}

fn median_size(coordinates: impl Iterator<Item = [f32; 2]>) -> Option<f64> {
    Ordered::new(coordinates.map(|[x, y]| f64::from(x.abs().max(y.abs())))).median()
}
