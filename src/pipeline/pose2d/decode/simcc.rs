//! SimCC (Li et al. 2022): each keypoint's x and y are two classifications over bins finer than a pixel (RTMPose, RTMW,
//! DWPose). The fullest bin is the place; the score is the lower of the two peaks.

use super::point::{LARGEST, ScoredPoint, finite, peak};
use anyhow::{Result, bail};

/// The keypoints of `x` [1, K, bins] and `y` [1, K, bins], `split` bins a pixel.
pub fn decode(x: (&[i64], &[f32]), y: (&[i64], &[f32]), split: f64) -> Result<Vec<ScoredPoint>> {
    let (&[1, n_points, x_bins @ 1..=LARGEST], &[1, y_points, y_bins @ 1..=LARGEST]) = (x.0, y.0) else {
        bail!("SimCC outputs must have the shape [1, K, bins], not {:?} and {:?}", x.0, y.0)
    };
    if n_points != y_points {
        bail!("SimCC gives {n_points} keypoints in x and {y_points} in y");
    }
    let rows = x.1.chunks_exact(x_bins as usize).zip(y.1.chunks_exact(y_bins as usize));
    let place = |(x, y): (&[f32], &[f32])| match (peak(x), peak(y)) {
        (Some((x, x_score)), Some((y, y_score))) => {
            finite([x as f64 / split, y as f64 / split, f64::from(x_score.min(y_score)).max(0.0)])
        }
        _ => [0.0; 3],
    };
    Ok(rows.map(place).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fullest_bins_are_the_place() {
        let mut x = vec![0.0; 2 * 384];
        let mut y = vec![0.0; 2 * 512];
        (x[101], y[77]) = (0.8, 0.6);
        (x[384 + 3], y[512 + 500]) = (0.2, f32::NAN);
        let points = decode((&[1, 2, 384], &x), (&[1, 2, 512], &y), 2.0).unwrap();
        assert_eq!(points[0], [50.5, 38.5, f64::from(0.6_f32)]);
        assert_eq!(points[1], [1.5, 0.0, 0.0]);
        assert!(decode((&[1, 2, 384], &x), (&[1, 3, 512], &y), 2.0).is_err());
        assert!(decode((&[2, 384], &x), (&[1, 2, 512], &y), 2.0).is_err());
    }
}
