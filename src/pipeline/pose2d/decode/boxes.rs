//! Scored boxes and non-maximum suppression.

use orator_base::types::pose2d::PersonBox;

/// Intersection over union of two boxes, 0..1; 0 if it is undefined.
pub fn overlap(a: &PersonBox, b: &PersonBox) -> f32 {
    let shared = |a0: f32, aw: f32, b0: f32, bw: f32| ((a0 + aw).min(b0 + bw) - a0.max(b0)).max(0.0);
    let both = shared(a.x, a.width, b.x, b.width) * shared(a.y, a.height, b.y, b.height);
    let either = a.width * a.height + b.width * b.height - both;
    if both > 0.0 && either > 0.0 { both / either } else { 0.0 }
}

/// Non-maximum suppression: boxes, best first, without those that overlap a better one by more than `max_overlap`.
pub fn non_max_suppression(mut boxes: Vec<PersonBox>, max_overlap: f32) -> Vec<PersonBox> {
    boxes.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut accepted: Vec<PersonBox> = Vec::new();
    for candidate in boxes {
        if accepted.iter().all(|better| overlap(better, &candidate) <= max_overlap) {
            accepted.push(candidate);
        }
    }
    accepted
}

/// Box from two corners; `None` if a value is not finite or the area is empty.
pub fn from_corners([x0, y0, x1, y1]: [f32; 4], score: f32) -> Option<PersonBox> {
    let found = PersonBox { x: x0, y: y0, width: x1 - x0, height: y1 - y0, score };
    let is_valid = [x0, y0, x1, y1, score].iter().all(|number| number.is_finite());
    (is_valid && found.width > 0.0 && found.height > 0.0).then_some(found)
}

/// Boxes of a detector with built-in decoding (RTMDet and similar): the rows (x0, y0, x1, y1, score) above `min_score`
/// with the label `person`, or all if there are no labels.
pub fn detections(
    rows: &[f32],
    labels: Option<&[i64]>,
    person: i64,
    min_score: f32,
    max_overlap: f32,
) -> Vec<PersonBox> {
    let is_person = |idx: usize| labels.is_none_or(|labels| labels.get(idx) == Some(&person));
    let found = rows.chunks_exact(5).enumerate().filter(|(idx, row)| row[4] > min_score && is_person(*idx));
    non_max_suppression(
        found.filter_map(|(_, row)| from_corners([row[0], row[1], row[2], row[3]], row[4])).collect(),
        max_overlap,
    )
}
