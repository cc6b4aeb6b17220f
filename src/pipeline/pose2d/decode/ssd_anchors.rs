//! MediaPipe's SSD detectors: a box and points as offsets from fixed anchors, with one logit each. Overlapping boxes
//! are averaged, weighted by score, instead of suppressed.

use super::boxes;
use anyhow::{Result, ensure};
use orator_base::types::pose2d::PersonBox;

/// Detection in px of the input: two corners of its box, then its points.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    pub score: f64,
    pub points: Vec<[f64; 2]>,
}

/// Anchor centres as shares of the input side: equal strides share a grid, two anchors per cell and layer, row-major.
pub fn anchors(size: usize, strides: &[usize]) -> Vec<[f64; 2]> {
    let mut centres = Vec::new();
    for layers in strides.chunk_by(|a, b| a == b) {
        let grid = size.div_ceil(layers[0].max(1));
        let share = |cell: usize| (cell as f64 + 0.5) / grid as f64;
        for cell in 0..grid * grid {
            let centre = [share(cell % grid), share(cell / grid)];
            centres.extend(std::iter::repeat_n(centre, 2 * layers.len()));
        }
    }
    centres
}

/// Detections with a probability of at least `min_score`, best first. `regressors` has one row per anchor: box centre,
/// box size and points, in px of an input of side `size`.
///
/// # Errors
/// A number of values that does not match the anchors.
pub fn decode(
    regressors: &[f32],
    logits: &[f32],
    anchors: &[[f64; 2]],
    size: usize,
    min_score: f32,
    max_overlap: f32,
) -> Result<Vec<Detection>> {
    let row_len = regressors.len() / anchors.len().max(1);
    ensure!(
        logits.len() == anchors.len()
            && row_len * anchors.len() == regressors.len()
            && row_len >= 4
            && row_len.is_multiple_of(2),
        "{} scores and {} box values for {} anchors: expected one score and one row of box and points per anchor",
        logits.len(),
        regressors.len(),
        anchors.len()
    );
    let mut found = Vec::new();
    for ((row, logit), centre) in regressors.chunks_exact(row_len).zip(logits).zip(anchors) {
        let score = 1.0 / (1.0 + (-f64::from(logit.clamp(-100.0, 100.0))).exp());
        if score >= f64::from(min_score) && row.iter().all(|number| number.is_finite()) {
            found.push(Detection { score, points: decode_points(row, centre.map(|share| share * size as f64)) });
        }
    }
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut merged = Vec::new();
    while !found.is_empty() {
        let best = bounds(&found[0]);
        let mut first = true;
        let (overlapping, rest): (Vec<_>, Vec<_>) = found
            .into_iter()
            .partition(|other| std::mem::take(&mut first) || boxes::overlap(&best, &bounds(other)) > max_overlap);
        merged.push(average(&overlapping));
        found = rest;
    }
    Ok(merged)
}

/// Corners of the box, followed by the points.
fn decode_points(row: &[f32], centre: [f64; 2]) -> Vec<[f64; 2]> {
    let pair = |at: usize| [f64::from(row[at]), f64::from(row[at + 1])];
    let ([x, y], [width, height]) = (pair(0), pair(2));
    let (x, y) = (x + centre[0], y + centre[1]);
    let corners = [[x - width / 2.0, y - height / 2.0], [x + width / 2.0, y + height / 2.0]];
    let points = (4..row.len()).step_by(2).map(|at| [pair(at)[0] + centre[0], pair(at)[1] + centre[1]]);
    corners.into_iter().chain(points).collect()
}

fn bounds(detection: &Detection) -> PersonBox {
    let ([x0, y0], [x1, y1]) = (detection.points[0], detection.points[1]);
    PersonBox { x: x0 as f32, y: y0 as f32, width: (x1 - x0) as f32, height: (y1 - y0) as f32, score: 0.0 }
}

/// Score-weighted average of the positions of overlapping detections, with the best score.
fn average(overlapping: &[Detection]) -> Detection {
    let sum: f64 = overlapping.iter().map(|detection| detection.score).sum();
    let point = |at: usize| {
        let along = |axis: usize| overlapping.iter().map(|one| one.points[at][axis] * one.score).sum::<f64>() / sum;
        [along(0), along(1)]
    };
    Detection { score: overlapping[0].score, points: (0..overlapping[0].points.len()).map(point).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_match_those_of_the_models() {
        assert_eq!(anchors(192, &[8, 16, 16, 16]).len(), 2016);
        assert_eq!(anchors(224, &[8, 16, 32, 32, 32]).len(), 2254);
        let palm = anchors(192, &[8, 16, 16, 16]);
        assert_eq!((palm[0], palm[1], palm[2]), ([0.5 / 24.0; 2], [0.5 / 24.0; 2], [1.5 / 24.0, 0.5 / 24.0]));
        assert_eq!(palm[24 * 24 * 2 + 6], [1.5 / 12.0, 0.5 / 12.0]);
    }

    #[test]
    fn overlapping_detections_are_averaged() {
        let anchors = anchors(32, &[16]);
        let mut rows = vec![0.0; anchors.len() * 6];
        let mut logits = vec![-50.0; anchors.len()];
        for (at, (dx, logit)) in [(0, (0.0, 2.0)), (1, (1.0, 2.0)), (6, (0.0, 0.5))] {
            rows[at * 6..at * 6 + 6].copy_from_slice(&[dx, 0.0, 10.0, 8.0, dx + 2.0, 3.0]);
            logits[at] = logit;
        }
        let found = decode(&rows, &logits, &anchors, 32, 0.5, 0.3).unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].points, [[3.5, 4.0], [13.5, 12.0], [10.5, 11.0]]);
        assert!((found[1].points[2][0] - 26.0).abs() < 1e-9 && (found[1].points[2][1] - 27.0).abs() < 1e-9);
        rows[0] = f32::NAN;
        assert_eq!(decode(&rows, &logits, &anchors, 32, 0.5, 0.3).unwrap().len(), 2);
        assert!(decode(&rows[6..], &logits, &anchors, 32, 0.5, 0.3).is_err());
    }
}
