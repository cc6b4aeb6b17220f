//! Boxes with scores, and which of several that overlap stays.

use orator_base::types::pose2d::PersonBox;

/// Shared area over joint area of two boxes, 0..1; 0 where either has none.
pub fn overlap(a: &PersonBox, b: &PersonBox) -> f32 {
    let shared = |a0: f32, aw: f32, b0: f32, bw: f32| ((a0 + aw).min(b0 + bw) - a0.max(b0)).max(0.0);
    let both = shared(a.x, a.width, b.x, b.width) * shared(a.y, a.height, b.y, b.height);
    let either = a.width * a.height + b.width * b.height - both;
    if both > 0.0 && either > 0.0 { both / either } else { 0.0 }
}

/// The boxes by falling score, without those that overlap a better one by more than `max_overlap`.
pub fn best(mut boxes: Vec<PersonBox>, max_overlap: f32) -> Vec<PersonBox> {
    boxes.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<PersonBox> = Vec::new();
    for candidate in boxes {
        if kept.iter().all(|better| overlap(better, &candidate) <= max_overlap) {
            kept.push(candidate);
        }
    }
    kept
}

/// A box from two corners, if its numbers are finite and it has an area.
pub fn from_corners([x0, y0, x1, y1]: [f32; 4], score: f32) -> Option<PersonBox> {
    let found = PersonBox { x: x0, y: y0, width: x1 - x0, height: y1 - y0, score };
    let sound = [x0, y0, x1, y1, score].iter().all(|number| number.is_finite());
    (sound && found.width > 0.0 && found.height > 0.0).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_overlapping_boxes_the_better_stays() {
        let at = |x: f32, score: f32| from_corners([x, 0.0, x + 10.0, 10.0], score).unwrap();
        assert!((overlap(&at(0.0, 1.0), &at(5.0, 1.0)) - 1.0 / 3.0).abs() < 1e-6);
        let kept = best(vec![at(0.0, 0.5), at(1.0, 0.9), at(8.0, 0.7)], 0.45);
        assert_eq!(kept.iter().map(|b| b.score).collect::<Vec<_>>(), [0.9, 0.7]);
        assert_eq!(from_corners([0.0, 0.0, f32::NAN, 1.0], 1.0), None);
        assert_eq!(from_corners([5.0, 0.0, 5.0, 1.0], 1.0), None);
    }
}
