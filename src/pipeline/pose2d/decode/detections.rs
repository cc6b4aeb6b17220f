//! Detectors that give finished boxes: rows of x0, y0, x1, y1, score, with a class label each (RTMDet and the like).

use super::boxes;
use orator_base::types::pose2d::PersonBox;

/// The boxes in `rows` (5 numbers each) scoring above `min_score` whose label is `person`; no labels: all of them.
pub fn decode(rows: &[f32], labels: Option<&[i64]>, person: i64, min_score: f32, max_overlap: f32) -> Vec<PersonBox> {
    let wanted = |idx: usize| labels.is_none_or(|labels| labels.get(idx) == Some(&person));
    let found = rows.chunks_exact(5).enumerate().filter(|(idx, row)| row[4] > min_score && wanted(*idx));
    boxes::best(
        found.filter_map(|(_, row)| boxes::from_corners([row[0], row[1], row[2], row[3]], row[4])).collect(),
        max_overlap,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_people_with_a_score_and_an_area() {
        let rows = [
            [10.0, 20.0, 30.0, 60.0, 0.8],
            [0.0; 5],
            [50.0, 20.0, 70.0, 60.0, 0.9],
            [90.0, 20.0, f32::NAN, 60.0, 0.9],
            [11.0, 20.0, 30.0, 60.0, 0.2],
        ]
        .concat();
        let found = decode(&rows, Some(&[0, 0, 7, 0, 0]), 0, 0.3, 0.6);
        assert_eq!(found, [PersonBox { x: 10.0, y: 20.0, width: 20.0, height: 40.0, score: 0.8 }]);
        assert_eq!(decode(&rows, None, 0, 0.3, 0.6).len(), 2);
    }
}
