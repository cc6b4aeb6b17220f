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
