//! Outputs with one position per keypoint. SimCC (Li et al. 2022): x and y are two classifications over sub-pixel bins
//! (RTMPose, RTMW, DWPose). Regression: one row of values per point, x and y first, in px of the input, then, in rows
//! of three, depth, and one score for all points (MediaPipe's hand and face).

use anyhow::{Result, bail, ensure};

/// Largest accepted axis length of an output.
pub(crate) const MAX_AXIS_LEN: i64 = 1 << 20;

/// Keypoint x, y, score in px of the model input; all zero if not finite.
pub type ScoredPoint = [f64; 3];

/// The point, or zeros if a value is not finite.
pub(crate) fn finite(point: ScoredPoint) -> ScoredPoint {
    if point.iter().all(|number| number.is_finite()) { point } else { [0.0; 3] }
}

/// Index and value of the first maximum, ignoring non-finite values; `None` if there is no finite value.
pub(crate) fn peak(numbers: &[f32]) -> Option<(usize, f32)> {
    let mut best: Option<(usize, f32)> = None;
    for (at, value) in numbers.iter().copied().enumerate() {
        if value.is_finite() && best.is_none_or(|(_, largest)| value > largest) {
            best = Some((at, value));
        }
    }
    best
}

/// SimCC: keypoints from `x` [1, K, bins] and `y` [1, K, bins] with `split` bins per pixel. The position is that of
/// the peaks, the score the lower of the two.
///
/// # Errors
/// Invalid or unequal shapes.
pub fn simcc(x: (&[i64], &[f32]), y: (&[i64], &[f32]), split: f64) -> Result<Vec<ScoredPoint>> {
    let (&[1, n_points, x_bins @ 1..=MAX_AXIS_LEN], &[1, y_points, y_bins @ 1..=MAX_AXIS_LEN]) = (x.0, y.0) else {
        bail!("invalid shapes {:?} and {:?} of SimCC outputs: expected [1, K, bins]", x.0, y.0)
    };
    if n_points != y_points {
        bail!("SimCC outputs have {n_points} keypoints in x, {y_points} in y: expected equal numbers");
    }
    let rows = x.1.chunks_exact(x_bins as usize).zip(y.1.chunks_exact(y_bins as usize));
    let point = |(x, y): (&[f32], &[f32])| match (peak(x), peak(y)) {
        (Some((x, x_score)), Some((y, y_score))) => {
            finite([x as f64 / split, y as f64 / split, f64::from(x_score.min(y_score)).max(0.0)])
        }
        _ => [0.0; 3],
    };
    Ok(rows.map(point).collect())
}

/// Regression: `n_points` points of `landmarks`, all with the same `score`; all zero if any value is not finite.
///
/// # Errors
/// A number of values that does not fit `n_points`.
pub fn regression(landmarks: &[f32], score: f32, n_points: usize) -> Result<Vec<ScoredPoint>> {
    let fits = n_points > 0 && landmarks.len().is_multiple_of(n_points) && landmarks.len() / n_points >= 2;
    ensure!(fits, "{} values cannot be divided into {n_points} points", landmarks.len());
    if !score.is_finite() || landmarks.iter().any(|number| !number.is_finite()) {
        return Ok(vec![[0.0; 3]; n_points]);
    }
    let rows = landmarks.chunks_exact(landmarks.len() / n_points);
    Ok(rows.map(|row| [f64::from(row[0]), f64::from(row[1]), f64::from(score)]).collect())
}

/// Depths of the points of a regression, in px of the input: the third of three values a row; `None` for rows of other
/// lengths, values that are not finite, or depths that are all zero.
pub fn depths(landmarks: &[f32], n_points: usize) -> Option<Vec<f64>> {
    let fits = n_points > 0 && landmarks.len() == 3 * n_points && landmarks.iter().all(|number| number.is_finite());
    let depths: Vec<f64> = landmarks.chunks_exact(3).map(|row| f64::from(row[2])).collect();
    (fits && depths.iter().any(|depth| *depth != 0.0)).then_some(depths)
}

/// Score 0..1 from an output that is a probability or a logit.
pub fn regression_score(number: f32, is_logit: bool) -> f32 {
    if is_logit { 1.0 / (1.0 + (-number).exp()) } else { number }
}
