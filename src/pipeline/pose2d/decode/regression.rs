//! Models that name the keypoints outright: a row of numbers a point, x and y first, in pixels of the input, and one
//! score for them all (MediaPipe's hand and face).

use super::ScoredPoint;
use anyhow::{Result, ensure};

/// `n_points` points of `landmarks`, each with the one `score`; all zero if any number is not finite.
pub fn decode(landmarks: &[f32], score: f32, n_points: usize) -> Result<Vec<ScoredPoint>> {
    let fits = n_points > 0 && landmarks.len().is_multiple_of(n_points) && landmarks.len() / n_points >= 2;
    ensure!(fits, "{} numbers are no {n_points} points", landmarks.len());
    if !score.is_finite() || landmarks.iter().any(|number| !number.is_finite()) {
        return Ok(vec![[0.0; 3]; n_points]);
    }
    let rows = landmarks.chunks_exact(landmarks.len() / n_points);
    Ok(rows.map(|row| [f64::from(row[0]), f64::from(row[1]), f64::from(score)]).collect())
}

/// The score 0..1 that a model gives outright or as a logit.
pub fn score(number: f32, is_logit: bool) -> f32 {
    if is_logit { 1.0 / (1.0 + (-number).exp()) } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_any_length_are_points() {
        let rows = [1.0, 2.0, 9.0, 3.0, 4.0, 9.0];
        assert_eq!(decode(&rows, 0.5, 2).unwrap(), [[1.0, 2.0, 0.5], [3.0, 4.0, 0.5]]);
        assert_eq!(decode(&rows, f32::NAN, 2).unwrap(), [[0.0; 3]; 2]);
        assert!(decode(&rows, 0.5, 4).is_err() && decode(&rows, 0.5, 0).is_err() && decode(&rows, 0.5, 6).is_err());
    }
}
