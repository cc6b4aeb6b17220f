//! Where keypoints lie: in pixels, in shares of the picture, or where no picture is.

use anyhow::{Result, ensure};
use orator_base::math::order::Ordered;
use orator_base::types::pose2d::Keypoints;

/// Points of the body that every format shows and every camera sees: face and arms.
pub const UPPER_BODY: usize = 11;
/// Points that are looked at for the unit.
pub const MOST_LOOKED_AT: usize = 20_000;
/// Median coordinate up to which coordinates are shares of the picture; a person of two pixels is none.
const MOST_SHARE: f64 = 1.5;
/// Median coordinate from which on no picture is so large, px.
const LARGEST_PICTURE: f64 = 1e5;
/// Coordinate from which on a point is no place, but missing, px.
const NOWHERE: f32 = 1e9;
/// Share of points left of or above the picture, from which on none is meant to be in it.
const MOST_OUTSIDE: f64 = 0.95;

/// Places of the points of faces and arms that are there (score above 0): x, y.
pub fn places(keypoints: &Keypoints) -> impl Iterator<Item = [f32; 2]> {
    let upper = keypoints.body.outer_iter().flat_map(|frame| {
        let points = (0..UPPER_BODY).map(|j| [frame[[j, 0]], frame[[j, 1]], frame[[j, 2]]]);
        points.collect::<Vec<_>>()
    });
    upper.filter(|point| point[2] > 0.0).map(|[x, y, _]| [x, y]).take(MOST_LOOKED_AT)
}

/// Whether the places are shares of a picture's width and height, about 0 to 1.
pub fn are_shares(places: impl Iterator<Item = [f32; 2]>) -> bool {
    median_size(places).is_some_and(|median| median <= MOST_SHARE)
}

/// Errors where pixels are in no picture: beyond the size of any, or nearly all left of it or above it.
pub fn check_pixels(places: impl Iterator<Item = [f32; 2]>) -> Result<()> {
    let places: Vec<[f32; 2]> = places.filter(|place| place.iter().all(|v| v.abs() < NOWHERE)).collect();
    let median = median_size(places.iter().copied()).unwrap_or(0.0);
    ensure!(
        median <= LARGEST_PICTURE,
        "its points lie about {median:.0} px from the picture's corner, which no picture has room for: expected pixels, \
         or shares of the picture from 0 to 1"
    );
    for (axis, name, end) in [(0, "x", "left"), (1, "y", "upper")] {
        let n_outside = places.iter().filter(|place| place[axis] < 0.0).count();
        ensure!(
            places.is_empty() || (n_outside as f64) < MOST_OUTSIDE * places.len() as f64,
            "{n_outside} of {} points have a negative {name}: expected pixels counted from the picture's {end} edge; add \
             half its size where they count from its middle, and turn y round where it points up",
            places.len()
        );
    }
    Ok(())
}

fn median_size(places: impl Iterator<Item = [f32; 2]>) -> Option<f64> {
    Ordered::new(places.map(|[x, y]| f64::from(x.abs().max(y.abs())))).median()
}
